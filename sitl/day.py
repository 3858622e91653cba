"""A day under the net: its file, its aircraft, and its flight."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from math import cos, pi, sin
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from protocol.dialect import mavlink
from protocol.errors import ProtocolError
from protocol.flight_log.flight_page import flight_page, require_plotly
from protocol.flight_log.flight_series import FlightEvent, Prism, flight_series
from protocol.flight_plans.flight_plan import EnuPoint
from protocol.frames import LocalFrame
from protocol.names import FAILURE_TYPES, FAILURE_UNITS, Mode
from protocol.tlog import read_tlog
from protocol.tools.files import write_atomically
from sitl.autopilot.answers import ACCEPTED, DENIED, Answer
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import World
from sitl.defaults import AIRFRAME, HOME
from sitl.enclosure.arena_files import Arena, Obstacle, load_arena
from sitl.errors import SitlError
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.node import Node
from sitl.model.airframe_files import load
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.tools.persistence import StateFolder, load_checked_plan
from sitl.tools.toml_table import TomlTable, toml_content
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

# Days from TOML files: every key is known and every value checked; docs/day.md describes the format.

MAX_DURATION = 7200.0  # [s]
DAY_KEYS = {
    "name", "seed", "duration", "arena", "plan", "plan_names", "airframe", "sensors", "navigation", "parameters",
    "wind", "operator", "failure",
}  # fmt: skip
ACTION_KEYS = {"at", "block", "waypoint", "to", "variable", "parameter", "value", "mode", "arm"}
ACTIONS = ("block", "waypoint", "variable", "parameter", "mode", "arm")


class DayError(SitlError):
    """A day cannot be flown as it is written; the message names file, key and value."""


class OperatorAction(NamedTuple):
    """An action of the operator at a time."""

    at: float  # [s]
    kind: str  # of ACTIONS
    name: str  # of the block, waypoint, variable, parameter or mode; empty for arming
    value: tuple[float, ...] = ()  # east, north, height of a waypoint [m]; a value; 1 to arm, 0 to disarm


class PlannedFailure(NamedTuple):
    """A failure at a time, and its duration."""

    at: float  # [s]
    unit: str  # of FAILURE_UNITS
    failure: str  # of FAILURE_TYPES
    instance: int  # 1 left, 2 right, 0 all
    lasts: float  # [s]; infinite: for good


class Day(NamedTuple):
    """A day as it is written."""

    name: str
    seed: int
    duration: float  # [s]
    arena: str  # name or path
    plan: Path | None
    plan_names: Path | None
    airframe: str | None  # name or path
    sensors: Path | None
    navigation: Navigation | None  # None: that of the arena
    parameters: dict[str, float]
    schedule: tuple[tuple[float, float], ...]  # of the wind wall: time [s], speed [m/s]
    bursts: tuple[tuple[float, float, float], ...]  # begin [s], duration [s], rise [m/s]
    actions: tuple[OperatorAction, ...]
    failures: tuple[PlannedFailure, ...]
    file: Path  # that says all this


def load_day(path: Path) -> Day:
    """Read a day; files that it names stand beside it.

    Raises:
        DayError: The file cannot be read, or something in it is missing, unknown or out of bounds.
    """
    content = toml_content(path, DayError)
    table = TomlTable(str(path), content, "", DAY_KEYS, DayError)
    duration = table.number("duration", 1.0, MAX_DURATION)
    wind = TomlTable(str(path), content.get("wind", {}), "wind", {"schedule", "gusts"}, DayError)
    day = Day(
        name=table.text("name"),
        seed=int(table.number("seed", 0, 2**31 - 1, 1)),
        duration=duration,
        arena=_shipped_or_beside(path, table.text("arena")),
        plan=_beside(path, table, "plan"),
        plan_names=_beside(path, table, "plan_names"),
        airframe=_shipped_or_beside(path, table.text("airframe")) if table.has("airframe") else None,
        sensors=_beside(path, table, "sensors"),
        navigation=_navigation(table),
        parameters=_parameters(path, content.get("parameters", {})),
        schedule=tuple((time, speed) for time, speed in wind.lines("schedule", 2)),
        bursts=tuple((begin, lasts, rise) for begin, lasts, rise in wind.lines("gusts", 3)),
        actions=tuple(_action(path, entry, k, duration) for k, entry in enumerate(table.tables("operator"))),
        failures=tuple(_failure(path, entry, k, duration) for k, entry in enumerate(table.tables("failure"))),
        file=path,
    )
    if any(later[0] <= earlier[0] for earlier, later in pairwise(day.schedule)):
        raise wind.error("schedule", "has times that do not increase")
    return day


def _beside(path: Path, table: TomlTable, key: str) -> Path | None:
    return path.parent / table.text(key) if table.has(key) else None


def _shipped_or_beside(path: Path, name: str) -> str:
    """The name of what is shipped, or the path of a file beside the day."""
    return str(path.parent / name) if name.endswith(".toml") else name


def _navigation(table: TomlTable) -> Navigation | None:
    return Navigation(table.choice("navigation", [n.value for n in Navigation])) if table.has("navigation") else None


def _parameters(path: Path, given: object) -> dict[str, float]:
    if not isinstance(given, dict):
        raise DayError(f"{path}: parameters must be a table")
    table = TomlTable(str(path), given, "parameters", set(given), DayError)
    return {name: table.number(name, -1e9, 1e9) for name in given}


def _action(path: Path, entry: dict[str, Any], number: int, duration: float) -> OperatorAction:
    table = TomlTable(str(path), entry, f"operator[{number}]", ACTION_KEYS, DayError)
    kinds = [kind for kind in ACTIONS if table.has(kind)]
    if len(kinds) != 1:
        raise table.error("", f"must have one of {', '.join(ACTIONS)}")
    kind, at = kinds[0], table.number("at", 0.0, duration)
    if kind == "arm":
        return OperatorAction(at, kind, "", (float(table.flag("arm")),))
    value: tuple[float, ...] = ()
    if kind == "waypoint":
        value = tuple(table.numbers("to", 3, -1e5, 1e5))
    elif kind in {"variable", "parameter"}:
        value = (table.number("value", -1e9, 1e9),)
    return OperatorAction(at, kind, table.text(kind), value)


def _failure(path: Path, entry: dict[str, Any], number: int, duration: float) -> PlannedFailure:
    keys = {"at", "unit", "failure", "instance", "lasts"}
    table = TomlTable(str(path), entry, f"failure[{number}]", keys, DayError)
    return PlannedFailure(
        at=table.number("at", 0.0, duration),
        unit=table.choice("unit", list(FAILURE_UNITS)),
        failure=table.choice("failure", [name for name in FAILURE_TYPES if name != "ok"]),
        instance=int(table.number("instance", 0, 2, 0)),
        lasts=table.number("lasts", 0.01, MAX_DURATION, float("inf")),
    )


# An aircraft whose day happens to it: the operator acts and things fail at their times, flown fast or live.


class DayEvent(NamedTuple):
    """Something that happened in the day."""

    time: float  # [s]
    kind: str  # operator, failure, block or end
    text: str
    is_refused: bool = False


class _Due(NamedTuple):
    at: float
    kind: str
    text: str
    do: Callable[[], Answer]


class DayAircraft(Aircraft):
    """The vehicle of a day, on the ground of its arena.

    Attributes:
        day: What was asked for.
        happened: What has happened so far.

    Args:
        day: The day.

    Raises:
        DayError: Something that the day names cannot be used.
    """

    def __init__(self, day: Day) -> None:
        self.day = day
        self.happened: list[DayEvent] = []
        self._block = ""
        try:
            self._prepare(day)
        except (SitlError, ProtocolError) as error:
            raise DayError(f"{day.file}: {error}") from error
        due = [_Due(a.at, "operator", _words(a), partial(self._act, a)) for a in day.actions]
        for failure in day.failures:
            due += self._failing(failure)
        due.append(_Due(day.duration, "end", "The day is over; the vehicle goes on", lambda: Answer(ACCEPTED)))
        self._due = sorted(due, key=lambda event: event.at)

    def _prepare(self, day: Day) -> None:
        """Put the vehicle into its arena, with its plan."""
        arena = load_arena(day.arena)
        if arena.wall is not None:
            arena = arena._replace(wall=arena.wall._replace(schedule=day.schedule, bursts=day.bursts))
        elif day.schedule or day.bursts:
            raise DayError(f"wind: the arena '{arena.name}' has no wind wall")
        planned = load_checked_plan(day.plan, day.plan_names) if day.plan is not None else None
        vehicle = Simulation(
            load(day.airframe or AIRFRAME).parameters,
            seed=day.seed,
            navigation=day.navigation or (Navigation.MOCAP if arena.has_net else Navigation.SENSORS),
            sensors=load_sensors(None if day.sensors is None else str(day.sensors)),
            aligned=False,
        )
        origin = HOME if planned is None else planned.origin
        settings = Configuration(Settings(), vehicle.tuning, WorldSettings()).replaced(day.parameters)
        super().__init__(vehicle, World(LocalFrame(origin), arena), settings)
        if planned is not None:
            planned.require_flown()
            self.autopilot.flight_plan.load(planned.check, planned.mapping)
            self.autopilot.set_mode(Mode.FLIGHT_PLAN)

    @property
    def is_over(self) -> bool:
        """Whether the day has ended, or the vehicle is broken."""
        return self.vehicle.time >= self.day.duration or self.vehicle.crash is not None

    def _decide(self) -> None:
        while self._due and self._due[0].at <= self.vehicle.time:
            event = self._due.pop(0)
            answer = event.do()
            refused = answer.result != ACCEPTED
            text = f"{event.text}: {answer.text or 'refused'}" if refused else event.text
            self.happened.append(DayEvent(self.vehicle.time, event.kind, text, refused))
            self.autopilot.say(mavlink.MAV_SEVERITY_WARNING if refused else mavlink.MAV_SEVERITY_INFO, text)
        super()._decide()
        self._note_block()

    def _note_block(self) -> None:
        executor = self.autopilot.flight_plan.executor
        if executor is not None and executor.flow.present.name != self._block:
            self._block = executor.flow.present.name
            self.happened.append(DayEvent(self.vehicle.time, "block", f"block {self._block}"))

    def _act(self, action: OperatorAction) -> Answer:
        autopilot = self.autopilot
        if action.kind == "block":
            return autopilot.flight_plan.jump_to_block(action.name)
        if action.kind == "waypoint":
            return autopilot.flight_plan.move_waypoint(action.name, EnuPoint(*action.value))
        if action.kind == "variable":
            return autopilot.flight_plan.set_variable(action.name, action.value[0])
        if action.kind == "parameter":
            return self._set_parameter(action.name, action.value[0])
        if action.kind == "arm":
            return autopilot.arming.arm() if action.value[0] else autopilot.arming.disarm()
        if action.name not in Mode.__members__:
            return Answer(DENIED, f"there is no mode {action.name}: there are {', '.join(Mode.__members__)}")
        return autopilot.set_mode(Mode[action.name])

    def _set_parameter(self, name: str, value: float) -> Answer:
        try:
            self.configure(self.configuration.replaced({name: value}))
        except SitlError as error:
            return Answer(DENIED, str(error))
        return Answer(ACCEPTED)

    def _failing(self, failure: PlannedFailure) -> list[_Due]:
        words = failure.unit if failure.instance == 0 else f"{failure.unit} {failure.instance}"

        def inject(kind: str) -> Callable[[], Answer]:
            return lambda: self.failures.inject(FAILURE_UNITS[failure.unit], FAILURE_TYPES[kind], failure.instance)

        begins = _Due(failure.at, "failure", f"failure: {words} {failure.failure}", inject(failure.failure))
        heals = _Due(failure.at + failure.lasts, "failure", f"failure over: {words}", inject("ok"))
        return [begins, heals]


def _words(action: OperatorAction) -> str:
    if action.kind == "arm":
        return "operator arms" if action.value[0] else "operator disarms"
    if action.kind == "waypoint":
        east, north, up = action.value
        return f"operator moves {action.name} to {east:g} m east, {north:g} m north, {up:g} m up"
    if action.kind in {"variable", "parameter"}:
        return f"operator sets {action.name} to {action.value[0]:g}"
    return f"operator: {action.kind} {action.name}"


# A day flown as fast as it goes, recorded whole, and its page.


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
    began = time.monotonic()
    log = fly_recorded(aircraft, folder, lambda: aircraft.is_over)
    return FlownDay(aircraft, log, aircraft.vehicle.time, time.monotonic() - began)


def fly_recorded(aircraft: Aircraft, folder: Path, is_over: Callable[[], bool]) -> Path:
    """Fly an aircraft as fast as it goes, whole telemetry and truth recorded; gives the log.

    Args:
        aircraft: At its beginning.
        folder: For the record, and for what the vehicle stores.
        is_over: Whether the flight has ended.

    Raises:
        SitlError: The simulation leaves the finite numbers; the log up to there is in the folder.
    """
    recorder = FlightRecorder(folder, lambda: EPOCH, whole=True, also={mavlink.MAVLINK_MSG_ID_DARKO_TRUTH: TRUTH_RATE})
    node = Node(aircraft, StateFolder(folder), recorder=recorder)
    try:
        while not is_over():
            node.advance(node.periods_to_fly())
            node.datagrams(aircraft.vehicle.time)
    finally:
        recorder.close()
    return folder / recorder.logs()[-1].name


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


def run_day(args: argparse.Namespace) -> int:
    """Fly the day of the command line and write its page; exit code 1 if it crashed or refused a request.

    Raises:
        SitlError: A file cannot be used or written.
    """
    day = load_day(args.file)
    if args.seed is not None:
        day = day._replace(seed=args.seed)
    page = args.out or Path(args.file.stem + ".html")
    try:
        require_plotly()
        with TemporaryDirectory() as folder:
            flown = fly_day(day, Path(folder))
            write_atomically(page, day_page(flown).encode())
            if args.log is not None:
                write_atomically(args.log, flown.log.read_bytes())
    except ProtocolError as error:
        raise SitlError(str(error)) from error
    for event in flown.aircraft.happened:
        print(f"{event.time:8.2f} s  {event.text}")
    print(
        f"{flown.verdict}: {flown.seconds:.1f} s in {flown.took:.1f} s, {flown.seconds / flown.took:.0f}x; page {page}"
    )
    return int(flown.aircraft.vehicle.crash is not None or bool(flown.refused))
