"""A whole flight without a screen: connect, upload, arm, fly, land."""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass, field

from darko_gcs.errors import FlightError, GroundError, LinkError
from darko_gcs.feed.links import UdpLink, outward_address
from darko_gcs.feed.sitl_process import SitlProcess
from darko_gcs.scripting.link_session import ANSWER_TIMEOUT, open_link, report, why_not_ready
from darko_gcs.scripting.vehicle import Vehicle
from darko_gcs.state.mission_items import place_of
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import LogLine
from darko_gcs.station.keyring_setup import open_keyring
from darko_gcs.station.recording import default_folder, start_recording
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.events import Event, MissionUploaded, VehicleLost, VehicleRestarted
from protocol.frames import Vector
from protocol.names import law_label
from protocol.plans import MissionItem, Plan, load
from protocol.tools.option_values import open_port_warning

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
    station = Station(recorder, keyring, give_key=args.give_key, vehicle=args.vehicle, system=args.id)
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
        await Pilot(link, process, result, args.timeout).fly(plan, verify=args.verify)
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
        self._vehicle = Vehicle(link, watch=self._watch)
        self._result = result
        self._timeout = timeout
        self._began = 0.0  # vehicle's time [s]
        self._complete_since: float | None = None  # vehicle's time [s]
        self._landing_commanded = False
        self._last_position: Vector | None = None
        self._last_pause: LogLine | None = None

    async def fly(self, plan: Plan, *, verify: bool) -> None:
        """Upload the plan, fly its mission and land.

        Raises:
            GroundError: The link, the vehicle or the flight fails; the message says where.
        """
        try:
            await self._prepare(plan, verify=verify)
            await self._fly_mission(plan.items)
        except FlightError as error:
            raise FlightError(str(error), **(self._details() | error.details)) from error
        s = self._vehicle.now
        self._result.duration, self._result.jumps = (s.link.boot or 0.0) - self._began, len(s.hybrid.jumps)
        if s.battery.energy is not None:
            self._result.energy = s.battery.energy.total
            self._result.energy_by_law = {law_label(law): j for law, j in enumerate(s.battery.energy.by_law) if j > 0.0}

    async def _prepare(self, plan: Plan, *, verify: bool) -> None:
        wait = self._vehicle.wait_until
        await wait(lambda s: s.identity.source is not None or self._is_process_ready(), READY_TIMEOUT, "a vehicle")
        await wait(
            lambda s: s.identity.source is not None and s.position.home is not None and s.link.boot is not None,
            HEARD_TIMEOUT,
            "home and the vehicle's time",
        )
        _print("vehicle found")
        await self._vehicle.upload(plan, verify=verify)
        if verify:
            _print("read back: as they were sent")
        self._result.verified = verify
        await wait(lambda s: s.status.prearm_ok is not False, ANSWER_TIMEOUT, why_not_ready)

    async def _fly_mission(self, items: Sequence[MissionItem]) -> None:
        self._began = self._vehicle.now.link.boot or 0.0
        steps = (self._vehicle.arm, self._vehicle.start_mission)
        for step in reversed(steps) if self._vehicle.now.is_darko else steps:  # DarkO checks it, and waits for arming
            await step()
        _print("flying")
        s = await self._vehicle.wait_until(lambda s: self._has_ended(s, items), math.inf, "the end of the mission")
        if s.hybrid.crashed:
            raise FlightError(f"{self._last_warning()}; last item reached: {self._last_reached()}")
        if missing := [seq for seq in range(len(items)) if seq not in s.mission.reached]:
            raise FlightError(f"landed without reaching items {missing}: {self._last_warning()}", missing=missing)

    def _has_ended(self, s: Snapshot, items: Sequence[MissionItem]) -> bool:
        """Measure, and do what the mission leaves to a pilot; True once the vehicle is disarmed."""
        self._measure(s, items)
        if s.status.armed is False:
            return True
        self._continue_paused(s)
        boot = s.link.boot or 0.0
        if boot - self._began > self._timeout:
            raise self._vehicle.late(
                f"not finished after {self._timeout:g} s; last item reached: {self._last_reached()}"
            )
        if s.mission.state == mavlink.MISSION_STATE_COMPLETE and self._complete_since is None:
            self._complete_since = boot
        hovers = self._complete_since is not None and boot - self._complete_since > HOVER_TIME_BEFORE_LANDING
        if hovers and s.status.landed_state != mavlink.MAV_LANDED_STATE_ON_GROUND and not self._landing_commanded:
            self._landing_commanded = True  # the mission has no landing
            self._station.land(self._link.now)
        return False

    def _is_process_ready(self) -> bool:
        return self._process is None or self._process.is_ready

    def _continue_paused(self, s: Snapshot) -> None:
        """Go on after an item whose autocontinue is off: there is nobody else to do it."""
        pauses = [line for line in s.log.lines if line.text.startswith(PAUSED_TEXT)]
        if s.mission.state == mavlink.MISSION_STATE_PAUSED and pauses and pauses[-1] != self._last_pause:
            self._last_pause = pauses[-1]
            _print(f"{pauses[-1].text.partition(':')[0].lower()}: going on")
            self._station.plans.start_mission(self._link.now)

    def _measure(self, s: Snapshot, items: Sequence[MissionItem]) -> None:
        if s.position.p is None:
            return
        if self._last_position is not None:
            self._result.distance += math.dist(self._last_position, s.position.p)
        self._last_position = s.position.p
        self._result.height = max(self._result.height, s.position.home_p[2] - s.position.p[2])
        for seq in sorted(s.mission.reached - set(self._result.reached)):
            self._result.reached.append(seq)
            place = _local_place(items[seq], s)
            if place is not None:
                self._result.miss[seq] = math.dist(place, s.position.p)

    def _watch(self, events: Sequence[Event]) -> None:
        if self._process is not None and self._process.exit_code is not None:
            raise LinkError(f"darko-sitl ended with exit code {self._process.exit_code}")
        for event in events:
            if isinstance(event, MissionUploaded):
                _print(f"{event.count} items uploaded")
            elif isinstance(event, VehicleRestarted | VehicleLost):
                what = "restarted" if isinstance(event, VehicleRestarted) else "was lost"
                raise FlightError(f"the vehicle {what}; last item reached: {self._last_reached()}")

    def _last_reached(self) -> str:
        return str(self._result.reached[-1]) if self._result.reached else "none"

    def _details(self) -> dict[str, object]:
        """Details for a program of a flight that ended early."""
        return {
            "reached": self._result.reached,
            "log": self._result.log,
            "said": [line.text for line in self._vehicle.now.log.lines[-MAX_SAID:]],
            "seen": report(self._vehicle.now),
        }

    def _last_warning(self) -> str:
        lines = [line.text for line in self._vehicle.now.log.lines if line.severity <= mavlink.MAV_SEVERITY_WARNING]
        return lines[-1] if lines else "no reason given"


def _print(text: str) -> None:
    print(text, file=sys.stderr)


def _print_recording_fault(station: Station) -> None:
    if station.recording_fault:
        _print(station.recording_fault)


def _local_place(item: MissionItem, s: Snapshot) -> Vector | None:
    """Place of a waypoint, NED in the vehicle's local frame [m]; None for any other item, or one without a place."""
    if item.command not in {mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_LOITER_TIME} or s.position.home is None:
        return None
    return place_of(item, s.position.home, s.position.home_p)
