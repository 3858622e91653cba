"""The process: sockets, clock and terminal around the links to autopilots."""

from __future__ import annotations

import os
import select
import sys
import time
from collections.abc import Sequence

from sitl.errors import SitlError
from sitl.mavlink.transport import UdpTransport
from sitl.physics.journal import Say
from sitl.physics.link import Datagram, Link
from sitl.physics.ports import StreamPort
from sitl.process.vehicle_process import Pacer
from sitl.sensors.draws import PERIOD

_MAX_WAIT = 0.05  # [s]
_MAX_LINE = 200  # bytes of what a person types


class Seat:
    """One link with its socket and its pace.

    Args:
        name: Of the instance, before what it tells; empty where there is one alone.
        link: The link.
        port: Its socket.
        speed: Most multiple of real time; 0: as fast as the autopilot answers.
    """

    def __init__(self, name: str, link: Link, port: UdpTransport | StreamPort, speed: float) -> None:
        self.name, self.link, self.port = name, link, port
        self._pacer, self._due = Pacer(speed), 0.0

    def turn(self, now: float, *, paused: bool) -> bool:
        """Take what has arrived, fly if it is time, and send; gives whether anything was done."""
        link, out = self.link, list[Datagram]()
        heard = False
        if isinstance(self.port, StreamPort):
            heard = self._connect(self.port, now)
        for data, peer in self.port.receive():
            heard = True
            out += link.receive(data, peer, now)
        out += link.poll(now)
        flies = not paused and now >= self._due and link.wants(now)
        if flies:
            out += link.step(now)
            self._due = time.monotonic() + self._pacer.wait_time(flies * PERIOD)
        for data, to in out:
            self.port.send(data, to)
        return heard or bool(flies)

    def _connect(self, port: StreamPort, now: float) -> bool:
        events = port.events()
        for event in events:
            if event == "opened":
                self.link.opened(now)
            else:
                self.link.closed(now)
        return bool(events)

    def wakes(self, now: float) -> float:
        """Time to look again though nothing arrives [s]."""
        waits = self.link.wants(now) > 0
        return self._due if waits else self.link.wakes()


class Server:
    """Serves autopilots until it is interrupted.

    Args:
        seats: The links.
        say: Takes a line for a person.
        listens: Whether a person may type orders.
    """

    def __init__(self, seats: Sequence[Seat], say: Say, *, listens: bool = True) -> None:
        self._seats, self._say = seats, say
        self._stdin = _terminal() if listens else None
        self.paused = False

    def run(self) -> None:
        """Serve for ever."""
        while True:
            self.turn()

    def turn(self) -> None:
        """Serve every link once; wait if there was nothing to do."""
        now = time.monotonic()
        busy = [seat.turn(now, paused=self.paused) for seat in self._seats]
        now = time.monotonic()
        due = min((seat.wakes(now) for seat in self._seats), default=now) - now
        timeout = 0.0 if any(busy) else min(max(due, 1e-4), _MAX_WAIT)
        waited: list[UdpTransport | StreamPort | int] = [seat.port for seat in self._seats]
        for seat in self._seats:
            waited += seat.port.sockets() if isinstance(seat.port, StreamPort) else []
        waited += [] if self._stdin is None else [self._stdin]
        ready, _, _ = select.select(waited, [], [], _MAX_WAIT if self.paused and not any(busy) else timeout)
        if self._stdin is not None and self._stdin in ready:
            self._take_line(self._stdin)

    def _take_line(self, stdin: int) -> None:
        line = os.read(stdin, _MAX_LINE)
        if not line:
            self._stdin = None
        elif words := line.decode("utf-8", "replace").strip():
            self.order(words)

    def order(self, words: str) -> None:
        """Do what a person typed."""
        if words in {"pause", "go"}:
            self.paused = words == "pause"
            self._say("paused: go flies on" if self.paused else "flies on")
            return
        for seat in self._seats:
            try:
                text = seat.link.journal.summary() if words == "counts" else seat.link.rig.order(words)
            except SitlError as error:
                self._say(str(error))
                return
            self._say(f"{seat.name}{text}")


def _terminal() -> int | None:
    """The terminal or pipe at which orders are typed; None if there is none."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, ValueError, OSError):  # closed, or not a file
        return None
