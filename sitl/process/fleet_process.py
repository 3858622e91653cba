"""Several vehicles on one port: the arguments of each, the datagrams dealt out to them, and their processes."""

from __future__ import annotations

import argparse
import contextlib
import gc
import math
import os
import select
import signal
import socket
import struct
import sys
import time
from collections.abc import Callable, Collection, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import NamedTuple, Self

from protocol.engines.base import drop_oldest
from protocol.wire.framing import EVERYONE, target_systems
from sitl.errors import SitlError
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.node import Node
from sitl.mavlink.services.command_service import ExitRequest
from sitl.mavlink.transport import MAX_DATAGRAM, MAX_DATAGRAMS_PER_POLL, Address, UdpTransport
from sitl.process.vehicle_process import (
    Narrator,
    Pacer,
    build_node,
    interrupt,
    link_text,
    member_folder,
    open_keys,
    open_recorder,
    serve,
    state_folder,
    warn_of_open_port,
)
from sitl.process.warm_up import first_start, make_ready
from sitl.sensors.draws import PERIOD
from sitl.tools.error_guard import ErrorGuard, place_of
from sitl.tools.folder_lock import FolderLock
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS

# Several vehicles on one port: this process listens, and others, one for each core, fly the vehicles.
#
# Messages are packed by Python, which runs on one core per process: that takes most of a vehicle's time. So the
# vehicles are dealt out to processes. All are built and compiled first and the processes forked then, so that the start
# costs as much as a single vehicle's. The processes send by the listening process's own socket; only what arrives is
# passed on.

# The arguments of each vehicle of a fleet: those of the command line, with its own ids, start, seed and folder.


LAST_SYSTEM = 254  # 255 is the ground station's usual id


def member_arguments(args: argparse.Namespace, state_dir: Path) -> list[argparse.Namespace]:
    """The arguments of the vehicles, in the order of their system ids.

    They stand on a square grid: the first at ``--start``, the next ones east of it, then the next row north. Vehicle k
    of a fleet (from 0) has the seed ``--seed`` + k, and keeps parameters, plans and logs in a folder of its own.

    Args:
        args: Of ``darko-sitl run``, with ``vehicles``.
        state_dir: Under which their folders are.

    Raises:
        SitlError: An option cannot be combined with several vehicles, or there are too few system ids.
    """
    _refuse_what_one_flies_alone(args)
    last = args.sysid + args.vehicles - 1
    if last > LAST_SYSTEM:
        raise SitlError(f"--vehicles {args.vehicles}: system ids {args.sysid} to {last} would go beyond {LAST_SYSTEM}")
    north, east, up, yaw = args.start or (0.0, 0.0, 0.0, 0.0)
    return [
        argparse.Namespace(
            **vars(args)
            | {
                "sysid": args.sysid + k,
                "forwards": k == 0,  # more than one would multiply what they forward
                "seed": args.seed + k,
                "start": (north + row * args.spacing, east + column * args.spacing, up, yaw),
                "state_dir": member_folder(state_dir, args.sysid + k),
            }
        )
        for k, (row, column) in enumerate(grid(args.vehicles))
    ]


def grid(count: int) -> Sequence[tuple[int, int]]:
    """Row and column of each place in a grid that is as square as can be."""
    columns = math.isqrt(count - 1) + 1
    return [divmod(place, columns) for place in range(count)]


def _refuse_what_one_flies_alone(args: argparse.Namespace) -> None:
    alone = {
        "--scenario": (args.scenario, "an experiment is of one vehicle"),
        "--day": (args.day, "a day is of one vehicle"),
        "--flight-plan": (args.flight_plan, "every vehicle would fly to the same points; upload one to each instead"),
        "--speed 0": (args.speed == 0.0 or None, "several vehicles keep step by the clock"),
    }
    for option, (value, reason) in alone.items():
        if value is not None:
            raise SitlError(f"{option}: not with --vehicles {args.vehicles}: {reason}")


# Datagrams from the process that listens on the port to those that fly vehicles; these send by the port themselves.


PEER = struct.Struct("!4sH")  # before each datagram: IPv4 address and port that it came from


class InboxOutlet:
    """The listening process's end."""

    def __init__(self, link: socket.socket) -> None:
        self._link = link
        link.setblocking(False)

    def put(self, data: bytes, peer: Address) -> None:
        """Pass a datagram on. A full link is no error: the datagram is lost, as in a full socket."""
        with contextlib.suppress(OSError):
            self._link.send(PEER.pack(socket.inet_aton(peer[0]), peer[1]) + data)

    def close(self) -> None:
        """Tell the other end that nothing more will come."""
        self._link.close()


class Inbox:
    """The flying process's end; a transport as ``UdpTransport`` is.

    Args:
        link: Where datagrams come from.
        port: Where they are sent by.
    """

    def __init__(self, link: socket.socket, port: UdpTransport) -> None:
        self._link, self._port = link, port
        self.is_closed = False  # the listening process has ended
        link.setblocking(False)

    @classmethod
    def pair(cls, port: UdpTransport) -> tuple[InboxOutlet, Self]:
        """Both ends of a new link: whole datagrams in order, and an end that is noticed."""
        one, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        return InboxOutlet(one), cls(other, port)

    def wait(self, timeout: float) -> None:
        """Sleep until a datagram arrives or ``timeout`` seconds have passed."""
        select.select([self._link], [], [], timeout)

    def receive(self) -> Iterator[tuple[bytes, Address]]:
        """The datagrams that have arrived, at most ``MAX_DATAGRAMS_PER_POLL``; the next call gives the others."""
        for _ in range(MAX_DATAGRAMS_PER_POLL):
            try:
                packet = self._link.recv(PEER.size + MAX_DATAGRAM)
            except (BlockingIOError, InterruptedError):
                break
            except ConnectionError:
                packet = b""
            if not packet:
                self.is_closed = True
                break
            host, port = PEER.unpack_from(packet)
            yield packet[PEER.size :], (socket.inet_ntoa(host), port)

    def send(self, data: bytes, to: Hashable) -> None:
        """Send to one peer (as ``UdpTransport.send``)."""
        self._port.send(data, to)

    def close(self) -> None:
        """Release this end."""
        self._link.close()


# Vehicles that fly in one process: to the loop that serves them they are one node.
#
# Each has its turn when its own next step is due. They begin at different moments: most telemetry is due at whole
# tenths of a vehicle's second, and if all had these together, packing it for ten vehicles would take longer than a
# tick.


MAX_KNOWN_PEERS = 64
IDLE_PERIODS = 10  # control periods to the next look, where no vehicle is left
GOLDEN_TURN = 309  # control periods between first turns: 0.618 s, so that they are spread over second and tick alike


class Squadron:
    """Gives each vehicle the datagrams that are for it, and flies each in its turn.

    A vehicle gets what names its system or none. The first datagram of a peer goes to all, so that each speaks to it.
    What names a system that is no vehicle of the fleet goes to the vehicle that forwards (``Node``'s ``forwards``).

    A vehicle that cannot fly on, for an error, is left out: the others fly on.

    Args:
        nodes: The vehicles by system id.
        fleet: System ids of all vehicles on the port, also of those in other processes.
        reboot: Builds a vehicle anew, by its system id.
        tell: Tells a person which vehicle cannot fly on, and why.

    Attributes:
        nodes: The vehicles that fly, by system id.
        lost: How many cannot fly on.
    """

    def __init__(
        self,
        nodes: Mapping[int, Node],
        fleet: Collection[int],
        reboot: Callable[[int], Node],
        tell: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self.nodes, self.lost = dict(nodes), 0
        self._fleet, self._reboot, self._tell = frozenset(fleet), reboot, tell
        self._clock = 0  # common time [control periods]
        self._due = {system: _first_turn(place) for place, system in enumerate(self.nodes)}
        self._turn: dict[int, int] = {}  # who flies now, by how many periods
        self._speaking: set[int] = set()
        self._known: dict[Hashable, None] = {}  # peers that all vehicles have heard

    def receive(self, data: bytes, peer: Hashable, now: float) -> None:
        """Take one datagram (as ``Node.receive``)."""
        targets = target_systems(data)
        if not targets:
            return
        for_all = EVERYONE in targets or peer not in self._known
        self._known[peer] = None
        drop_oldest(self._known, MAX_KNOWN_PEERS)
        for system, node in list(self.nodes.items()):
            if for_all or system in targets or (node.forwards and not targets <= self._fleet):
                with self._losing(system):
                    node.receive(data, peer, now)
                    self._speaking.add(system)

    def periods_to_fly(self) -> int:
        """Control periods until the next vehicle's turn, after those whose turn is now have flown."""
        self._turn = {system: node.periods_to_fly() for system, node in self.nodes.items() if self._is_due(system)}
        due = (self._due[system] + self._turn.get(system, 0) for system in self.nodes)
        return min(due, default=self._clock + IDLE_PERIODS) - self._clock

    def advance(self, periods: int) -> None:
        """Fly those whose turn is now, and let the common time pass."""
        for system, own in self._turn.items():
            if system not in self.nodes:
                continue
            with self._losing(system):
                self.nodes[system].advance(own)
            self._due[system] += own
        self._speaking |= self._turn.keys()
        self._clock += periods

    def _is_due(self, system: int) -> bool:
        return self._due[system] <= self._clock

    def datagrams(self, now: float) -> list[tuple[Hashable | None, bytes]]:
        """Datagrams of the vehicles that have flown or heard something (as ``Node.datagrams``)."""
        speaking, self._speaking = self._speaking & self.nodes.keys(), set()
        said: list[tuple[Hashable | None, bytes]] = []
        for system in sorted(speaking):
            with self._losing(system):
                said += self.nodes[system].datagrams(now)
        return said

    @contextmanager
    def _losing(self, system: int) -> Iterator[None]:
        """Leave a vehicle out after an error; one that is not expected is raised where errors are to be seen."""
        try:
            yield
        except Exception as error:
            if ErrorGuard.raises and not isinstance(error, SitlError):
                raise
            where = "" if isinstance(error, SitlError) else f"internal error in {place_of(error)}: "
            self._tell(f"vehicle {system} cannot fly on: {where}{error}")
            self.nodes.pop(system, None)
            self.lost += 1

    def is_over(self) -> bool:
        """Let vehicles end or boot anew that were asked to; true once none is left."""
        for system, node in list(self.nodes.items()):
            if node.exit_request is ExitRequest.REBOOT:
                with self._losing(system):
                    self.nodes[system] = fresh = self._reboot(system)
                    fresh.know(node.peers)
            elif node.exit_request is not None:
                del self.nodes[system]
        return not self.nodes


def _first_turn(place: int) -> int:
    """First turn of a vehicle [control periods], by its place among those of the process: within the first second."""
    return place * GOLDEN_TURN % round(1.0 / PERIOD)


LOST_VEHICLES = 3  # exit code of a process, some of whose vehicles could not fly on
END_TIME = 5.0  # for a process to end once it is asked to [s]
LISTENING_TIME = 1.0  # between looks at whether the processes are well, if nothing arrives [s]


class Flown(NamedTuple):
    """Timekeeping of a process."""

    elapsed: float  # [s]
    busy: float  # time of a core [s]
    missed: int  # autopilot ticks that were flown more than a tick late
    longest_delay: float  # of the end of a step [s]


class Member:
    """One vehicle of the fleet, and how to build it anew."""

    def __init__(self, args: argparse.Namespace) -> None:
        self.args = args
        self.recorder: FlightRecorder | None = None

    def build(self) -> Node:
        """The vehicle at its boot; the recording of the one before ends.

        Raises:
            SitlError: An argument or a file cannot be used; the message names the vehicle.
        """
        self.close()
        try:
            self.recorder = open_recorder(self.args)
            forwards = self.args.forwards
            return build_node(self.args, open_keys(self.args), self.recorder, forwards=forwards)
        except SitlError as error:
            raise SitlError(f"vehicle {self.args.sysid}: {error}") from error

    def close(self) -> None:
        """End the recording."""
        if self.recorder is not None:
            self.recorder.close()


def fly_fleet(args: argparse.Namespace) -> int:
    """Fly the vehicles that the arguments describe until interrupted, or until peers have shut all of them down.

    Args:
        args: Of ``darko-sitl run``, with ``vehicles`` above 1.

    Returns:
        The exit code.

    Raises:
        SitlError: If an argument, a file or the port is not usable, or a vehicle cannot fly on.
    """
    say = Narrator(quiet=args.quiet)
    every = member_arguments(args, state_folder(args))
    members = {one.sysid: Member(one) for one in every}
    locks = [FolderLock(one.state_dir) for one in every]
    transport = UdpTransport((args.bind, args.port))
    signal.signal(signal.SIGTERM, interrupt)
    try:
        began = time.monotonic()
        with first_start() as helper:
            nodes = {system: member.build() for system, member in members.items()}
            warn_of_open_port(args, signed=bool(args.signing_key))
            make_ready(next(iter(nodes.values())).aircraft, say, helper)
        processes = _FlyingProcesses(nodes, members, transport, args.speed)
        took, ids = time.monotonic() - began, f"{every[0].sysid} to {every[-1].sysid}"
        say(
            f"ready after {took:.1f} s: vehicles {ids} in {processes.count} processes, "
            f"{link_text(args, transport.port)}"
        )
        try:
            processes.listen(transport)
        finally:
            say(closing_line(processes.end()))
        if processes.failed:
            raise SitlError("a process of the fleet has ended: its vehicles cannot fly on")
        if processes.lost_vehicles:
            raise SitlError("not all vehicles could fly on, see above")
        return 0
    finally:
        transport.close()
        for lock in locks:
            lock.close()


def closing_line(flown: Sequence[Flown]) -> str:
    """Timekeeping of the processes, in words."""
    if not flown:
        return "no process reported how it kept time"
    missed, delay = sum(one.missed for one in flown), max(one.longest_delay for one in flown)
    shares = " + ".join(f"{100.0 * one.busy / max(one.elapsed, 1e-9):.0f}" for one in flown)
    return (
        f"flown for {max(one.elapsed for one in flown):.1f} s: {missed} ticks missed, "
        f"none more than {1e3 * delay:.1f} ms late; processes took {shares} % of a core"
    )


class _FlyingProcesses:
    """The processes that fly, one for each core at most."""

    def __init__(
        self, nodes: dict[int, Node], members: dict[int, Member], transport: UdpTransport, speed: float
    ) -> None:
        self.count = min(len(nodes), len(os.sched_getaffinity(0)))
        self._outlets: list[InboxOutlet] = []
        self._reports: list[Connection] = []
        self._processes: list[BaseProcess] = []
        context = get_context("fork")
        gc.freeze()  # what is built stays: to look through it for garbage would take time in flight
        for number in range(self.count):
            outlet, inbox = Inbox.pair(transport)
            theirs, ours = context.Pipe(duplex=False)
            systems = list(nodes)[number :: self.count]
            squadron = Squadron(
                {system: nodes[system] for system in systems},
                nodes.keys(),
                lambda system: members[system].build(),
                tell,
            )
            self._outlets.append(outlet)
            work = (squadron, inbox, self._outlets, ours, speed, [members[system] for system in systems])
            process = context.Process(target=_work, args=work, daemon=True)
            process.start()
            ours.close()
            inbox.close()
            self._reports.append(theirs)
            self._processes.append(process)

    @property
    def failed(self) -> bool:
        """Whether a process ended by an error."""
        return any(process.exitcode not in {0, LOST_VEHICLES, None} for process in self._processes)

    @property
    def lost_vehicles(self) -> bool:
        """Whether vehicles could not fly on; the others did."""
        return any(process.exitcode == LOST_VEHICLES for process in self._processes)

    def listen(self, transport: UdpTransport) -> None:
        """Pass on what arrives until all processes have ended, or one by an error."""
        while any(process.is_alive() for process in self._processes) and not self.failed:
            sentinels = [process.sentinel for process in self._processes if process.is_alive()]
            wait([transport.fileno(), *sentinels], LISTENING_TIME)
            for data, peer in transport.receive():
                for outlet in self._outlets:
                    outlet.put(data, peer)

    def end(self) -> list[Flown]:
        """End the processes; gives how those that ended well kept time."""
        for outlet in self._outlets:
            outlet.close()
        flown = []
        for process, report in zip(self._processes, self._reports, strict=True):
            process.join(END_TIME)
            if process.is_alive():
                process.kill()
                process.join()
            try:
                flown.append(report.recv())
            except EOFError:  # it was ended by force, or by an error that it has printed
                continue
        return flown


def _work(
    squadron: Squadron,
    inbox: Inbox,
    outlets: Sequence[InboxOutlet],
    report: Connection,
    speed: float,
    members: list[Member],
) -> None:
    """Fly some of the vehicles until the listening process ends the inbox."""
    for number in (signal.SIGINT, signal.SIGTERM):  # Ctrl-C reaches every process; the listening one ends the others
        signal.signal(number, signal.SIG_IGN)
    for outlet in outlets:
        outlet.close()
    pacer, began, busy = Pacer(speed, AUTOPILOT_PERIODS * PERIOD), time.monotonic(), time.process_time()
    try:
        serve(squadron, inbox, pacer, until=lambda: inbox.is_closed or squadron.is_over())
    finally:
        for member in members:
            member.close()
    elapsed, busy = time.monotonic() - began, time.process_time() - busy
    report.send(Flown(elapsed, busy, pacer.missed, pacer.longest_delay))
    if squadron.lost:
        sys.exit(LOST_VEHICLES)


def tell(line: str) -> None:
    """Tell a person, quiet or not, what became of a vehicle."""
    print(f"darko-sitl: {line}", file=sys.stderr, flush=True)
