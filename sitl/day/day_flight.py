"""A day flown as fast as it goes, recorded whole, and its page."""

from __future__ import annotations

import time
from math import cos, pi, sin
from pathlib import Path
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.flight_log.flight_page import flight_page
from protocol.flight_log.flight_series import FlightEvent, Prism, flight_series
from protocol.tlog import read_tlog
from sitl.day.day_aircraft import DayAircraft, DayEvent
from sitl.day.day_file import Day
from sitl.enclosure.geometry import Arena, Obstacle
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.node import Node
from sitl.tools.persistence import StateFolder

TRUTH_RATE = 10.0  # in the record [Hz]
PILLAR_SIDES = 16  # of a round pillar in the picture
WALL_DEPTH = 0.3  # of a wind wall in the picture [m]
EPOCH = 0.0  # of a record's time stamps: the same day gives the same bytes [s since 1970]


class FlownDay(NamedTuple):
    """Result of a day."""

    aircraft: DayAircraft
    log: Path
    seconds: float  # of flight [s]
    took: float  # [s]

    @property
    def refused(self) -> list[DayEvent]:
        """Requests of the day that the vehicle refused."""
        return [event for event in self.aircraft.happened if event.is_refused]

    @property
    def verdict(self) -> str:
        """End of the day, in words."""
        crash = self.aircraft.vehicle.crash
        if crash is not None:
            return f"crashed at {crash.speed:.1f} m/s after {self.seconds:.1f} s"
        if self.refused:
            count = len(self.refused)
            return f"flown to its end; the vehicle refused {count} request{'s' * (count != 1)}"
        return "flown as written"


def fly_day(day: Day, folder: Path) -> FlownDay:
    """Fly a day and record it.

    Args:
        day: The day.
        folder: For the record, and for what the vehicle stores.

    Raises:
        SitlError: A file that the day names cannot be used.
    """
    aircraft = DayAircraft(day)
    recorder = FlightRecorder(folder, lambda: EPOCH, whole=True, also={mavlink.MAVLINK_MSG_ID_DARKO_TRUTH: TRUTH_RATE})
    node = Node(aircraft, StateFolder(folder), recorder=recorder)
    began = time.monotonic()
    while not aircraft.is_over:
        node.advance(node.periods_to_fly())
        node.datagrams(aircraft.vehicle.time)
    recorder.close()
    log = folder / recorder.logs()[-1].name
    return FlownDay(aircraft, log, aircraft.vehicle.time, time.monotonic() - began)


def day_page(flown: FlownDay) -> str:
    """The page about a day.

    Raises:
        MissingPlotlyError: Plotly is not installed.
    """
    day, aircraft = flown.aircraft.day, flown.aircraft
    series = flight_series(read_tlog(flown.log), day.name)
    events = [FlightEvent(e.time, e.kind, e.text) for e in aircraft.happened]
    known = {e.text for e in series.events}
    merged = sorted([*series.events, *(e for e in events if e.text not in known)], key=lambda e: e.time)
    arena = aircraft.autopilot.world.arena
    preamble = [
        ("Outcome", flown.verdict),
        ("Arena", f"{arena.name}, {2 * arena.half_length:g} x {2 * arena.half_width:g} x {arena.height:g} m"),
        ("Flight plan", str(day.plan.name) if day.plan is not None else "none"),
        ("Navigation", str(aircraft.vehicle.avionics.navigation.value)),
        ("Seed", str(day.seed)),
    ]
    return flight_page(series.with_events(merged), title=day.name, scenery=scenery_of(arena), preamble=preamble)


def scenery_of(arena: Arena) -> list[Prism]:
    """Scenery of an arena, for a picture."""
    found = [_solid(obstacle) for obstacle in arena.obstacles]
    if arena.has_net:
        corners = [(x * arena.half_length, y * arena.half_width) for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
        found.append(Prism("net", tuple(_placed(arena, *c) for c in corners), 0.0, arena.height, hollow=True))
    if arena.wall is not None:
        outlet = arena.wall.outlet
        (x, y, z), along = outlet.centre, outlet.along
        edge = [(s * outlet.half_width, d) for s, d in ((1, 0.0), (-1, 0.0), (-1, WALL_DEPTH), (1, WALL_DEPTH))]
        foot = tuple((x - along.x * d - along.y * s, -(y - along.y * d + along.x * s)) for s, d in edge)
        found.append(Prism("wind wall", foot, max(z - outlet.half_height, 0.0), z + outlet.half_height))
    return found


def _solid(o: Obstacle) -> Prism:
    if o.is_round:
        turns = [2.0 * pi * k / PILLAR_SIDES for k in range(PILLAR_SIDES)]
        rim = tuple((o.north + o.half_length * cos(t), -o.west - o.half_length * sin(t)) for t in turns)
        return Prism(o.name, rim, o.bottom, o.top)
    c, s = cos(o.course), sin(o.course)
    ends = [(x * o.half_length, y * o.half_width) for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    return Prism(o.name, tuple((o.north + x * c - y * s, -(o.west + x * s + y * c)) for x, y in ends), o.bottom, o.top)


def _placed(arena: Arena, ahead: float, left: float) -> tuple[float, float]:
    north, west, _ = arena.outside(ahead, left)
    return north, -west
