"""The process of the simulated Motive: sockets and clock around the vehicle watch, the cameras and the server."""

from __future__ import annotations

import argparse
import math
import os
import select
import socket
import sys
import time
from collections.abc import Callable, Hashable
from contextlib import ExitStack, closing
from typing import cast

import numpy as np
from scipy.spatial.transform import Rotation

from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.frames import flip, flip_quaternion, flying_attitude, flying_axes
from protocol.natnet import APPLICATION_VERSIONS, BIT_STREAMS, CLOCK, Address
from protocol.tools.option_values import is_loopback
from protocol.wire.codec import Codec
from protocol.wire.message import Message, source_of
from protocol.wire.signing import Keyring, load_key, timestamp_at
from sitl.errors import SitlError
from sitl.mavlink.transport import UdpTransport
from sitl.motion_capture.cameras import SIDES, Cameras, Disturbances, HallAxes, TrueMotion, read_disturbance
from sitl.motion_capture.natnet_server import NatnetServer
from sitl.motion_capture.rigid_body import load_rigid_body
from sitl.sensors.instruments import SensorSet
from sitl.sensors.sensor_files import load_sensors

# Sees the running vehicle's true motion over MAVLink: asks for DARKO_TRUTH, and asks again when it stops.


OWN_IDS = (254, mavlink.MAV_COMP_ID_USER1)
TRUTH_INTERVAL = 10_000  # between two true states: the vehicle looks at its link so often [us]
ASKING_PERIOD = 1.0  # while none come [s]
MAX_NUMBER_TOLD = 1e5  # in any unit: nothing flies so far or so fast
MAX_UPTIME = 30 * 86400.0  # of a vehicle [s]
VEHICLE_SILENT_TIME = 2.0  # without a true state the vehicle is gone [s]


class VehicleWatch:
    """One vehicle, seen over one link.

    Args:
        keyring: Signs requests and judges what is heard.
        system: System id of the vehicle.
    """

    def __init__(self, keyring: Keyring, system: int = 1) -> None:
        self._codec, self._keyring, self._system = Codec(*OWN_IDS, keyring.link(None)), keyring, system
        self._asked = self._heard = -math.inf
        self._time = 0.0  # of the newest true state, on the vehicle's clock [s]
        self.refusal = ""  # why the vehicle sends none

    def is_seen(self, now: float) -> bool:
        """Whether true states come."""
        return now - self._heard < VEHICLE_SILENT_TIME

    def time(self, now: float) -> float:
        """The vehicle's clock now, guessed since the newest true state but not beyond the next one [s]."""
        return self._time + min(max(now - self._heard, 0.0), TRUTH_INTERVAL * 1e-6)

    def receive(self, data: bytes, now: float) -> list[TrueMotion]:
        """Take a datagram; gives the true states in it."""
        self._keyring.advance_time(now)
        motions = []
        for message in self._codec.decode(data):
            if source_of(message)[0] != self._system or (self._keyring.is_on and not message.get_signed()):
                continue
            if message.get_type() == "DARKO_TRUTH":
                motion = motion_of(message)
                if motion is not None:
                    self._heard, self._time, self.refusal = now, motion.time, ""
                    motions.append(motion)
            elif message.get_type() == "COMMAND_ACK" and message.result != mavlink.MAV_RESULT_ACCEPTED:
                known = mavlink.enums["MAV_RESULT"].get(message.result)
                self.refusal = str(known.name).removeprefix("MAV_RESULT_").lower() if known else "refused"
        return motions

    def requests(self, now: float) -> list[bytes]:
        """Requests to be sent now."""
        self._keyring.advance_time(now)
        if now - self._asked < ASKING_PERIOD or now - self._heard < ASKING_PERIOD:
            return []
        self._asked = now
        wanted = (mavlink.MAVLINK_MSG_ID_DARKO_TRUTH, TRUTH_INTERVAL, 0, 0, 0, 0, 0)
        command = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        return [self._codec.encode(mavlink.MAVLink_command_long_message(self._system, 1, command, 0, *wanted))]


def motion_of(message: Message) -> TrueMotion | None:
    """The true motion that DARKO_TRUTH tells; None if it can be of no vehicle."""
    told = (*message.position, *message.velocity, *message.q, *message.rates)
    if not all(abs(number) < MAX_NUMBER_TOLD for number in told) or math.hypot(*message.q) < 0.5:
        return None
    if message.time_usec > MAX_UPTIME * 1e6:
        return None
    w, x, y, z = flip_quaternion(flying_attitude(message.q))
    return TrueMotion(
        time=message.time_usec * 1e-6,
        position=np.array(flip(message.position)),
        velocity=np.array(flip(message.velocity)),
        attitude=Rotation.from_quat((x, y, z, w)),
        rates=np.array(flip(flying_axes(message.rates))),
    )


MIN_FRAME_RATE, MAX_FRAME_RATE = 10.0, 250.0  # of frames [Hz]
MAX_WAIT = 0.05  # [s]
MIN_WAIT = 2e-4  # [s]
MAX_LINE = 200  # bytes of what a person types

Say = Callable[[str], None]


def serve_motion_capture(args: argparse.Namespace, say: Say) -> None:
    """Serve NatNet until it is interrupted.

    Args:
        args: Options of ``darko-sitl mocap``.
        say: Tells a person what happens.

    Raises:
        SitlError: An option, a file or a port is not usable.
    """
    with ExitStack() as stack:
        motive = build_motive(args, say, stack)
        while True:
            motive.step(time.monotonic())
            motive.wait(time.monotonic())


def build_motive(args: argparse.Namespace, say: Say, stack: ExitStack) -> Motive:
    """The simulated Motive of these options, with its sockets open; ``stack`` closes them."""
    version = _version(args.natnet)
    sensors = sensors_of(args)
    disturbances = Disturbances(tuple(map(read_disturbance, args.event)))
    axes = HallAxes(
        args.up_axis, args.long_edge, args.x_angle if args.x_side is None else SIDES[args.x_side], args.nose
    )
    cameras = Cameras(sensors, load_rigid_body(args.body), axes, args.seed, disturbances)
    command = stack.enter_context(closing(UdpTransport((args.bind, args.command_port))))
    vehicle = stack.enter_context(closing(UdpTransport(("127.0.0.1" if is_loopback(args.vehicle) else "", 0))))
    group = "" if args.unicast else args.multicast
    address = Address(args.data_port, group)
    server = NatnetServer(cameras.body, version, sensors.motion_capture.timing.rate, address)
    link = Motive(
        cameras=cameras,
        server=server,
        watch=VehicleWatch(_keyring(args), args.system),
        disturbances=disturbances,
        command=command,
        vehicle=(vehicle, args.vehicle),
        group=(stack.enter_context(closing(_group_socket(args.bind))), (group, args.data_port)) if group else None,
        say=say,
    )
    application = ".".join(map(str, APPLICATION_VERSIONS[version[0]][:2]))
    where = f"to {group}:{args.data_port}" if group else "to each client"
    rate = sensors.motion_capture.timing.rate
    say(
        f"Motive {application}, NatNet {version[0]}.{version[1]}, at {args.bind}:{command.port}: rigid body "
        f"{cameras.body.name} ({cameras.body.number}), {rate:g} Hz {where}, {args.up_axis} up"
    )
    if not is_loopback(args.bind):
        say(f"WARNING: listening on {args.bind}: anyone who reaches this port can ask for the stream")
    return link


class Motive:
    """Moves datagrams between the vehicle, the cameras, the server and its clients.

    Args:
        cameras: Make frames.
        server: Answers clients.
        watch: Sees the vehicle.
        disturbances: Take what a person types.
        command: The command socket, which clients of their own stream are served from, too.
        vehicle: The socket to the vehicle, and the vehicle's address.
        group: The socket to the multicast group, and the group's address; None: each client is served.
        say: Tells a person what happens.
    """

    def __init__(
        self,
        *,
        cameras: Cameras,
        server: NatnetServer,
        watch: VehicleWatch,
        disturbances: Disturbances,
        command: UdpTransport,
        vehicle: tuple[UdpTransport, Hashable],
        group: tuple[socket.socket, tuple[str, int]] | None,
        say: Say,
    ) -> None:
        self._cameras, self._server, self._watch, self._disturbances = cameras, server, watch, disturbances
        self.command, (self._vehicle, self._vehicle_address) = command, vehicle
        self._group, self._say = group, say
        self._was_seen: bool | None = None
        self._clients: tuple[Hashable, ...] = ()
        self._stdin = _terminal()

    def step(self, now: float) -> None:
        """Take and send what there is.

        Args:
            now: Monotonic time [s].
        """
        for data, sender in self._vehicle.receive():
            if sender == self._vehicle_address:
                for motion in self._watch.receive(data, now):
                    self._cameras.look(motion)
        for data, client in self.command.receive():
            for answer in self._server.receive(data, client, now):
                self.command.send(answer, client)
        for frame in self._cameras.frames(self._watch.time(now)):
            for to, data in self._server.send(frame, now):
                self._send(to, data)
        for data in self._watch.requests(now):
            self._vehicle.send(data, self._vehicle_address)
        self._report(now)

    def wait(self, now: float) -> None:
        """Sleep until something arrives or the next frame is to be sent."""
        due = self._cameras.next_sent
        remaining = MAX_WAIT if due is None else due / CLOCK - self._watch.time(now)
        sockets: list[UdpTransport | int] = [self._vehicle, self.command]
        sockets += [] if self._stdin is None else [self._stdin]
        ready, _, _ = select.select(sockets, [], [], min(max(remaining, MIN_WAIT), MAX_WAIT))
        if self._stdin in ready:
            self._take_line()

    def _send(self, to: Hashable | None, data: bytes) -> None:
        if to is not None:
            self.command.send(data, to)
        elif self._group is not None:
            group, address = self._group
            try:
                group.sendto(data, address)
            except OSError:  # a full buffer, or a network that is gone: the frame is lost
                return

    def _take_line(self) -> None:
        line = os.read(cast("int", self._stdin), MAX_LINE)
        if not line:
            self._stdin = None
        elif words := line.decode("utf-8", "replace").strip():
            self._say(self._disturbances.order(words, self._cameras.time))

    def _report(self, now: float) -> None:
        """Say who came and went."""
        seen = self._watch.is_seen(now)
        if seen != self._was_seen:
            refusal = f" ({self._watch.refusal})" if self._watch.refusal else ""
            host, port = cast("tuple[str, int]", self._vehicle_address)
            missing = "waiting for" if self._was_seen is None else "lost"
            self._say(
                f"sees the vehicle at {host}:{port}" if seen else f"{missing} the vehicle at {host}:{port}{refusal}"
            )
            self._was_seen = seen
        if (clients := self._server.clients) != self._clients:
            for host, port in set(clients) - set(self._clients):  # type: ignore[misc]
                self._say(f"client {host}:{port}")
            for host, port in set(self._clients) - set(clients):  # type: ignore[misc]
                self._say(f"client {host}:{port} is gone")
            self._clients = clients


def sensors_of(args: argparse.Namespace) -> SensorSet:
    """The instruments of the file, with the motion capture's values that the command line names."""
    sensors = load_sensors(args.sensors)
    spec = sensors.motion_capture
    timing = spec.timing
    given = {key: value for key in timing._fields if (value := getattr(args, key)) is not None}
    if args.noise is not None:
        spec = spec._replace(noise=args.noise)
    spec = spec._replace(timing=timing._replace(**given))
    if not MIN_FRAME_RATE <= spec.timing.rate <= MAX_FRAME_RATE:
        raise SitlError(f"--rate {spec.timing.rate:g} Hz is not from {MIN_FRAME_RATE:g} to {MAX_FRAME_RATE:g} Hz")
    return sensors._replace(motion_capture=spec)


def _version(text: str) -> tuple[int, int]:
    return next(version for version in BIT_STREAMS if f"{version[0]}.{version[1]}" == text)


def _keyring(args: argparse.Namespace) -> Keyring:
    if args.signing_key is None:
        return Keyring()
    try:
        key = load_key(args.signing_key)
    except FileError as error:
        raise SitlError(str(error)) from error
    return Keyring({None: key}, timestamp=timestamp_at(time.time()), now=time.monotonic())


def _group_socket(interface: str) -> socket.socket:
    """Sends to the group over one interface; over loopback nothing leaves the machine."""
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        if interface != "0.0.0.0":  # noqa: S104 - compared, not bound
            made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
        made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0 if is_loopback(interface) else 1)
    except OSError as error:
        made.close()
        raise SitlError(f"--bind {interface}: cannot send to a multicast group: {error.strerror}") from error
    return made


def _terminal() -> int | None:
    """The terminal or pipe at which commands are typed; None if there is none."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, ValueError, OSError):  # closed, or not a file
        return None
