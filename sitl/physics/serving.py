"""From the options of ``darko-sitl physics`` to links that are served."""

from __future__ import annotations

import argparse
import math
import signal
from contextlib import ExitStack, closing

from protocol.frames import Geodetic, LocalFrame
from protocol.tools.option_values import is_loopback
from sitl.defaults import AIRFRAME, HOME
from sitl.enclosure.arena_files import load_arena
from sitl.errors import SitlError
from sitl.mavlink.transport import UdpTransport
from sitl.model.airframe_files import load
from sitl.physics.ardupilot import ArduPilotLink
from sitl.physics.betaflight import STATE_PORT, BetaflightLink
from sitl.physics.driven_vehicle import DrivenVehicle
from sitl.physics.journal import Journal, Say, prefixed
from sitl.physics.link import Link
from sitl.physics.outputs import load_outputs
from sitl.physics.ports import StreamPort
from sitl.physics.px4 import Px4Link
from sitl.physics.rig import Rig, read_failure
from sitl.physics.server import Seat, Server
from sitl.process.vehicle_process import interrupt
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.start import Start

LINKS: dict[str, type[Link]] = {"ardupilot": ArduPilotLink, "px4": Px4Link, "betaflight": BetaflightLink}
MAX_PORT = 65535


def serve_physics(args: argparse.Namespace, say: Say) -> None:
    """Serve the autopilots that the options name until it is interrupted.

    Raises:
        SitlError: An option, a file or a port is not usable.
    """
    signal.signal(signal.SIGTERM, interrupt)
    with ExitStack() as stack:
        seats = build_seats(args, say, stack)
        if not is_loopback(args.bind):
            say(f"WARNING: listening on {args.bind}: anyone who reaches this port can fly the vehicle")
        try:
            Server(seats, say).run()
        finally:
            for seat in seats:
                say(f"{seat.name}flew {seat.link.rig.vehicle.time:.1f} s; {seat.link.journal.summary()}")


def build_seats(args: argparse.Namespace, say: Say, stack: ExitStack) -> list[Seat]:
    """The links of all instances, their sockets open and the plant compiled; ``stack`` closes them."""
    kind = LINKS[args.autopilot]
    first = kind.default_port if args.port is None else args.port
    seats: list[Seat] = []
    for instance in range(args.instance, args.instance + args.instances):
        port = first + (kind.port_step * instance if first else 0)
        if port > MAX_PORT:
            raise SitlError(f"--instance {instance}: its port would be {port}")
        name = f"instance {instance}: " if args.instances > 1 else ""
        link = build_link(args, instance, prefixed(say, name))
        if not seats:
            say("loading the plant; a first start compiles it")
            link.rig.vehicle.warm_up()
        opened = (StreamPort if kind.is_stream else UdpTransport)((args.bind, port))
        seats.append(Seat(name, link, stack.enter_context(closing(opened)), args.speed))
        say(f"{name}physics for {args.autopilot} on {args.bind}:{opened.port} ({'TCP' if kind.is_stream else 'UDP'})")
    return seats


def build_link(args: argparse.Namespace, instance: int, say: Say) -> Link:
    """The link of one instance, its vehicle at the start."""
    rig, frame = build_rig(args, instance, say)
    if args.autopilot == "px4":
        nav = args.nav or ("mocap" if load_arena(args.arena).has_net else "satellites")
        return Px4Link(rig, frame, satellites=nav != "mocap", poses=nav != "satellites")
    if args.autopilot == "betaflight":
        return BetaflightLink(rig, frame, (args.autopilot_address, STATE_PORT + BetaflightLink.port_step * instance))
    return ArduPilotLink(rig)


def build_rig(args: argparse.Namespace, instance: int, say: Say) -> tuple[Rig, LocalFrame]:
    """The vehicle of one instance in its world, and its local frame; seeds count up with the instances."""
    arena = load_arena(args.arena)
    north, east, up, yaw = args.start or (0.0, 0.0, 0.0, 0.0)
    if outside := arena.refuse((north, -east, up)):
        raise SitlError(f"--start: {outside}")
    start = Start(north, -east, up, -math.radians(yaw), airborne=up > 0.0)
    airframe, sensors = load(args.airframe or AIRFRAME).parameters, load_sensors(args.sensors)
    vehicle = DrivenVehicle(airframe, seed=args.seed + instance, start=start, sensors=sensors)
    vehicle.surroundings.enclose(arena)
    failures = [read_failure(text) for text in args.fail]
    keeps = args.on_restart == "keep"
    outputs = load_outputs(args.outputs or args.autopilot)
    rig = Rig(vehicle, outputs, Journal(say), failures=failures, keeps=keeps)
    speed, direction = args.wind
    rig.set_wind(speed, direction, args.gusts)
    home = args.home or (HOME if arena.origin is None else Geodetic(*arena.origin))
    return rig, LocalFrame(home)
