"""A whole flight without a screen: connect, upload, arm, fly, land."""

from __future__ import annotations

import argparse
import asyncio
import math
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from typing import TypeVar

from darko_gcs.errors import FlightError, GroundError, LinkError
from darko_gcs.feed.outward_link import outward_address
from darko_gcs.feed.sitl_process import SitlProcess
from darko_gcs.feed.udp_link import UdpLink
from darko_gcs.state.missions.mission_frames import place_of
from darko_gcs.state.missions.plan_difference import read_back_fault
from darko_gcs.state.missions.plan_parts import FENCE, MISSION, RALLY, Items
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import reason_text
from darko_gcs.state.values import LogLine
from darko_gcs.station.keyring_setup import open_keyring
from darko_gcs.station.recording import default_folder, start_recording
from darko_gcs.station.station import Station
from darko_gcs.tasks.link_session import ANSWER_TIMEOUT, POLL_PERIOD, open_link
from darko_gcs.tasks.progress import last_seen, report
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.events import (
    CommandDone,
    Event,
    MissionDownloaded,
    MissionFailed,
    MissionUploaded,
    VehicleLost,
    VehicleRestarted,
)
from protocol.frames import Vector
from protocol.names import law_label
from protocol.plans import MissionItem, load
from protocol.plans.fence_rally import fence_items, rally_items
from protocol.tools.option_values import open_port_warning

Expected = TypeVar("Expected", bound=Event)
READY_TIMEOUT = 1800.0  # for our own vehicle process to compile, also on a busy machine, while it runs [s]
HEARD_TIMEOUT = 120.0  # for the first telemetry [s]
PAUSED_TEXT = "Mission paused"  # begins what a vehicle says after an item whose autocontinue is off
MAX_SAID = 5  # of the last texts, in the JSON of a failure
HOVER_TIME_BEFORE_LANDING = 3.0  # after a mission that ends in the air [s]


@dataclass(kw_only=True)
class FlightResult:
    """Result of a flight."""

    mission: str
    log: str | None  # None: not recorded
    items: int
    verified: bool = False  # what the vehicle held was read back, and was what was sent
    reached: list[int] = field(default_factory=list)
    miss: dict[int, float] = field(default_factory=dict)  # distance to each waypoint when it was reached [m]
    duration: float = 0.0  # vehicle's time from arming to disarming [s]
    distance: float = 0.0  # flown [m]
    height: float = 0.0  # maximum above home [m]
    energy: float = math.nan  # [J]
    energy_by_law: dict[str, float] = field(default_factory=dict)  # [J]
    jumps: int = 0

    def as_text(self) -> str:
        """For a person."""
        worst = max(self.miss.values(), default=math.nan)
        by_law = ", ".join(f"{law} {joules:.0f} J" for law, joules in self.energy_by_law.items())
        return "\n".join(
            (
                f"{self.mission}: flown and landed, {len(self.reached)} of {self.items} items reached",
                f"  time {self.duration:.1f} s, distance {self.distance:.1f} m, maximum height {self.height:.1f} m",
                f"  energy {self.energy:.0f} J, {self.jumps} jumps between laws",
                *([f"    {by_law}"] if by_law else []),
                f"  waypoints reached within {worst:.2f} m",
                f"  log {self.log or 'not recorded'}",
            )
        )


async def fly_headless(args: argparse.Namespace, sitl: Sequence[str]) -> FlightResult:
    """Fly a mission file from arming to disarming.

    Args:
        args: Options of ``darko-gcs fly``.
        sitl: Arguments of the vehicle process that ``--sitl`` starts.

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
    keyring = open_keyring(args.signing_key, give_key=args.give_key)
    recorder, path = None, None
    try:
        recorder, path = start_recording(args.record or default_folder())
    except GroundError as error:  # the flight matters more than its log
        _print(f"NOT RECORDING: {error}")
    station = Station(recorder, keyring, give_key=args.give_key, vehicle=args.vehicle)
    async with AsyncExitStack() as stack:
        stack.callback(_print_recording_fault, station)
        link = await stack.enter_async_context(open_link(station, args.host, args.port))
        if outward_address(args.host) is None and (warning := open_port_warning(args.host, signed=keyring.is_on)):
            _print(warning)
        process = None
        if args.sitl:
            if args.state_dir is None:  # a scripted flight starts with a vehicle in its factory state
                sitl = [*sitl, "--state-dir", stack.enter_context(tempfile.TemporaryDirectory())]
            process = await SitlProcess.start(link.port, sitl, _print, args.api_port)
            stack.push_async_callback(process.stop)
        result = FlightResult(mission=str(args.mission), log=None if path is None else str(path), items=len(plan.items))
        await Pilot(link, process, result, args.timeout).fly(plan.items, fence, rally, verify=args.verify)
        return result


class Pilot:
    """Flies one mission, from its upload to the disarming.

    Args:
        link: To the vehicle.
        process: The vehicle's own, if it is ours.
        result: Filled on the way.
        timeout: Longest flight, on the vehicle's clock [s].
    """

    def __init__(self, link: UdpLink, process: SitlProcess | None, result: FlightResult, timeout: float) -> None:
        self._link, self._station, self._process = link, link.station, process
        self._result = result
        self._timeout = timeout
        self._last_position: Vector | None = None
        self._last_pause: LogLine | None = None
        self._events: list[Event] = []

    async def fly(self, items: Items, fence: Items, rally: Items, *, verify: bool) -> None:
        """Upload the plans, fly the mission and land.

        Raises:
            GroundError: The link, the vehicle or the flight fails; the message says where.
        """
        await self._wait_until(lambda s: s.source is not None or self._is_process_ready(), READY_TIMEOUT)
        await self._wait_until(
            lambda s: s.source is not None and s.home is not None and s.boot is not None, HEARD_TIMEOUT
        )
        _print("vehicle found")
        await self._upload(items, fence, rally, verify=verify)
        await self._wait_until(lambda s: s.prearm_ok is not False, ANSWER_TIMEOUT, "vehicle: not ready to arm")
        began = self._snapshot.boot or 0.0
        self._station.arm(self._link.now)
        await self._wait_for_answer(CommandDone, "arming")
        self._station.plans.start_mission(self._link.now)
        await self._wait_for_answer(CommandDone, "mission start")
        _print("flying")
        await self._follow_mission(items, began)
        self._result.duration = (self._snapshot.boot or 0.0) - began
        energy = self._snapshot.energy
        if energy is not None:
            self._result.energy = energy.total
            self._result.energy_by_law = {law_label(law): j for law, j in enumerate(energy.by_law) if j > 0.0}
        self._result.jumps = len(self._snapshot.jumps)

    async def _upload(self, items: Items, fence: Items, rally: Items, *, verify: bool) -> None:
        """Send the plans, and read them back."""
        self._station.plans.upload(items, self._link.now, fence=fence, rally=rally, verify=verify)
        sent = {kind: part for kind, part in ((FENCE, fence), (RALLY, rally), (MISSION, items)) if part}
        for part in sent.values():
            await self._wait_for_answer(MissionUploaded, "upload")
            _print(f"{len(part)} items uploaded")
        held = [await self._wait_for_answer(MissionDownloaded, "reading back") for _ in sent if verify]
        faults = [read_back_fault(part.kind, sent[part.kind], part.items) for part in held]
        if any(faults):
            raise FlightError("; ".join(filter(None, faults)))
        if verify:
            _print("read back: as they were sent")
        self._result.verified = verify

    @property
    def _snapshot(self) -> Snapshot:
        return self._station.snapshot

    def _is_process_ready(self) -> bool:
        return self._process is None or self._process.is_ready

    async def _follow_mission(self, items: Sequence[MissionItem], began: float) -> None:
        landing_commanded = False
        complete_since: float | None = None
        while True:
            await self._pause()
            s = self._snapshot
            self._measure(s, items)
            if s.armed is False:
                break
            self._continue_paused(s)
            boot = s.boot or 0.0
            if boot - began > self._timeout:
                raise FlightError(
                    f"not finished after {self._timeout:g} s; last item reached: {self._last_reached()}; "
                    f"last seen: {last_seen(s)}",
                    waited_for="the end of the mission",
                    **self._details(),
                )
            if s.mission_state == mavlink.MISSION_STATE_COMPLETE and complete_since is None:
                complete_since = boot
            hovers = complete_since is not None and boot - complete_since > HOVER_TIME_BEFORE_LANDING
            if hovers and s.landed_state != mavlink.MAV_LANDED_STATE_ON_GROUND and not landing_commanded:
                landing_commanded = True  # the mission has no landing
                self._station.land(self._link.now)
        if self._snapshot.crashed:
            raise FlightError(f"{self._last_warning()}; last item reached: {self._last_reached()}", **self._details())
        missing = [seq for seq in range(len(items)) if seq not in self._snapshot.reached]
        if missing:
            raise FlightError(
                f"landed without reaching items {missing}: {self._last_warning()}", missing=missing, **self._details()
            )

    def _continue_paused(self, s: Snapshot) -> None:
        """Go on after an item whose autocontinue is off: there is nobody else to do it."""
        pauses = [line for line in s.messages if line.text.startswith(PAUSED_TEXT)]
        if s.mission_state == mavlink.MISSION_STATE_PAUSED and pauses and pauses[-1] != self._last_pause:
            self._last_pause = pauses[-1]
            _print(f"{pauses[-1].text.partition(':')[0].lower()}: going on")
            self._station.plans.start_mission(self._link.now)

    def _measure(self, s: Snapshot, items: Sequence[MissionItem]) -> None:
        if s.p is None:
            return
        if self._last_position is not None:
            self._result.distance += math.dist(self._last_position, s.p)
        self._last_position = s.p
        self._result.height = max(self._result.height, s.home_p[2] - s.p[2])
        for seq in sorted(s.reached - set(self._result.reached)):
            self._result.reached.append(seq)
            place = _local_place(items[seq], s)
            if place is not None:
                self._result.miss[seq] = math.dist(place, s.p)

    async def _wait_for_answer(self, kind: type[Expected], what: str) -> Expected:
        def has_answer(_: Snapshot) -> bool:
            return any(isinstance(event, kind | MissionFailed) for event in self._events)

        await self._wait_until(has_answer, ANSWER_TIMEOUT, f"{what}: no answer")
        event = next(e for e in self._events if isinstance(e, kind | MissionFailed))
        self._events.remove(event)
        refused = isinstance(event, CommandDone) and event.result != mavlink.MAV_RESULT_ACCEPTED
        if refused or not isinstance(event, kind):
            await asyncio.sleep(0.2)  # the vehicle's STATUSTEXT follows its answer
            reason = reason_text(getattr(event, "reason", ""))
            raise FlightError(f"{what}: {reason}: {self._last_warning()}", **self._details())
        return event

    async def _wait_until(
        self, condition: Callable[[Snapshot], bool], timeout: float, missing: str = "vehicle: no answer"
    ) -> None:
        deadline = self._link.now + timeout
        while not condition(self._snapshot):
            await self._pause()
            if self._link.now > deadline:
                if self._snapshot.source is None:
                    raise LinkError(f"no vehicle heard for {timeout:g} s")
                raise FlightError(
                    f"{missing} for {timeout:g} s: {self._last_warning()}; last seen: {last_seen(self._snapshot)}",
                    waited_for=missing,
                    **self._details(),
                )

    async def _pause(self) -> None:
        await asyncio.sleep(POLL_PERIOD)
        self._events += self._station.events()
        if self._process is not None and self._process.exit_code is not None:
            raise LinkError(f"darko-sitl ended with exit code {self._process.exit_code}")
        for kind, what in ((VehicleRestarted, "restarted"), (VehicleLost, "was lost")):
            if any(isinstance(event, kind) for event in self._events):
                raise FlightError(f"the vehicle {what}; last item reached: {self._last_reached()}", **self._details())

    def _last_reached(self) -> str:
        return str(self._result.reached[-1]) if self._result.reached else "none"

    def _details(self) -> dict[str, object]:
        """Details for a program of a flight that ended early."""
        return {
            "reached": self._result.reached,
            "log": self._result.log,
            "said": [line.text for line in self._snapshot.messages[-MAX_SAID:]],
            "seen": report(self._snapshot),
        }

    def _last_warning(self) -> str:
        lines = [line.text for line in self._snapshot.messages if line.severity <= mavlink.MAV_SEVERITY_WARNING]
        return lines[-1] if lines else "no reason given"


def _print(text: str) -> None:
    print(text, file=sys.stderr)


def _print_recording_fault(station: Station) -> None:
    if station.recording_fault:
        _print(station.recording_fault)


def _local_place(item: MissionItem, s: Snapshot) -> Vector | None:
    """Place of a waypoint, NED in the vehicle's local frame [m]; None for any other item, or one without a place."""
    if item.command not in {mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_LOITER_TIME} or s.home is None:
        return None
    return place_of(item, s.home, s.home_p)
