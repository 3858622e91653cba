"""Asks the vehicle to have something fail (MAV_CMD_INJECT_FAILURE), which its parameter SYS_FAILURE_EN must allow."""

from __future__ import annotations

import argparse
import asyncio

from darko_gcs.errors import GroundError, LinkError
from darko_gcs.feed.udp_link import UdpLink
from darko_gcs.state.text import reason_text
from darko_gcs.station.keyring_setup import open_keyring
from darko_gcs.station.station import Station
from darko_gcs.tasks.link_session import POLL_PERIOD, VEHICLE_TIMEOUT, open_link
from darko_gcs.tasks.progress import TEXT_TIME, words_since
from protocol.dialect import mavlink
from protocol.events import CommandDone
from protocol.names import FAILURE_TYPES, FAILURE_UNITS


async def request_failure(args: argparse.Namespace) -> str:
    """Send the command and wait for its answer.

    Args:
        args: Options of ``darko-gcs fail``.

    Returns:
        What was done, for a person.

    Raises:
        GroundError: The vehicle refused, or did not answer; the message says which.
    """
    station = Station(keyring=open_keyring(args.signing_key), vehicle=args.vehicle)
    async with open_link(station, args.host, args.port) as link:
        deadline = link.now + VEHICLE_TIMEOUT
        while station.endpoint.vehicle is None:
            if link.now > deadline:
                raise LinkError(f"no vehicle heard within {VEHICLE_TIMEOUT:g} s")
            await asyncio.sleep(POLL_PERIOD)
        asked = link.now
        station.inject_failure(asked, FAILURE_UNITS[args.unit], FAILURE_TYPES[args.failure], args.instance)
        done = await _answer(link)
        reason = reason_text(done.reason or "refused")
        if done.result != mavlink.MAV_RESULT_ACCEPTED:
            await asyncio.sleep(TEXT_TIME)
            said = words_since(station.snapshot, asked, reason)
            words = ": ".join((f"{args.unit} {args.failure}", reason, *said[-1:]))
            raise GroundError(words, result=done.result, said=said)
    return f"{args.unit} {args.failure}: accepted"


async def _answer(link: UdpLink) -> CommandDone:
    while True:
        for event in link.station.events():
            if isinstance(event, CommandDone) and event.command == mavlink.MAV_CMD_INJECT_FAILURE:
                return event
        await asyncio.sleep(POLL_PERIOD)
