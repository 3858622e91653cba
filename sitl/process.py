"""The vehicle process: node, pacer and transport in one loop."""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time

from platformdirs import user_data_path

from protocol.frames import Geodetic, LocalFrame
from sitl.airframe import load
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft
from sitl.memory import Memory
from sitl.node import Node
from sitl.pacer import Pacer
from sitl.parameters import Bindings, Surroundings
from sitl.transport import UdpTransport
from sitl.vehicle import TICK, Start, Vehicle

QUANTUM = 5  # control ticks flown between looks at the socket: 10 ms of simulated time
LOOPBACK = "127.0.0.1"


def fly(args: argparse.Namespace) -> int:
    """Build the vehicle the arguments describe and fly it until interrupted.

    Raises:
        SitlError: If an argument, a file or the port is not usable.
    """
    say = _Narrator(quiet=args.quiet)
    transport = UdpTransport((LOOPBACK, args.port))
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        node = build(args)
        began = time.monotonic()
        node.craft.vehicle.warm_up(lambda text: say(f"{text} (kept for the next start)"))
        took = time.monotonic() - began
        say(f"ready after {took:.1f} s: 127.0.0.1:{transport.port} -> {args.gcs_port}, {args.api_port}")
        serve(node, transport, Pacer(args.speed))
    finally:
        transport.close()
    return 0


def build(args: argparse.Namespace) -> Node:
    """The vehicle the arguments describe, on the ground or hovering where they say."""
    north, east, up, yaw = args.start
    start = Start(north, -east, up, -math.radians(yaw), airborne=up > 0.0)
    vehicle = Vehicle(load(args.airframe).parameters, seed=args.seed, start=start)
    memory = Memory(args.state_dir or user_data_path("darko") / "sitl")
    world = World(LocalFrame(Geodetic(*args.home)), ARENAS[args.arena])
    bindings = Bindings(Settings(), vehicle.tuning, Surroundings()).replaced(memory.parameters() | _overrides(args))
    peers = [(LOOPBACK, port) for port in dict.fromkeys((args.gcs_port, args.api_port)) if port]
    return Node(Craft(vehicle, world, bindings, airborne=start.airborne), memory, peers)


def _overrides(args: argparse.Namespace) -> dict[str, float]:
    """Parameters the command line sets for this run only."""
    overrides: dict[str, float] = dict(args.param)
    if args.wind is not None:
        overrides["SIM_WIND_SPD"], overrides["SIM_WIND_DIR"] = args.wind
    if args.gusts is not None:
        overrides["SIM_GUST_RMS"] = args.gusts
    return overrides


def serve(node: Node, transport: UdpTransport, pacer: Pacer) -> None:
    """Fly and talk for ever."""
    while True:
        _exchange(node, transport)
        node.advance(QUANTUM)
        _exchange(node, transport)
        _wait(node, transport, pacer)


def _exchange(node: Node, transport: UdpTransport) -> None:
    now = time.monotonic()
    for data, peer in transport.receive():
        node.receive(data, peer, now)
    for destination, data in node.datagrams(now):
        transport.send(data, destination)


def _wait(node: Node, transport: UdpTransport, pacer: Pacer) -> None:
    remaining = pacer.wait_time(QUANTUM * TICK)
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
