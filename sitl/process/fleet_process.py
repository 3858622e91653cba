"""Several vehicles on one port: this process listens, and others, one for each core, fly the vehicles.

Messages are packed by Python, which runs on one core per process: that takes most of a vehicle's time. So the vehicles
are dealt out to processes. All are built and compiled first and the processes forked then, so that the start costs as
much as a single vehicle's. The processes send by the listening process's own socket; only what arrives is passed on.
"""

from __future__ import annotations

import argparse
import gc
import os
import signal
import sys
import time
from collections.abc import Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import NamedTuple

from sitl.errors import SitlError
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.node import Node
from sitl.mavlink.transport import UdpTransport
from sitl.process.inbox import Inbox, InboxOutlet
from sitl.process.members import member_arguments
from sitl.process.squadron import Squadron
from sitl.process.vehicle_process import (
    Narrator,
    build_node,
    interrupt,
    link_text,
    open_keys,
    open_recorder,
    serve,
    state_folder,
    warn_of_open_port,
)
from sitl.process.warm_up import first_start, make_ready
from sitl.timing import PERIOD
from sitl.tools.pacer import Pacer
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS

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
