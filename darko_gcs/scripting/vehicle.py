"""Vehicles over their link, one or all: requests that are awaited, and what they report."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from darko_gcs.errors import FlightError, LinkError
from darko_gcs.feed.links import UdpLink
from darko_gcs.scripting.link_session import (
    ANSWER_TIMEOUT,
    POLL_PERIOD,
    What,
    late_error,
    open_link,
    unknown_time,
    why_not_ready,
    words_since,
)
from darko_gcs.state.parameters import ChangeState, ParameterChange, ParameterMetadata
from darko_gcs.state.plan_difference import read_back_fault
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import counted, reason_text
from darko_gcs.state.values import FENCE, MISSION, PLAN_TITLES, PLAN_TYPES, RALLY, Items
from darko_gcs.station.fleet import Fleet
from darko_gcs.station.keyring_setup import open_keyring
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.events import (
    CommandDone,
    Event,
    FileFailed,
    FlightPlanAnswered,
    MissionCleared,
    MissionDownloaded,
    MissionFailed,
    MissionUploaded,
    ParameterFailed,
    ParameterReceived,
    ParametersComplete,
)
from protocol.frames import Geodetic
from protocol.names import FAILURE_TYPES, FAILURE_UNITS, Mode
from protocol.plans import MissionItem, Plan, load, save
from protocol.plans.fence_rally import fence_items, rally_items, with_fence, with_rally
from protocol.tools.option_values import GROUND_SYSTEM, STATION_PORT
from protocol.wire.message import Source


def whole_plan(s: Snapshot, parts: Mapping[int, Items], home: Geodetic | None) -> Plan:
    """The plan of a vehicle's parts.

    Args:
        s: What is known of it.
        parts: Its items, by MAV_MISSION_TYPE.
        home: Where it is, if that is known.

    Raises:
        FlightError: Its fence or rally points cannot be part of a plan.
    """
    keys = {"firmwareType": s.identity.autopilot, "vehicleType": s.identity.kind}
    plan = Plan(items=parts[MISSION], planned_home=home, mission_keys=keys)
    try:
        return with_rally(with_fence(plan, parts.get(FENCE, ())), parts.get(RALLY, ()))
    except LocalProtocolError as error:
        raise FlightError(f"download: the vehicle's fence or rally points make no plan: {error}") from error


def save_downloaded(plan: Plan, path: Path) -> list[str]:
    """Write a plan; gives what is not in the file, in words: a file of waypoints has no fence and no rally points.

    Raises:
        FileError: It cannot be written.
    """
    left_out = []
    if path.suffix in {".waypoints", ".txt"}:
        parts = ((len(fence_items(plan)), "fence item"), (len(rally_items(plan)), "rally point"))
        left_out = [f"{counted(count, what)}, which only a .plan holds" for count, what in parts if count]
        empty = Plan()
        plan = replace(plan, geo_fence=empty.geo_fence, rally_points=empty.rally_points)
    if plan.planned_home is None:
        left_out.append("home, which the vehicle has not told: QGroundControl does not load a .plan without it")
    save(plan, path)
    return left_out


Expected = TypeVar("Expected", bound=Event)
WORDS_TIME = 1.0  # the vehicle's text about a refusal follows its answer [s]
REPEAT_TIME = 10.0  # in which it may not say the same again [s]
IN_FLIGHT_RATE = 10.0  # of reports [Hz]
HOME_TIMEOUT = 5.0  # for home to be told [s]
METADATA_TIMEOUT = 5.0  # for the description of the parameters [s]


@asynccontextmanager
async def connect(
    host: str = "127.0.0.1",
    port: int = STATION_PORT,
    *,
    vehicle: int | None = None,
    signing_key: str | None = None,
    timeout: float = 30.0,
    station: int = GROUND_SYSTEM,
) -> AsyncIterator[Vehicle]:
    """A vehicle that is heard on a UDP port; the port is released at the end.

    Args:
        host: Local address to listen on, or an address to connect to: ``udpout:HOST:PORT``, ``tcp:HOST:PORT`` or
            ``serial:DEVICE:BAUD``.
        port: Local UDP port; 0: any.
        vehicle: Its system id; None: the first that is heard.
        signing_key: 64 hexadecimal digits, or a file with them.
        timeout: For the vehicle to be heard and to have told where home is [s].
        station: System id of this ground station: each one of a vehicle needs its own.

    Raises:
        LinkError: The port is taken, nothing answers, or no vehicle is heard in time.
    """
    ours = Station(keyring=open_keyring(signing_key), vehicle=vehicle, system=station)
    async with open_link(ours, host, port) as link:
        found = Vehicle(link)
        await found.wait_until(
            lambda s: s.identity.source is not None and s.link.boot is not None, timeout, unknown_time
        )
        yield found


class Vehicle:
    """A vehicle; made by :func:`connect`. One request at a time: they wait for each other.

    Args:
        link: How it is reached.
        station: Its own, if the link's is another vehicle's.
        watch: Sees the events while something is waited for; an error that it raises ends the request.
    """

    def __init__(
        self, link: UdpLink, station: Station | None = None, watch: Callable[[Sequence[Event]], None] | None = None
    ) -> None:
        self._link, self._station, self._watch = link, station or link.station, watch
        self._events: list[Event] = []
        self._types: dict[str, int] = {}
        self._busy = asyncio.Lock()
        self._asked_at = 0.0  # when the last request began [s]
        self._waits_for: What = "the vehicle"

    # What it reports

    @property
    def now(self) -> Snapshot:
        """Everything that is known of it at this moment: NED and metres, angles in radians, SI units."""
        return self._station.snapshot

    @property
    def source(self) -> Source:
        """Its system and component id."""
        source = self.now.identity.source
        return source if source is not None else (0, 0)

    async def reports(self, rate: float = IN_FLIGHT_RATE) -> AsyncIterator[Snapshot]:
        """Yield the present snapshot again and again, at a rate [Hz]."""
        while True:
            yield self.now
            await asyncio.sleep(1.0 / rate)

    @property
    def waits_for(self) -> str:
        """Condition that the request under way waits for, and the part of it that is missing."""
        return self._waits_for if isinstance(self._waits_for, str) else self._waits_for(self.now)

    async def wait_until(
        self, holds: Callable[[Snapshot], bool], timeout: float = 120.0, what: What = "the condition"
    ) -> Snapshot:
        """Wait until something holds of the vehicle; gives the snapshot of which it does.

        Args:
            holds: Whether it does.
            timeout: [s].
            what: What is waited for, in the error's words, or a function that gives them.

        Raises:
            LinkError: No vehicle was heard in this time.
            FlightError: It did not hold in this time.
        """
        deadline, self._waits_for = self._link.now + timeout, what
        while not holds(self.now):
            if self._link.now > deadline:
                if self.now.identity.source is None:
                    raise LinkError(f"no vehicle heard for {timeout:g} s")
                raise self.late(f"timed out after {timeout:g} s")
            await asyncio.sleep(POLL_PERIOD)
            if self._watch is not None:
                self._take_events()
        return self.now

    def late(self, what: str) -> FlightError:
        """The error of a request that is not done in time: what it waits for, and what was seen last."""
        return late_error(what, self.waits_for, self.now)

    # Requests

    async def ready(self, timeout: float = 60.0) -> None:
        """Wait until it can be armed and home is known."""
        await self.wait_until(
            lambda s: s.status.prearm_ok is True and s.position.home is not None, timeout, why_not_ready
        )

    async def arm(self) -> None:
        """Start the motors at idle."""
        await self._command(self._station.arm, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, "arming")
        await self.wait_until(lambda s: s.status.armed is True, ANSWER_TIMEOUT, "the vehicle is armed")

    async def disarm(self, *, force: bool = False) -> None:
        """Stop the motors; with ``force`` also in flight."""
        await self._command(
            lambda now: self._station.disarm(now, force=force), mavlink.MAV_CMD_COMPONENT_ARM_DISARM, "disarming"
        )
        await self.wait_until(lambda s: s.status.armed is False, ANSWER_TIMEOUT, "the vehicle is disarmed")

    async def take_off(self, height: float) -> None:
        """Begin to climb to a height above home [m]."""
        await self._command(lambda now: self._station.take_off(height, now), mavlink.MAV_CMD_NAV_TAKEOFF, "take-off")

    async def go_to(self, north: float, east: float, height: float) -> None:
        """Begin to fly to a point, relative to home [m]."""
        await self.wait_until(lambda s: s.position.home is not None, ANSWER_TIMEOUT, "home is known")
        await self._command(
            lambda now: self._station.go_to(north, east, height, now), mavlink.MAV_CMD_DO_REPOSITION, "go-to"
        )

    async def land(self) -> None:
        """Begin to land here."""
        await self._command(self._station.land, mavlink.MAV_CMD_NAV_LAND, "landing")

    async def reboot(self) -> None:
        """Have the vehicle's autopilot start anew; only disarmed on the ground."""
        await self._command(self._station.reboot, mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, "reboot")

    async def return_home(self) -> None:
        """Begin to fly home and land."""
        await self._command(self._station.return_home, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, "return")

    async def hold(self) -> None:
        """Stop and hover."""
        await self.set_mode(Mode.HOLD)

    async def set_mode(self, mode: Mode) -> None:
        """Change the flight mode."""
        await self._command(
            lambda now: self._station.set_mode(mode, now), mavlink.MAV_CMD_DO_SET_MODE, f"mode {mode.name}"
        )

    async def start_mission(self) -> None:
        """Begin to fly the mission, from its current item."""
        await self._command(self._station.plans.start_mission, mavlink.MAV_CMD_MISSION_START, "mission start")

    async def transition(self, *, forward: bool) -> None:
        """Fly a front or a back transition, to its end."""
        await self._command(
            lambda now: self._station.transition(now, forward=forward), mavlink.MAV_CMD_DO_VTOL_TRANSITION, "transition"
        )

    async def change_speed(self, speed: float) -> None:
        """Fly forward at another airspeed [m/s]."""
        await self._command(
            lambda now: self._station.change_speed(speed, now), mavlink.MAV_CMD_DO_CHANGE_SPEED, "speed"
        )

    async def inject_failure(self, unit: str, failure: str, instance: int = 0) -> None:
        """Have something fail, which the vehicle's parameter SYS_FAILURE_EN must allow.

        Args:
            unit: One of ``FAILURE_UNITS``.
            failure: One of ``FAILURE_TYPES``; "ok" clears it.
            instance: 1 left, 2 right; 0: all.
        """
        await self._command(
            lambda now: self._station.inject_failure(now, FAILURE_UNITS[unit], FAILURE_TYPES[failure], instance),
            mavlink.MAV_CMD_INJECT_FAILURE,
            f"{unit} {failure}",
        )

    async def load_flight_plan(self, file: bytes) -> None:
        """Have it load a flight plan, packed by ``protocol.flight_plans.plan_package``.

        Raises:
            FlightError: It refuses the plan.
        """
        async with self._busy:
            self._forget()
            self._station.flight_plan.load(file, self._link.now)
            answer = await self._answer(FlightPlanAnswered, MissionFailed, "plan load")
        if answer.text:
            raise FlightError(f"the vehicle refuses the plan: {answer.text}")

    async def request(self, ask: Callable[[Station, float], int], what: str) -> None:
        """Send any command of the station and wait for its answer.

        Args:
            ask: Sends it at a time [s], and gives its MAV_CMD.
            what: In the words of a refusal.

        Raises:
            FlightError: The vehicle refused, or did not answer.
        """
        async with self._busy:
            self._forget()
            await self._accepted(ask(self._station, self._link.now), what)

    async def upload(self, plan: Path | str | Plan | Sequence[MissionItem], *, verify: bool = True) -> int:
        """Replace its mission, and by a plan with fence or rally points these too; gives how many items.

        Args:
            plan: A plan or its file, or the mission's items.
            verify: Read back what the vehicle holds then, and compare it.

        Raises:
            FileError: The file is no plan; the message says where.
            FlightError: The vehicle refused, or holds something else then; the message names item and field.
        """
        if isinstance(plan, Path | str):
            plan = load(Path(plan))
        if isinstance(plan, Plan):
            items, fence, rally = tuple(plan.items), fence_items(plan), rally_items(plan)
        else:
            items, fence, rally = tuple(plan), (), ()
        sent = {MISSION: items} | {kind: part for kind, part in ((FENCE, fence), (RALLY, rally)) if part}
        async with self._busy:
            self._forget()
            self._station.plans.upload(items, self._link.now, fence=fence, rally=rally, verify=verify)
            for _ in sent:
                await self._answer(MissionUploaded, MissionFailed, "upload")
            held = [await self._answer(MissionDownloaded, MissionFailed, "reading back") for _ in sent if verify]
        faults = [read_back_fault(part.kind, sent[part.kind], part.items) for part in held]
        if any(faults):
            raise FlightError("; ".join(filter(None, faults)))
        return len(items)

    async def download(self) -> tuple[MissionItem, ...]:
        """Its mission."""
        async with self._busy:
            self._forget()
            self._station.plans.download(self._link.now)
            await self._answer(MissionDownloaded, MissionFailed, "download")
        return self.now.plans.mission

    async def download_plan(self) -> Plan:
        """All that it flies by: mission, fence, rally points and home; without what it has or tells none of."""
        parts: dict[int, Items] = {}
        async with self._busy:
            self._forget()
            self._station.plans.download(self._link.now)
            for kind in PLAN_TYPES:
                try:
                    part = await self._answer(
                        MissionDownloaded, MissionFailed, f"download of the {PLAN_TITLES[kind].lower()}"
                    )
                except FlightError as error:
                    if kind == MISSION or error.details.get("result") != mavlink.MAV_MISSION_UNSUPPORTED:
                        raise
                else:
                    parts[part.kind] = part.items
        return whole_plan(self.now, parts, await self._home())

    async def _home(self) -> Geodetic | None:
        """Home, which is asked for if it is not known; None if the vehicle does not tell it."""
        if self.now.position.home is None:
            message = float(mavlink.MAVLINK_MSG_ID_HOME_POSITION)
            self._station.endpoint.command(mavlink.MAV_CMD_REQUEST_MESSAGE, message, now=self._link.now)
            with suppress(FlightError):
                await self.wait_until(lambda s: s.position.home is not None, HOME_TIMEOUT, "home")
        return self.now.position.home

    async def clear_mission(self) -> None:
        """Delete its mission."""
        async with self._busy:
            self._forget()
            self._station.plans.clear(mavlink.MAV_MISSION_TYPE_MISSION, self._link.now)
            await self._answer(MissionCleared, MissionFailed, "clearing")

    async def parameters(self) -> dict[str, float]:
        """All its parameters."""
        async with self._busy:
            self._forget()
            self._types.clear()
            self._station.fetch_parameters(self._link.now)
            await self._answer(ParametersComplete, ParameterFailed, "parameters")
        return dict(self.now.parameters.values)

    def parameter_types(self) -> dict[str, int]:
        """MAV_PARAM_TYPE of the parameters that ``parameters`` fetched last."""
        return dict(self._types)

    async def parameter_metadata(self) -> Mapping[str, ParameterMetadata]:
        """Fetch the vehicle's descriptions of its parameters; empty if it has none."""
        async with self._busy:
            self._forget()
            self._station.fetch_parameter_metadata(self._link.now)
            deadline = self._link.now + METADATA_TIMEOUT
            while not self.now.parameters.metadata and self._link.now < deadline:
                self._take_events()
                if any(isinstance(event, FileFailed) or _is_refusal(event) for event in self._events):
                    break
                await asyncio.sleep(POLL_PERIOD)
        return self.now.parameters.metadata

    async def set_parameter(self, name: str, value: float) -> float:
        """Change a parameter; gives its value as the vehicle has it then.

        Raises:
            FlightError: The vehicle refused the value, also if it had echoed it first.
        """
        change = (await self.set_parameters({name: value}))[name]
        if change.state is ChangeState.REFUSED:
            raise FlightError(f"parameter {name} stays as it was: {change.reason}")
        return self.now.parameters.values.get(name, value)

    async def set_parameters(self, wanted: Mapping[str, float]) -> dict[str, ParameterChange]:
        """Change several parameters; gives what became of each, set or refused, by name."""
        async with self._busy:
            self._forget()
            self._waits_for = f"the vehicle's answer about {', '.join(list(wanted)[:5])}"
            self._station.set_parameters(wanted, self._link.now)
            while any(self.now.parameters.changes[name].state is ChangeState.WAITING for name in wanted):
                await asyncio.sleep(POLL_PERIOD)
                if not self.now.parameters.changes.keys() >= wanted.keys():
                    raise FlightError("the vehicle restarted")
        return {name: self.now.parameters.changes[name] for name in wanted}

    async def _command(self, request: Callable[[float], None], command: int, what: str) -> None:
        async with self._busy:
            self._forget()
            request(self._link.now)
            await self._accepted(command, what)

    async def _accepted(self, command: int, what: str) -> None:
        while True:
            done = await self._answer(CommandDone, MissionFailed, what)
            if done.command == command:
                break
        if done.result != mavlink.MAV_RESULT_ACCEPTED:
            reason = reason_text(done.reason)
            said = await self._words_about(reason)
            words = said[-1] if said else reason
            raise FlightError(f"{what} refused: {words}", result=done.result, **_said(said))

    async def _answer(self, kind: type[Expected], failure: type[Event], what: str) -> Expected:
        deadline, self._waits_for = self._link.now + ANSWER_TIMEOUT, "the vehicle's answer"
        while self._link.now < deadline:
            self._take_events()
            for event in self._events:
                if isinstance(event, kind):
                    self._events.remove(event)
                    return event
                if isinstance(event, failure):
                    self._events.remove(event)
                    raise await self._failed(event, what)
            await asyncio.sleep(POLL_PERIOD)
        raise self.late(f"{what}: no answer for {ANSWER_TIMEOUT:g} s")

    async def _failed(self, event: Event, what: str) -> FlightError:
        """The error of a request that failed, with the vehicle's own words if it refused."""
        reason, result = reason_text(getattr(event, "reason", "")), getattr(event, "result", None)
        said = [] if result is None else await self._words_about(reason)
        return FlightError(": ".join((f"{what} failed", reason, *said[-1:])), result=result, **_said(said))

    def _take_events(self) -> None:
        events = self._station.events()
        if self._watch is not None:
            self._watch(events)
        for event in events:
            if isinstance(event, ParameterReceived):
                self._types[event.name] = event.type
            else:
                self._events.append(event)

    def _forget(self) -> None:
        """Answers to earlier requests are not those to the next."""
        self._station.events()
        self._events.clear()
        self._asked_at = self._link.now

    async def _words_about(self, reason: str) -> list[str]:
        """Wait for the vehicle's texts about a failure, which say more than its bare answer; the last is the newest."""
        deadline = self._link.now + WORDS_TIME
        while True:
            if words := words_since(self.now, self._asked_at, reason):
                return words
            if self._link.now > deadline:  # what it has said a moment ago, it does not say again
                return words_since(self.now, self._asked_at - REPEAT_TIME, reason)
            await asyncio.sleep(POLL_PERIOD)


def _said(words: list[str]) -> dict[str, object]:
    """The vehicle's words, for a program."""
    return {"said": words} if words else {}


def _is_refusal(event: Event) -> bool:
    """True if the vehicle does not send a message that was asked for."""
    if not isinstance(event, CommandDone) or event.command != mavlink.MAV_CMD_REQUEST_MESSAGE:
        return False
    return bool(event.result != mavlink.MAV_RESULT_ACCEPTED)


LISTENING_TIME = 2.5  # after the first vehicle: each sends a HEARTBEAT a second [s]


@asynccontextmanager
async def connect_all(
    host: str = "127.0.0.1",
    port: int = STATION_PORT,
    *,
    signing_key: str | None = None,
    timeout: float = 30.0,
    station: int = GROUND_SYSTEM,
) -> AsyncIterator[dict[int, Vehicle]]:
    """The vehicles that are heard on a UDP port within 2.5 s of the first, by ascending system id.

    Args:
        host: Local address to listen on, or an address to connect to (as of ``connect``).
        port: Local UDP port; 0: any.
        signing_key: 64 hexadecimal digits, or a file with them.
        timeout: For the first vehicle to be heard [s].
        station: System id of this ground station (as of ``connect``).

    Raises:
        LinkError: The port is taken, nothing answers, or no vehicle is heard in time.
    """
    lead = Station(keyring=open_keyring(signing_key), system=station)
    fleet = Fleet(lead)
    async with open_link(lead, host, port) as link:
        await Vehicle(link).wait_until(lambda s: s.identity.source is not None, timeout, "a vehicle")
        await asyncio.sleep(LISTENING_TIME)
        vehicles = {system: Vehicle(link, other) for system, other in fleet.stations.items()}
        for vehicle in vehicles.values():
            await vehicle.wait_until(lambda s: s.link.boot is not None, timeout, "a message with the vehicle's time")
        yield vehicles
