"""From one signing key to the next, without a moment at which nobody can give orders.

https://mavlink.io/en/guide/message_signing.html. SETUP_SIGNING, signed with the key in force, brings the new one; the
vehicle believes it when a frame comes that is signed with it. Both sides keep the old key until they have seen the
other use the new one, and for good if they never do.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import time
from contextlib import AsyncExitStack

from darko_gcs.errors import GroundError, LinkError
from darko_gcs.link import Link
from darko_gcs.signing import SigningDesk, open_keyring
from darko_gcs.station import Station
from protocol.codec import Codec, Source
from protocol.dialect import mavlink
from protocol.endpoint import GROUND_SYSTEM, GroundEndpoint
from protocol.errors import FileError
from protocol.signing import Signature, load_key, sign_frame

__all__ = ["KeyChangeover", "change_key"]

POLL = 0.02  # [s]
HEARD_WITHIN = 30.0  # [s] a vehicle is waited for
AGAIN = 1.0  # [s] between the proposals
TRIES = 5
PATIENCE = 9.0  # [s] after the last proposal; a vehicle holds it for 10 s
PROBE_LINK = 255  # signs frames of its own stream
IN_CLEAR = "the key was NOT sent: it would cross this link in clear. Change it over loopback"


class KeyChangeover:
    """Proposes a key and proves to have it, until the vehicle signs with it; the keyring then has it, too.

    Args:
        endpoint: The ground station's, with the key in force.
        desk: Knows whether the vehicle is on loopback: over no other link is a key sent.
        key: The new one.

    Raises:
        GroundError: The link is not signed or has this key already.
    """

    def __init__(self, endpoint: GroundEndpoint, desk: SigningDesk, key: bytes) -> None:
        if not endpoint.keyring.is_on:
            raise GroundError("no key is in force: a vehicle's first key is given by --give-key")
        if endpoint.keyring.key(None) == key:
            raise GroundError("the new key is the one in force")
        self._endpoint, self._desk, self._key = endpoint, desk, key
        self._left, self._next = TRIES, -math.inf

    @property
    def is_done(self) -> bool:
        """True as soon as the vehicle signs with the new key."""
        return self._endpoint.keyring.key(None) == self._key

    def handle_timer(self, now: float) -> None:
        """Propose once more, if it is time to.

        Raises:
            GroundError: The vehicle is not on loopback: no key was sent.
            LinkError: It never signed with the new key; the old one stays in force.
        """
        vehicle = self._endpoint.vehicle
        if self.is_done or vehicle is None or now < self._next:
            return
        if not self._desk.is_private:
            raise GroundError(IN_CLEAR)
        if not self._left:
            raise LinkError("the vehicle did not take the new key: the old one stays in force")
        self._left -= 1
        self._next = now + (AGAIN if self._left else PATIENCE)
        self._propose(vehicle)

    def _propose(self, vehicle: Source) -> None:
        keyring = self._endpoint.keyring
        keyring.propose(None, self._key, keyring.next_timestamp(), signed=True)  # our side waits as the vehicle does
        self._endpoint.send_key(self._key, keyring.next_timestamp(), vehicle)
        plain = Codec(GROUND_SYSTEM, mavlink.MAV_COMP_ID_MISSIONPLANNER).encode(
            mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
        )
        self._endpoint.send_frame(sign_frame(plain, self._key, Signature(PROBE_LINK, keyring.next_timestamp())))


async def change_key(args: argparse.Namespace) -> Source:
    """Have the vehicle that is heard take another key; its system and component.

    Raises:
        GroundError: A key, the link or the vehicle fails; the message says which key is in force.
    """
    try:
        key = load_key(args.new_key)
    except FileError as error:
        raise GroundError(f"--new-key: {error}") from error
    async with AsyncExitStack() as stack:
        station = Station(keyring=open_keyring(args.signing_key), vehicle=args.vehicle)
        changeover = KeyChangeover(station.endpoint, station.signing, key)
        link = Link(station)
        stack.push_async_callback(link.close)
        await link.open(args.host, args.port)
        until = time.monotonic() + HEARD_WITHIN
        while not changeover.is_done:
            if station.endpoint.vehicle is None and time.monotonic() > until:
                raise LinkError(f"no vehicle that signs with the old key heard within {HEARD_WITHIN:g} s")
            changeover.handle_timer(link.now)
            await asyncio.sleep(POLL)
        vehicle = station.endpoint.vehicle
        if vehicle is None:
            raise LinkError("the vehicle was lost")
        return vehicle
