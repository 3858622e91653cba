"""Records a telemetry log: whole records only, also if the disk fails."""

from bisect import bisect_right
from contextlib import suppress
from io import RawIOBase
from itertools import accumulate
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from protocol.errors import FileError, LocalProtocolError
from protocol.tlog.scan import STAMP_SIZE, TIME_LIMIT
from protocol.wire.framing import frame_length


class TlogWriter:
    """Appends records to a stream; use it as a context manager, or ``close`` it.

    Records wait in memory until they span ``flush_after`` of logged time or ``flush_bytes``: a crash loses no
    more. When the stream fails (a full disk), a partly written record is removed, ``FileError`` is raised once, and
    from then on ``write`` only counts the dropped records: a failed log must not end a flight.

    Args:
        stream: Unbuffered binary file, empty or opened to append.
        name: Name of the stream in errors.
        flush_after: Logged time between two flushes [us].
        flush_bytes: Waiting bytes that cause an earlier flush.
    """

    def __init__(
        self,
        stream: BinaryIO | RawIOBase,
        *,
        name: str = "log",
        flush_after: int = 1_000_000,
        flush_bytes: int = 65536,
    ) -> None:
        self._stream, self._name = stream, name
        self._flush_after, self._flush_bytes = flush_after, flush_bytes
        self._pending: list[bytes] = []
        self._pending_bytes = 0
        self._pending_since = 0
        self._end = stream.seek(0, 2)  # where the last whole record ends
        self.written = 0  # records that are in the stream
        self.dropped = 0  # records lost since the stream failed
        self.failed = False

    @classmethod
    def open(cls, path: Path | str) -> Self:
        """Writer that appends to a file; creates the file if it does not exist.

        Raises:
            FileError: The file cannot be opened.
        """
        try:
            return cls(Path(path).open("ab", buffering=0), name=str(path))
        except OSError as error:
            raise FileError(f"{path}: cannot be written: {error.strerror}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def write(self, time_usec: int, frame: bytes) -> None:
        """Record one frame of either version.

        Args:
            time_usec: Time since 1970 [us].
            frame: One whole frame, as ``get_msgbuf()`` returns it.

        Raises:
            LocalProtocolError: ``frame`` is not one whole frame, or the time is not in [0, 2^53).
            FileError: The stream has just failed.
        """
        if not frame or frame_length(frame) != len(frame):
            raise LocalProtocolError(f"cannot record {len(frame)} bytes: not one whole frame")
        if not 0 <= time_usec < TIME_LIMIT:
            raise LocalProtocolError(f"cannot record at {time_usec} us: outside the range of log times")
        if self.failed:
            self.dropped += 1
            return
        if not self._pending:
            self._pending_since = time_usec
        self._pending.append(time_usec.to_bytes(STAMP_SIZE, "big") + frame)
        self._pending_bytes += STAMP_SIZE + len(frame)
        late = abs(time_usec - self._pending_since) >= self._flush_after
        if late or self._pending_bytes >= self._flush_bytes:
            self.flush()

    def flush(self) -> None:
        """Hand every record to the operating system.

        Raises:
            FileError: The stream has just failed.
        """
        records, self._pending, self._pending_bytes = self._pending, [], 0
        done, reason = self._push(b"".join(records))
        whole = bisect_right(list(accumulate(map(len, records))), done)
        self.written += whole
        self._end += sum(map(len, records[:whole]))
        if reason:
            self._give_up(len(records) - whole)
            raise FileError(f"{self._name}: recording stopped after {self.written} records: {reason}")

    def _push(self, data: bytes) -> tuple[int, str]:
        """Number of bytes written, and the reason if it is not all of them."""
        done = 0
        try:
            while done < len(data):
                count = self._stream.write(data[done:])
                if not count:
                    return done, "the stream accepts no more"
                done += count
        except OSError as error:
            return done, error.strerror or str(error)
        return done, ""

    def _give_up(self, lost: int) -> None:
        self.failed = True
        self.dropped += lost
        with suppress(OSError):  # a stream that cannot be truncated keeps half a record: readers skip it
            self._stream.truncate(self._end)

    def close(self) -> None:
        """Flush and close the stream; it ends with a whole record.

        Raises:
            FileError: The stream has just failed.
        """
        try:
            if not self.failed:
                self.flush()
        finally:
            with suppress(OSError):
                self._stream.close()
