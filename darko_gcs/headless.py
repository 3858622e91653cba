"""A whole flight without a screen: connect, upload, arm, fly, land."""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass, field

from darko_gcs.child import Child
from darko_gcs.errors import FlightError, GroundError, LinkError
from darko_gcs.link import Link
from darko_gcs.plans import Items
from darko_gcs.recording import default_folder, start_recording
from darko_gcs.signing import open_keyring
from darko_gcs.snapshot import Snapshot
from darko_gcs.station import Station
from darko_gcs.store import said
from darko_gcs.words import label
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.errors import FileError
from protocol.events import CommandDone, Event, MissionFailed, MissionUploaded, VehicleLost, VehicleRestarted
from protocol.exposure import exposure
from protocol.frames import Geodetic, Vector
from protocol.plans import MissionItem, load
from protocol.plans.geofence import fence_items, rally_items
from protocol.units import from_e7, from_local_e4, is_global_frame

__all__ = ["Summary", "fly_headless"]

POLL = 0.01  # [s]
READY_WITHIN = 1800.0  # [s] our own vehicle may take to compile, on however busy a machine, as long as it runs
HEARD_WITHIN = 120.0  # [s] a vehicle may take to be first heard
ANSWER_WITHIN = 30.0  # [s] for an upload or a command
HOVERS_AFTER = 3.0  # [s] a complete mission whose vehicle is still in the air had no landing
ON_GROUND = mavlink.MAV_LANDED_STATE_ON_GROUND


@dataclass
class Summary:
    """How a flight went."""

    mission: str
    log: str | None  # None: nothing is recorded
    items: int
    reached: list[int] = field(default_factory=list)
    miss: dict[int, float] = field(default_factory=dict)  # distance to each waypoint when it was reached [m]
    duration: float = 0.0  # vehicle's time from arming to disarming [s]
    distance: float = 0.0  # flown [m]
    height: float = 0.0  # greatest above home [m]
    energy: float = math.nan  # [J]
    energy_by_law: dict[str, float] = field(default_factory=dict)  # [J]
    jumps: int = 0

    def as_json(self) -> str:
        """For a program."""
        return json.dumps({key: None if value != value else value for key, value in vars(self).items()}, indent=1)  # noqa: PLR0124 - NaN

    def as_text(self) -> str:
        """For a person."""
        worst = max(self.miss.values(), default=math.nan)
        by_law = ", ".join(f"{law} {joules:.0f} J" for law, joules in self.energy_by_law.items())
        return "\n".join(
            (
                f"{self.mission}: flown and landed, {len(self.reached)} of {self.items} items reached",
                f"  time {self.duration:.1f} s, distance {self.distance:.1f} m, greatest height {self.height:.1f} m",
                f"  energy {self.energy:.0f} J, {self.jumps} jumps between laws",
                *([f"    {by_law}"] if by_law else []),
                f"  waypoints reached within {worst:.2f} m",
                f"  log {self.log or 'not recorded'}",
            )
        )


async def fly_headless(args: argparse.Namespace, sitl: Sequence[str]) -> Summary:
    """Fly a mission file from arming to disarming.

    Raises:
        GroundError: If the file, the link, the vehicle or the flight fails; the message says where.
    """
    try:
        plan = load(args.mission)
        fence, rally = fence_items(plan), rally_items(plan)
    except FileError as error:
        raise GroundError(str(error)) from error
    if not plan.items:
        raise GroundError(f"{args.mission}: the plan has no mission items")
    keyring = open_keyring(args.signing_key, give=args.give_key)
    recorder, path = None, None
    try:
        recorder, path = start_recording(args.record or default_folder())
    except GroundError as error:  # a flight matters more than its log
        _say(f"NOT RECORDING: {error}")
    async with AsyncExitStack() as stack:
        link = Link(Station(recorder, keyring, give_key=args.give_key, vehicle=args.vehicle))
        stack.callback(_tell_fault, link.station)
        stack.push_async_callback(link.close)
        port = await link.open(args.host, args.port)
        if warning := exposure(args.host, signed=keyring.is_on):
            _say(warning)
        child = None
        if args.sitl:
            if args.state_dir is None:  # a scripted flight starts from a vehicle that remembers nothing
                sitl = [*sitl, "--state-dir", stack.enter_context(tempfile.TemporaryDirectory())]
            child = await Child.start(port, sitl, _say)
            stack.push_async_callback(child.stop)
        log = None if path is None else str(path)
        pilot = _Pilot(link, child, Summary(str(args.mission), log, len(plan.items)), args.timeout)
        await pilot.fly(plan.items, fence, rally)
        return pilot.summary


class _Pilot:
    def __init__(self, link: Link, child: Child | None, summary: Summary, timeout: float) -> None:
        self._link, self._station, self._child = link, link.station, child
        self.summary = summary
        self._timeout = timeout
        self._last: Vector | None = None
        self._events: list[Event] = []

    async def fly(self, items: Items, fence: Items, rally: Items) -> None:
        await self._until(lambda s: s.source is not None or self._child is None or self._child.is_ready, READY_WITHIN)
        await self._until(lambda s: s.source is not None and s.home is not None and s.boot is not None, HEARD_WITHIN)
        _say("vehicle found")
        self._station.upload(items, self._link.now, fence=fence, rally=rally)
        for part in filter(None, (fence, rally, items)):
            await self._answer(MissionUploaded, "upload")
            _say(f"{len(part)} items uploaded")
        await self._until(lambda s: s.prearm_ok is not False, ANSWER_WITHIN)
        began = self._snapshot.boot or 0.0
        self._station.arm(self._link.now)
        await self._answer(CommandDone, "arming")
        self._station.start_mission(self._link.now)
        await self._answer(CommandDone, "mission start")
        _say("flying")
        await self._follow(items, began)
        self.summary.duration = (self._snapshot.boot or 0.0) - began
        if self._snapshot.energy is not None:
            used = enumerate(self._snapshot.energy.by_law)
            self.summary.energy = self._snapshot.energy.total
            self.summary.energy_by_law = {label(Law, law): joules for law, joules in used if joules > 0.0}
        self.summary.jumps = len(self._snapshot.jumps)

    @property
    def _snapshot(self) -> Snapshot:
        return self._station.snapshot

    async def _follow(self, items: Sequence[MissionItem], began: float) -> None:
        ordered_down = False
        complete_since: float | None = None
        while True:
            await self._pause()
            s = self._snapshot
            self._measure(s, items)
            if s.armed is False:
                break
            if (s.boot or 0.0) - began > self._timeout:
                raise FlightError(f"not done after {self._timeout:g} s: last item reached {self._last_reached()}")
            if s.mission_state == mavlink.MISSION_STATE_COMPLETE and complete_since is None:
                complete_since = s.boot or 0.0
            hovering = complete_since is not None and (s.boot or 0.0) - complete_since > HOVERS_AFTER
            if hovering and s.landed_state != ON_GROUND and not ordered_down:
                ordered_down = True  # the mission had no landing
                self._station.land(self._link.now)
        missing = [seq for seq in range(len(items)) if seq not in self._snapshot.reached]
        if missing:
            raise FlightError(f"on the ground with items {missing} not reached: {self._last_words()}")

    def _measure(self, s: Snapshot, items: Sequence[MissionItem]) -> None:
        if s.p is None:
            return
        if self._last is not None:
            self.summary.distance += math.dist(self._last, s.p)
        self._last = s.p
        self.summary.height = max(self.summary.height, s.home_p[2] - s.p[2])
        for seq in sorted(s.reached - set(self.summary.reached)):
            self.summary.reached.append(seq)
            place = _place(items[seq], s)
            if place is not None:
                self.summary.miss[seq] = math.dist(place, s.p)

    async def _answer(self, kind: type[Event], what: str) -> None:
        def answered(_: Snapshot) -> bool:
            return any(isinstance(event, kind | MissionFailed) for event in self._events)

        await self._until(answered, ANSWER_WITHIN, what)
        event = next(e for e in self._events if isinstance(e, kind | MissionFailed))
        self._events.remove(event)
        refused = isinstance(event, CommandDone) and event.result != mavlink.MAV_RESULT_ACCEPTED
        if refused or isinstance(event, MissionFailed):
            await asyncio.sleep(0.2)  # the vehicle's own words follow its answer
            raise FlightError(f"{what}: {said(getattr(event, 'reason', ''))}: {self._last_words()}")

    async def _until(self, holds: Callable[[Snapshot], bool], within: float, what: str = "vehicle") -> None:
        deadline = self._link.now + within
        while not holds(self._snapshot):
            await self._pause()
            if self._link.now > deadline:
                if self._snapshot.source is None:
                    raise LinkError(f"no vehicle heard for {within:g} s")
                raise FlightError(f"{what}: no answer for {within:g} s")

    async def _pause(self) -> None:
        await asyncio.sleep(POLL)
        self._events += self._station.events()
        if self._child is not None and self._child.exit_code is not None:
            raise LinkError(f"darko-sitl ended with exit code {self._child.exit_code}")
        for kind, what in ((VehicleRestarted, "restarted"), (VehicleLost, "was lost")):
            if any(isinstance(event, kind) for event in self._events):
                raise FlightError(f"the vehicle {what}: last item reached {self._last_reached()}")

    def _last_reached(self) -> str:
        return str(self.summary.reached[-1]) if self.summary.reached else "none"

    def _last_words(self) -> str:
        lines = [line.text for line in self._snapshot.messages if line.severity <= mavlink.MAV_SEVERITY_WARNING]
        return lines[-1] if lines else "no reason given"


def _say(text: str) -> None:
    print(text, file=sys.stderr)


def _tell_fault(station: Station) -> None:
    """Say, after all, that the log is not whole."""
    if station.recording_fault:
        _say(station.recording_fault)


def _place(item: MissionItem, s: Snapshot) -> Vector | None:
    """Where an item is, NED in the vehicle's local frame [m]; None where it names no place."""
    if item.command not in {mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_LOITER_TIME} or s.home is None:
        return None
    if not is_global_frame(item.frame):
        return from_local_e4(item.x), from_local_e4(item.y), item.z
    absolute = item.frame in {mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT}
    return s.local(Geodetic(from_e7(item.x), from_e7(item.y), item.z if absolute else s.home.alt + item.z))
