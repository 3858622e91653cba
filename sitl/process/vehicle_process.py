"""The vehicle process: node, pacer and transport in one loop."""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple, Protocol

from platformdirs import user_data_path

from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from protocol.names import Mode
from protocol.tools.option_values import open_port_warning
from protocol.wire.signing import Keyring, timestamp_at
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import World
from sitl.day import DayAircraft, load_day
from sitl.defaults import AIRFRAME, EXPORTED, HOME, MAX_ORIGIN_ALTITUDE, MAX_ORIGIN_LATITUDE
from sitl.enclosure.arena_files import Arena, load_arena
from sitl.errors import SitlError
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.node import Node
from sitl.mavlink.services.command_service import ExitRequest
from sitl.mavlink.signing_keys import LOOPBACK, KeyFile, open_keyring, read_key_option
from sitl.mavlink.transport import Address, UdpTransport
from sitl.model.airframe_files import load
from sitl.process.warm_up import first_start, make_ready
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import SensorSet
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation
from sitl.simulation.dispatch import REGISTER, Register
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import CONTROLLERS
from sitl.tools.folder_lock import FolderLock, lock_free_folder
from sitl.tools.persistence import CheckedPlan, StateFolder, load_checked_plan
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

# Paces simulated time by the clock. The vehicle sleeps nowhere else.


MAX_LATENESS = 0.5  # a longer pause (a suspended laptop) is forgotten, not caught up with [s]


class Pacer:
    """Paces simulated time at ``speed`` times real time; 0 means as fast as possible.

    ``longest_delay`` is the longest time by which a step ended late [s].

    Args:
        speed: Multiple of real time.
        tick: Simulated time between ticks of the autopilot, for ``missed`` [s].
    """

    def __init__(self, speed: float, tick: float = math.inf) -> None:
        self._speed = speed
        self._due = time.monotonic()
        self._tick = math.inf if speed == 0.0 else tick / speed
        self._flown_late, self.longest_delay = 0.0, 0.0

    @property
    def missed(self) -> int:
        """Autopilot ticks that were flown more than a tick late, or for which a longer pause left no time."""
        return round(self._flown_late / self._tick + 0.49)  # a begun one counts; rounding errors of the sum do not

    def wait_time(self, simulated: float) -> float:
        """Time to wait after flying for ``simulated`` seconds [s], never negative."""
        if self._speed == 0.0:
            return 0.0
        now = time.monotonic()
        step = simulated / self._speed
        self._due += step
        delay = now - self._due
        self._flown_late += step if delay > self._tick else 0.0
        self.longest_delay = max(delay, self.longest_delay)
        if delay > MAX_LATENESS:
            self._flown_late += delay
            self._due = now
        return max(0.0, -delay)


MAX_LISTENING = 0.002  # to peers, before the vehicle flies on: a flood must not stop it [s]
AUTOPILOT_TYPES = {"px4": mavlink.MAV_AUTOPILOT_PX4, "generic": mavlink.MAV_AUTOPILOT_GENERIC}
SCENARIO_EXIT_REFUSAL = "Start and stop a scenario from its terminal"


FIRST_SYSTEM = 1  # whose folder is the one that has the others'


class LiveExperiment(NamedTuple):
    """An aircraft that flies by itself to an end, such as one in a scenario; peers cannot shut it down."""

    build: Callable[[World, Mapping[str, float]], Aircraft]  # from the world and the parameters of this run
    is_over: Callable[[], bool]
    finish: Callable[[], int]  # to be called then; gives the exit code


def fly(args: argparse.Namespace, experiment: LiveExperiment | None = None) -> int:
    """Build the vehicle that the arguments describe and fly it until it is interrupted or its experiment has ended.

    A peer may shut it down or reboot it. A reboot builds it anew from the same arguments and its state folder: same
    port, same peers, boot time 0.

    Args:
        args: Of ``darko-sitl run``.
        experiment: Flown instead of a vehicle that waits for requests.

    Returns:
        The exit code.

    Raises:
        SitlError: If an argument, a file or the port is not usable.
    """
    say = Narrator(quiet=args.quiet)
    transport = UdpTransport((args.bind, args.port))
    signal.signal(signal.SIGTERM, interrupt)
    lock = None
    try:
        args, lock = with_locked_folder(args)
        code, node = _run(args, experiment, transport, say)
        while node.exit_request is ExitRequest.REBOOT:
            say("rebooting")
            known, plan_was_sent = node.peers, node.flight_plan_was_sent
            code, node = _run(args, experiment, transport, say, known, plan_was_sent=plan_was_sent)
        return code
    finally:
        transport.close()
        if lock is not None:
            lock.close()


def _run(
    args: argparse.Namespace,
    experiment: LiveExperiment | None,
    transport: UdpTransport,
    say: Narrator,
    known: Iterable[Hashable] = (),
    *,
    plan_was_sent: bool = False,
) -> tuple[int, Node]:
    """One run from boot to its end; gives the exit code and the node, which knows whether it is to be rebooted."""
    keyring, recorder = open_keys(args), open_recorder(args)
    warn_of_open_port(args, signed=keyring.is_on)
    try:
        began = time.monotonic()
        with first_start() as helper:
            node = build_node(args, keyring, recorder, experiment, stored_plan_first=plan_was_sent)
            node.know(known)
            make_ready(node.aircraft, say, helper)
        took = time.monotonic() - began
        if keyring.is_on:
            say("signing is on: unsigned commands are refused")
        say(f"ready after {took:.1f} s: {link_text(args, transport.port)}")
        pacer = Pacer(args.speed)
        if experiment is None:
            serve(node, transport, pacer, until=lambda: node.exit_request is not None)
            return 0, node
        serve(node, transport, pacer, until=experiment.is_over)
        code = experiment.finish()
        if args.stay:
            serve(node, transport, pacer)
        return code, node
    finally:
        recorder.close()


def build_node(
    args: argparse.Namespace,
    keyring: Keyring,
    recorder: FlightRecorder,
    experiment: LiveExperiment | None = None,
    *,
    forwards: bool = True,
    stored_plan_first: bool = False,
) -> Node:
    """The vehicle that the arguments describe, on the link; see ``Node``."""
    return Node(
        build_aircraft(args, experiment),
        StateFolder(state_folder(args)),
        peers=_peers(args),
        keyring=keyring,
        recorder=recorder,
        autopilot_type=AUTOPILOT_TYPES[args.autopilot],
        stored_plan_first=stored_plan_first,
        exit_refusal=SCENARIO_EXIT_REFUSAL if experiment is not None else "",
        system=args.sysid,
        forwards=forwards,
        tell=lambda line: complain(args, line),
    )


def complain(args: argparse.Namespace, line: str) -> None:
    """Tell a person, quiet or not, what went wrong with the vehicle."""
    who = f"vehicle {args.sysid}: " if args.vehicles > 1 else ""
    print(f"darko-sitl: {who}{line}", file=sys.stderr, flush=True)


def open_recorder(args: argparse.Namespace) -> FlightRecorder:
    """The recorder of the vehicle's flights."""
    return FlightRecorder(state_folder(args) / "logs", time.time, system=args.sysid)


def warn_of_open_port(args: argparse.Namespace, *, signed: bool) -> None:
    """Say, quiet or not, that anybody may command the vehicle if that is so."""
    if warning := open_port_warning(args.bind, signed=signed):
        print(f"darko-sitl: {warning}", file=sys.stderr, flush=True)


def build_aircraft(args: argparse.Namespace, experiment: LiveExperiment | None = None) -> Aircraft:
    """The vehicle that the arguments describe: at the start of an experiment, on the ground, or hovering."""
    if args.day is not None:
        return _day_aircraft(args)
    planned, arena = _planned(args), load_arena(args.arena)
    origin = args.home or (_home_of(arena) if planned is None else planned.origin)
    world = World(LocalFrame(origin), arena)
    if experiment is not None:
        return experiment.build(world, _overrides(args))
    north, east, up, yaw = args.start or (0.0, 0.0, 0.0, 0.0)
    if outside := world.arena.refuse((north, -east, up)):
        raise SitlError(f"--start: {outside}")
    start = Start(north, -east, up, -math.radians(yaw), airborne=up > 0.0)
    airframe = load(args.airframe or AIRFRAME)
    for text in airframe.warnings if args.airframe else ():  # of the default its page tells
        print(f"darko-sitl: warning: {text}", file=sys.stderr, flush=True)
    vehicle = Simulation(
        airframe.parameters,
        seed=args.seed,
        start=start,
        register=_register(args),
        navigation=_navigation(args),
        sensors=_sensors(args),
        aligned=start.airborne,
    )
    stored = StateFolder(state_folder(args)).parameters()
    configuration = Configuration(Settings(), vehicle.tuning, WorldSettings()).replaced(stored | _overrides(args))
    aircraft = Aircraft(vehicle, world, configuration, airborne=start.airborne)
    if args.vehicles > 1:  # each returns to its own place
        aircraft.autopilot.relocate(world.frame, (north, -east, 0.0))
    if planned is not None:
        aircraft.autopilot.flight_plan.load(planned.check, planned.mapping)
        aircraft.autopilot.set_mode(Mode.FLIGHT_PLAN)
    return aircraft


def _register(args: argparse.Namespace) -> Register:
    """The vehicle's laws, or the same as they were exported to a folder."""
    if args.controller is None or not args.controller.startswith(EXPORTED):
        return REGISTER
    from sitl.export.in_the_loop import ExportedRegister  # noqa: PLC0415 - compiles, and few need it

    return ExportedRegister(Path(args.controller.removeprefix(EXPORTED)))


def _planned(args: argparse.Namespace) -> CheckedPlan | None:
    """The flight plan to fly, which can be; blocks of it may be locked."""
    if args.flight_plan is None:
        return None
    if args.scenario is not None:
        raise SitlError(f"--flight-plan: scenario {args.scenario} flies by itself")
    planned = load_checked_plan(args.flight_plan, args.flight_plan_names, args.flight_plan_procedures)
    planned.require_flown()
    here = planned.origin
    if args.home is None and (abs(here.lat_deg) > MAX_ORIGIN_LATITUDE or abs(here.alt) > MAX_ORIGIN_ALTITUDE):
        raise SitlError(f"{args.flight_plan}: no flight at lat0 {here.lat_deg:g}, ground_alt {here.alt:g}: give --home")
    for name, finding in planned.check.locked_blocks.items():
        print(f"darko-sitl: block {name} is locked: {finding}", file=sys.stderr, flush=True)
    if left_out := len(planned.check.left_out):
        words = f"{left_out} calls, values or exceptions of a build are left out: 'darko-sitl plan' lists them"
        print(f"darko-sitl: {words}", file=sys.stderr, flush=True)
    return planned


def _home_of(arena: Arena) -> Geodetic:
    return HOME if arena.origin is None else Geodetic(*arena.origin)


def _navigation(args: argparse.Namespace) -> Navigation:
    """Source of navigation: satellites, or under a net motion capture, unless the arguments say otherwise."""
    usual = Navigation.MOCAP if load_arena(args.arena).has_net else Navigation.SENSORS
    navigation = usual if args.nav is None else Navigation(args.nav)
    if args.mocap is not None and navigation is not Navigation.MOCAP:
        raise SitlError(f"--mocap {args.mocap}: only with --nav mocap, or in the voliere, is motion capture used")
    return navigation


def _sensors(args: argparse.Namespace) -> SensorSet:
    if args.sensors is not None and _navigation(args) is Navigation.TRUTH:
        raise SitlError("--sensors: with --nav truth no sensor is read")
    return load_sensors(args.sensors)


def _day_aircraft(args: argparse.Namespace) -> DayAircraft:
    """A day states everything itself, so that it is the same day fast and live."""
    given = {
        "--scenario": args.scenario, "--flight-plan": args.flight_plan, "--start": args.start, "--nav": args.nav,
        "--sensors": args.sensors, "--airframe": args.airframe, "--home": args.home, "--wind": args.wind,
        "--gusts": args.gusts, "--param": args.param or None,
    }  # fmt: skip
    for option, value in given.items():
        if value is not None:
            raise SitlError(f"{option}: a day states that itself, in its file")
    day = load_day(args.day)
    return DayAircraft(day._replace(parameters=day.parameters | _overrides(args)))


def state_folder(args: argparse.Namespace) -> Path:
    """Folder in which the vehicle keeps parameters, plans, home and logs; of a fleet the one that has its folders."""
    if args.state_dir is not None:
        return Path(args.state_dir)
    folder = Path(user_data_path("darko") / "sitl")
    return folder if args.sysid == FIRST_SYSTEM or args.vehicles > 1 else member_folder(folder, args.sysid)


def member_folder(folder: Path, system: int) -> Path:
    """Folder of the vehicle with a system id, beside others."""
    return folder / f"vehicle-{system}"


def with_locked_folder(args: argparse.Namespace) -> tuple[argparse.Namespace, FolderLock]:
    """The arguments with a state folder that no other process has, and its lock.

    Raises:
        StateFolderError: The folder that was asked for is another process's, or cannot be written.
    """
    if args.state_dir is not None:
        return args, FolderLock(state_folder(args))
    lock, words = lock_free_folder(state_folder(args))
    if words:
        complain(args, words)
    return argparse.Namespace(**vars(args) | {"state_dir": lock.folder}), lock


def _peers(args: argparse.Namespace) -> list[tuple[str, int]]:
    return [(LOOPBACK, port) for port in dict.fromkeys((args.gcs_port, args.api_port)) if port]


def link_text(args: argparse.Namespace, port: int) -> str:
    """Text of the port at which the vehicle listens, and of those it sends to before anyone has spoken to it."""
    ports = " and ".join(str(port) for _, port in _peers(args))
    return f"on {args.bind}:{port}, sends to {ports or 'those who speak to it'}"


def open_keys(args: argparse.Namespace) -> Keyring:
    """The keys of the command line, or those stored."""
    given = dict(read_key_option(text) for text in args.signing_key)
    file = KeyFile(StateFolder(state_folder(args)).folder)
    return open_keyring(file, given, timestamp=timestamp_at(time.time()), now=time.monotonic())


def _overrides(args: argparse.Namespace) -> dict[str, float]:
    """Parameters that the command line sets for this run only."""
    overrides: dict[str, float] = dict(args.param)
    if args.controller is not None and not args.controller.startswith(EXPORTED):
        overrides["DRK_CONTROLLER"] = CONTROLLERS[args.controller]
    if args.wind is not None:
        overrides["SIM_WIND_SPD"], overrides["SIM_WIND_DIR"] = args.wind
    if args.gusts is not None:
        overrides["SIM_GUST_RMS"] = args.gusts
    if args.mocap is not None:
        overrides["SIM_MOCAP"] = float(args.mocap == "internal")
    return overrides


def serve(node: Served, transport: Transport, pacer: Pacer, *, until: Callable[[], bool] = lambda: False) -> None:
    """Fly and exchange messages, for ever or until a condition holds."""
    while not until():
        _receive(node, transport)
        periods = node.periods_to_fly()
        node.advance(periods)
        _send(node, transport, time.monotonic())
        _wait(node, transport, pacer.wait_time(periods * PERIOD))


def _receive(node: Served, transport: Transport) -> None:
    now, has_heard = time.monotonic(), False
    for data, peer in transport.receive():
        node.receive(data, peer, now)
        has_heard = True
        if time.monotonic() - now > MAX_LISTENING:
            break  # the rest waits in the socket, or is lost
    if has_heard:  # else timers wait until the vehicle has flown
        _send(node, transport, now)


def _send(node: Served, transport: Transport, now: float) -> None:
    for destination, data in node.datagrams(now):
        transport.send(data, destination)


def _wait(node: Served, transport: Transport, remaining: float) -> None:
    """Wait for simulated time [s], and answer peers meanwhile; a vehicle that is late does not wait."""
    end = time.monotonic() + remaining
    while remaining > 0.0:
        transport.wait(remaining)
        remaining = end - time.monotonic()
        if remaining > 0.0:
            _receive(node, transport)


def interrupt(number: int, frame: object) -> None:  # noqa: ARG001 - the signature of a signal handler
    """End the process as Ctrl-C does.

    Raises:
        KeyboardInterrupt: Always.
    """
    raise KeyboardInterrupt


class Served(Protocol):
    """The vehicle process: one vehicle, or several as one."""

    def receive(self, data: bytes, peer: Hashable, now: float) -> None:
        """Take one datagram."""

    def periods_to_fly(self) -> int:
        """Control periods until the link is looked at again."""

    def advance(self, periods: int) -> None:
        """Fly."""

    def datagrams(self, now: float) -> list[tuple[Hashable | None, bytes]]:
        """Datagrams to be sent, each with its peer."""


class Transport(Protocol):
    """Transport of datagrams; see ``UdpTransport``."""

    def wait(self, timeout: float) -> None:
        """Sleep until a datagram arrives or ``timeout`` seconds have passed."""

    def receive(self) -> Iterator[tuple[bytes, Address]]:
        """The datagrams that have arrived."""

    def send(self, data: bytes, to: Hashable) -> None:
        """Send to one peer."""


class Narrator:
    """Tells a person on stderr what the process does."""

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet

    def __call__(self, text: str) -> None:
        """Tell a line."""
        if not self._quiet:
            print(f"darko-sitl: {text}", file=sys.stderr, flush=True)
