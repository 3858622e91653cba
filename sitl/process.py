"""The vehicle process: node, pacer and transport in one loop."""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time
from collections.abc import Callable, Hashable, Iterable
from pathlib import Path

from platformdirs import user_data_path

from protocol.dialect import mavlink
from protocol.exposure import exposure
from protocol.frames import Geodetic, LocalFrame
from protocol.keyring import Keyring
from protocol.signing import timestamp_at
from sitl.airframe import load
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft
from sitl.errors import SitlError
from sitl.memory import Memory
from sitl.pacer import Pacer
from sitl.parameters import Bindings, Surroundings
from sitl.rehearsal import make_ready
from sitl.simulation.simulation import PERIOD, Simulation, Start
from sitl.studies.live import LiveScenario, ScenarioCraft, ScenarioNode, named
from sitl.wire.blackbox import Blackbox
from sitl.wire.keys import KeyFile, open_keyring, read_key_option
from sitl.wire.node import Node
from sitl.wire.transport import UdpTransport
from sitl.wire.upkeep import Leaving

LISTENING = 0.002  # [s] for what peers say between two flights: a flood must not keep the vehicle from flying
LOOPBACK = "127.0.0.1"
IDENTITIES = {"px4": mavlink.MAV_AUTOPILOT_PX4, "generic": mavlink.MAV_AUTOPILOT_GENERIC}


def fly(args: argparse.Namespace, tell: Callable[[LiveScenario], int]) -> int:
    """Build the vehicle the arguments describe and fly it until interrupted, shut down, or its scenario is over.

    A reboot builds it anew from the same arguments and what it keeps: same port, same peers, boot time 0.

    Args:
        args: Of ``darko-sitl run``.
        tell: What to do with a completed scenario; gives the exit code.

    Raises:
        SitlError: If an argument, a file or the port is not usable.
    """
    say = _Narrator(quiet=args.quiet)
    transport = UdpTransport((args.bind, args.port))
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        code, node = _run(args, tell, transport, say)
        while node.leaving is Leaving.REBOOT:
            say("rebooting")
            code, node = _run(args, tell, transport, say, known=node.peers)
        return code
    finally:
        transport.close()


def _run(
    args: argparse.Namespace,
    tell: Callable[[LiveScenario], int],
    transport: UdpTransport,
    say: _Narrator,
    known: Iterable[Hashable] = (),
) -> tuple[int, Node]:
    """One run from boot to its end; gives the exit code and the node, which knows whether it shall be run again."""
    keyring = _keyring(args)
    blackbox = Blackbox(_state_dir(args) / "logs", time.time)
    if warning := exposure(args.bind, signed=keyring.is_on):
        print(f"darko-sitl: {warning}", file=sys.stderr, flush=True)  # --quiet or not
    try:
        craft = build_craft(args)
        face = ScenarioNode if isinstance(craft, ScenarioCraft) else Node
        node = face(craft, Memory(_state_dir(args)), _peers(args), keyring, blackbox)
        node.identity = IDENTITIES[args.autopilot]
        node.know(known)
        began = time.monotonic()
        make_ready(craft, say)
        took = time.monotonic() - began
        if keyring.is_on:
            say("signing is on: unsigned orders are refused")
        say(f"ready after {took:.1f} s: {args.bind}:{transport.port} -> {args.gcs_port}, {args.api_port}")
        pacer = Pacer(args.speed)
        if not isinstance(craft, ScenarioCraft):
            serve(node, transport, pacer, until=lambda: node.leaving is not None)
            return 0, node
        live = craft.live
        serve(node, transport, pacer, until=lambda: live.complete)
        code = tell(live)
        if args.stay:
            serve(node, transport, pacer)
        return code, node
    finally:
        blackbox.close()


def build_craft(args: argparse.Namespace) -> Craft:
    """The vehicle the arguments describe: at the start of a scenario, on the ground, or hovering where they say."""
    world = World(LocalFrame(Geodetic(*args.home)), ARENAS[args.arena])
    if args.scenario is not None:
        return _scenario_craft(args, world)
    north, east, up, yaw = args.start or (0.0, 0.0, 0.0, 0.0)
    if outside := world.arena.refuse((north, -east, up)):
        raise SitlError(f"--start: {outside}")
    start = Start(north, -east, up, -math.radians(yaw), airborne=up > 0.0)
    vehicle = Simulation(load(args.airframe or "nominal").parameters, seed=args.seed, start=start)
    kept = Memory(_state_dir(args)).parameters()
    bindings = Bindings(Settings(), vehicle.tuning, Surroundings()).replaced(kept | _overrides(args))
    return Craft(vehicle, world, bindings, airborne=start.airborne)


def _scenario_craft(args: argparse.Namespace, world: World) -> ScenarioCraft:
    if args.start is not None:
        raise SitlError(f"--start: where it begins is the scenario's own, {args.scenario}'s")
    # Parameters kept from other flights stay out: a scenario is the same flight for everyone.
    return ScenarioCraft(
        named(args.scenario), world, seed=args.seed, airframe=args.airframe, parameters=_overrides(args)
    )


def _state_dir(args: argparse.Namespace) -> Path:
    return Path(args.state_dir or user_data_path("darko") / "sitl")


def _peers(args: argparse.Namespace) -> list[tuple[str, int]]:
    return [(LOOPBACK, port) for port in dict.fromkeys((args.gcs_port, args.api_port)) if port]


def _keyring(args: argparse.Namespace) -> Keyring:
    given = dict(read_key_option(text) for text in args.signing_key)
    file = KeyFile(Memory(_state_dir(args)).folder)
    return open_keyring(file, given, timestamp=timestamp_at(time.time()), now=time.monotonic())


def _overrides(args: argparse.Namespace) -> dict[str, float]:
    """Parameters the command line sets for this run only."""
    overrides: dict[str, float] = dict(args.param)
    if args.wind is not None:
        overrides["SIM_WIND_SPD"], overrides["SIM_WIND_DIR"] = args.wind
    if args.gusts is not None:
        overrides["SIM_GUST_RMS"] = args.gusts
    return overrides


def serve(node: Node, transport: UdpTransport, pacer: Pacer, *, until: Callable[[], bool] = lambda: False) -> None:
    """Fly and talk, for ever or until something holds."""
    while not until():
        _exchange(node, transport)
        periods = node.quantum()
        node.advance(periods)
        _speak(node, transport, time.monotonic())  # it listens again while it waits: one that is late has no time to
        _wait(node, transport, pacer.wait_time(periods * PERIOD))


def _exchange(node: Node, transport: UdpTransport) -> None:
    now, heard = time.monotonic(), False
    for data, peer in transport.receive():
        node.receive(data, peer, now)
        heard = True
        if time.monotonic() - now > LISTENING:
            break  # the rest waits in the socket, or is lost
    if heard:  # timers are looked at once a quantum
        _speak(node, transport, now)


def _speak(node: Node, transport: UdpTransport, now: float) -> None:
    for destination, data in node.datagrams(now):
        transport.send(data, destination)


def _wait(node: Node, transport: UdpTransport, remaining: float) -> None:
    end = time.monotonic() + remaining
    while remaining > 0.0:
        transport.wait(remaining)
        remaining = end - time.monotonic()
        if remaining > 0.0:
            _exchange(node, transport)


def _interrupt(number: int, frame: object) -> None:  # noqa: ARG001 - the signature of a signal handler
    raise KeyboardInterrupt


class _Narrator:
    """Progress for a person, on stderr."""

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet

    def __call__(self, text: str) -> None:
        if not self._quiet:
            print(f"darko-sitl: {text}", file=sys.stderr, flush=True)
