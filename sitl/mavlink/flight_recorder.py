"""The vehicle's own record of its flights: each from arming to a second after disarming, as a telemetry log.

A log holds the telemetry at its default rates, whatever peers ask for or not, and the events; IMU and actuators more
often than a link has them. Files are numbered; the oldest are deleted if there are too many or they are too large. A
disk that fails ends the log, not the flight, and recording begins again once the disk can be written.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from protocol.dialect import mavlink
from protocol.engines.file_transfer import File, Log
from protocol.engines.server.replies import split_text
from protocol.engines.server.stream_server import StreamScheduler
from protocol.errors import FileError
from protocol.tlog import TlogWriter
from protocol.wire.codec import Codec
from protocol.wire.message import Message
from sitl.mavlink.telemetry.telemetry_service import STREAMS

__all__ = ["FlightRecorder"]

MAX_FILE_SIZE = 8 << 20  # a longer flight has several files [bytes]
MAX_FILES = 64
MAX_TOTAL_SIZE = 64 << 20  # of all files [bytes]
RETRY_INTERVAL = 10.0  # between attempts to go on recording [s]
AFTER_DISARMING = 1.0  # a log goes on this long: texts about the disarming belong to the flight [s]
LAST_DATE = 4_102_444_800.0  # 2100-01-01 [s since 1970]: a later clock is wrong, and time stamps of logs end in 2255
OFTEN_RECORDED = (mavlink.MAVLINK_MSG_ID_HIGHRES_IMU, mavlink.MAVLINK_MSG_ID_DARKO_ACTUATORS)  # for identification
RECORDED_OFTEN_US = 20_000  # between two of them, as often as the autopilot ticks
HEARTBEAT = mavlink.MAVLINK_MSG_ID_HEARTBEAT
_NAME = re.compile(r"(\d{5,9})-(\d{8}-\d{6})\.tlog")
_DATE = "%Y%m%d-%H%M%S"


class FlightRecorder:
    """One folder of logs.

    Args:
        folder: Where they are stored; it is made if it is missing.
        wall_clock: Seconds since 1970. It is asked once per file, whose time stamps then follow the vehicle's own time:
            the clock may be set while a flight is recorded.
        system: System id in the recorded frames.
        component: Component id in them.
        whole: Record from the beginning to the end, armed or not, in one file however long.
        also: Rates of messages that are sent on request only [Hz], by their ids.
    """

    def __init__(
        self, folder: Path, wall_clock: Callable[[], float], *, system: int = 1, component: int = 1,
        whole: bool = False, also: Mapping[int, float] | None = None,
    ) -> None:  # fmt: skip
        self._whole = whole
        self._also = {number: round(1e6 / rate) for number, rate in (also or {}).items()}
        self._folder, self._wall_clock = folder, wall_clock
        self._codec = Codec(system, component)
        self._streams = StreamScheduler({})
        self._writer: TlogWriter | None = None
        self._current = ""  # name of the file that is being written
        self._written = 0  # bytes in it
        self._offset_us = 0  # from the vehicle's time to the log's
        self._armed = False
        self._failed = False  # in this flight, and complained about
        self._next_check = math.inf  # on the vehicle's clock, when to see whether the log is still there [s]
        self._ends = math.inf  # on the vehicle's clock [s]
        self._texts = 0
        self._complaints: list[str] = []
        self._sizes = self._find()  # finished logs, oldest first

    # Recording

    @property
    def is_recording(self) -> bool:
        """True while a flight is being recorded."""
        return self._writer is not None

    def follow(self, time: float, messages: Callable[[int], list[Message]], *, armed: bool) -> None:
        """Record the telemetry that is due; call it as often as telemetry is sent.

        Args:
            time: The vehicle's own [s].
            messages: Makes the messages of an id, of this instant.
            armed: Whether the vehicle is armed.
        """
        time_us, armed = round(time * 1e6), armed or self._whole
        if armed and not self._armed:
            self._streams = StreamScheduler(_intervals() | self._also)
            self._failed = False
            self._begin(time_us)
            self._ends, self._next_check = math.inf, time + RETRY_INTERVAL
        elif armed and time >= self._next_check:
            self._next_check = time + RETRY_INTERVAL
            self._go_on(time_us)
        elif self._armed and not armed:
            self._ends = time + AFTER_DISARMING
        due = self._streams.due(time_us) if self.is_recording else ()
        for message in itertools.chain.from_iterable(map(messages, due)):
            self._write(message, time_us)
        if time >= self._ends:
            self._end()
        self._armed = armed

    def record(self, message: Message, time: float) -> None:
        """Record an event at the vehicle's own time [s]."""
        self._write(message, round(time * 1e6))

    def record_text(self, severity: int, text: str, time: float) -> None:
        """Record a text as STATUSTEXT (MAV_SEVERITY) at the vehicle's own time [s]."""
        self._texts = self._texts % 0xFFFF + 1
        for message in split_text(severity, text, self._texts):
            self.record(message, time)

    def complaints(self) -> list[str]:
        """Problems of the recorder since the last call, for the operator."""
        complaints, self._complaints = self._complaints, []
        return complaints

    def close(self) -> None:
        """End the log under way."""
        self._end()

    # Logs on offer

    def logs(self) -> list[Log]:
        """All logs, oldest first; the one under way with what it holds so far."""
        sizes = self._sizes | ({self._current: self._size(self._current)} if self.is_recording else {})
        return [Log(name, _began(name), size) for name, size in sizes.items()]

    def open(self, name: str) -> File:
        """A log by its name.

        Raises:
            OSError: There is no such log, or it cannot be read.
        """
        if name not in self._sizes and (self._writer is None or name != self._current):
            raise FileNotFoundError(name)
        return _DiskFile(self._folder / name)

    def erase(self) -> int:
        """Delete the logs of past flights, and count them."""
        before = len(self._sizes)
        for name in list(self._sizes):
            self._delete(name)
        return before - len(self._sizes)

    # Inside

    def _begin(self, time_us: int) -> None:
        self._end()
        wall = min(max(self._wall_clock(), 0.0), LAST_DATE)
        self._make_room()
        number = 1 + max((int(name.partition("-")[0]) for name in self._sizes), default=0)
        self._current = f"{number:05}-{datetime.fromtimestamp(wall, UTC).strftime(_DATE)}.tlog"
        self._offset_us, self._written = round(wall * 1e6) - time_us, 0
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            self._writer = TlogWriter.open(self._folder / self._current)
        except (OSError, FileError) as error:
            self._fail(f"Flight not recorded: {error}")

    def _go_on(self, time_us: int) -> None:
        if self._writer is not None and not (self._folder / self._current).exists():
            self._fail(f"Log {self._current} is gone")
            self._end()
        if self._writer is None:
            self._begin(time_us)

    def _fail(self, text: str) -> None:
        if not self._failed:
            self._complaints.append(text)
        self._failed = True

    def _write(self, message: Message, time_us: int) -> None:
        if self._writer is None:
            return
        frame = self._codec.encode(message)
        self._written += 8 + len(frame)
        try:
            self._writer.write(time_us + self._offset_us, frame)
        except FileError as error:
            is_empty = self._failed  # the retry wrote nothing either
            self._fail(str(error))
            self._end()
            if is_empty:
                self._delete(self._current)
            return
        if self._failed and self._writer.written:
            self._failed = False
            self._complaints.append(f"Flight recorded again: {self._current}")
        if self._written >= MAX_FILE_SIZE and not self._whole:
            self._begin(time_us)

    def _end(self) -> None:
        if self._writer is None:
            return
        try:
            self._writer.close()
        except FileError as error:
            self._complaints.append(str(error))
        self._writer = None
        self._sizes[self._current] = self._size(self._current)

    def _make_room(self) -> None:
        room = MAX_TOTAL_SIZE - MAX_FILE_SIZE
        while self._sizes and (len(self._sizes) >= MAX_FILES or sum(self._sizes.values()) > room):
            oldest = next(iter(self._sizes))
            self._delete(oldest)
            self._sizes.pop(oldest, None)  # a file that cannot be deleted must not count for ever

    def _delete(self, name: str) -> None:
        try:
            (self._folder / name).unlink(missing_ok=True)
        except OSError as error:
            self._complaints.append(f"Log {name} cannot be deleted: {error.strerror}")
        else:
            del self._sizes[name]

    def _size(self, name: str) -> int:
        with suppress(OSError):
            return (self._folder / name).stat().st_size
        return 0

    def _find(self) -> dict[str, int]:
        with suppress(OSError):
            names = (path.name for path in self._folder.iterdir() if path.is_file() and not path.is_symlink())
            found = sorted((int(match[1]), match[0]) for match in map(_NAME.fullmatch, names) if match)
            return {name: self._size(name) for _, name in found}
        return {}


class _DiskFile:
    """A log as it was when it was opened, though the file may still grow."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb", buffering=0)
        self._size = self._file.seek(0, 2)

    @property
    def size(self) -> int:
        """Bytes."""
        return self._size

    def read(self, offset: int, size: int) -> bytes:
        """Bytes from an offset on, fewer at the end."""
        self._file.seek(offset)
        return self._file.read(size)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _intervals() -> dict[int, int]:
    intervals = {s.message_id: round(1e6 / s.rate) for s in STREAMS if s.rate > 0.0} | {HEARTBEAT: 1_000_000}
    del intervals[mavlink.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT]  # the DARKO_* messages hold the same numbers
    intervals |= dict.fromkeys(OFTEN_RECORDED, RECORDED_OFTEN_US)
    return intervals


def _began(name: str) -> int:
    match = _NAME.fullmatch(name)
    with suppress(ValueError):
        return int(datetime.strptime(match[2], _DATE).replace(tzinfo=UTC).timestamp()) if match else 0
    return 0
