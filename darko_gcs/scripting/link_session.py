"""A station on its link for the time of one job, and what a time-out says: what lacked, and the last state seen."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from darko_gcs.errors import FlightError
from darko_gcs.feed.links import UdpLink, link_to
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.station.station import Station
from protocol.dialect import mavlink

POLL_PERIOD = 0.01  # [s]
ANSWER_TIMEOUT = 30.0  # for an upload or a command [s]
VEHICLE_TIMEOUT = 30.0  # for the first heartbeat of a vehicle that is already running [s]


@asynccontextmanager
async def open_link(station: Station, host: str, port: int) -> AsyncIterator[UdpLink]:
    """The open link of a station; it is closed at the end.

    Args:
        station: Talks to the vehicle.
        host: Local address to listen on, or an address to connect to (``udpout:``, ``tcp:``, ``serial:``).
        port: Local port to listen on.

    Raises:
        LinkError: If the port is not available, or nothing answers.
    """
    link = link_to(station, host)
    try:
        await link.open(host, port)
        yield link
    finally:
        await link.close()


TEXT_TIME = 0.5  # in which the words of a refusal follow its number [s]
What = str | Callable[[Snapshot], str]  # what is waited for; a function says what is missing at the moment


def report(s: Snapshot) -> dict[str, Any]:
    """Present state of a vehicle, by the names of its JSON; None where it is not known."""
    v = s.position.v
    return {
        "vehicle": None if s.identity.source is None else s.identity.source[0],
        "time": s.link.boot,
        "mode": s.status.mode,
        "armed": s.status.armed,
        "law": s.hybrid.law,
        "v_hover": None if s.hybrid.state is None or math.isnan(s.hybrid.state.v_hover) else s.hybrid.state.v_hover,
        "position": None if s.position.p is None else [round(x, 3) for x in s.position.p],
        "speed": None if v is None else round(math.hypot(*v), 3),
        "heading": None if s.attitude.heading is None else round(math.degrees(s.attitude.heading) % 360.0, 1),
        "battery": s.battery.battery_status.charge_left,
        "jumps": len(s.hybrid.jumps),
        "lost": s.link.lost,
        "text": s.log.lines[-1].text if s.log.lines else None,
    }


def last_seen(s: Snapshot) -> str:
    """The last state of a vehicle in words."""
    if s.identity.source is None:
        return "no vehicle heard"
    armed = {True: "armed", False: "disarmed", None: "not known whether armed"}[s.status.armed]
    height = "" if s.position.relative_altitude is None else f", {s.position.relative_altitude:.1f} m high"
    lost = ", link lost" if s.link.lost else ""
    text = f', "{s.log.lines[-1].text}"' if s.log.lines else ""
    return f"{s.status.mode or 'mode unknown'}, {armed}{height}{lost}{text}"


def late_error(what: str, missing: str, s: Snapshot) -> FlightError:
    """The error of a request that is not done in time.

    Args:
        what: Happened.
        missing: What it waits for.
        s: What was seen last.
    """
    return FlightError(f"{what}: waited for {missing}; last seen: {last_seen(s)}", waited_for=missing, seen=report(s))


def unknown_time(s: Snapshot) -> str:
    """Words for the missing vehicle or its missing time."""
    return (
        "a vehicle" if s.identity.source is None else "a message with the vehicle's time: only its heartbeats are heard"
    )


def why_not_ready(s: Snapshot) -> str:
    """Words for the conditions that keep a vehicle from being armed."""
    missing = ["home is not known"] if s.position.home is None else []
    if s.status.prearm_ok is None:
        missing.append("the vehicle has not told whether it can be armed")
    elif not s.status.prearm_ok:
        warnings = [line.text for line in s.log.lines if line.severity <= mavlink.MAV_SEVERITY_WARNING]
        missing.append("its checks before arming fail" + (f": {warnings[-1]}" if warnings else ""))
    return f"ready to arm ({'; '.join(missing)})" if missing else "ready to arm"


def words_since(s: Snapshot, since: float, reason: str) -> list[str]:
    """Warnings and errors that the vehicle has sent since a time, oldest first.

    Args:
        s: What is known of it.
        since: [s].
        reason: Its bare answer; the station's own line, which ends with it, says no more.
    """
    lines = [line for line in s.log.lines if line.severity <= mavlink.MAV_SEVERITY_WARNING and line.time >= since]
    return [line.text for line in lines if not line.text.endswith(f": {reason}")]
