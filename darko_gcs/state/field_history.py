"""One vehicle's messages of the last minutes as arrays for charts, and what happened meanwhile.

Messages are kept as the bytes of their payloads: 70 bytes each, and decoded together when a chart asks.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from protocol.errors import FileError
from protocol.flight_log.field_expressions import Curve, curve
from protocol.names import law_label, mode_name
from protocol.tlog.message_set import message_named
from protocol.tlog.reader import payload_type
from protocol.wire.framing import HEADER_V1, HEADER_V2, MAGIC_V1
from protocol.wire.message import Message, Source, source_of

Floats = NDArray[np.float64]

KEPT_TIME = 600.0  # [s]
MAX_MESSAGES = 65_536  # kept of a kind: 600 s at 109 per second
SETTLED_AT = 512  # messages that wait to be put into arrays
MESSAGES_BEFORE = 16  # messages that are taken before a curve begins
MAX_MARKS = 200
CLOCK_STEP_BACK = 5.0  # back of the vehicle's time since boot [s] ...
CLOCK_MESSAGES = 3  # ... in so many messages in a row: it restarted, and its history begins anew
MAX_AHEAD = 1.0  # that a message without a time may be after the last one with a time [s]


class ChartMark(NamedTuple):
    """Something that happened at once."""

    time: float  # on the vehicle's clock [s]
    text: str


class ChartSource(Protocol):
    """A source of curves for charts; times are on the vehicle's clock [s]."""

    @property
    def now(self) -> float:
        """The present time."""

    @property
    def begin(self) -> float:
        """The time of the first message."""

    @property
    def names(self) -> Collection[str]:
        """Messages that there are."""

    @property
    def marks(self) -> Collection[ChartMark]:
        """Jumps of the law and changes of the mode, by time."""

    def curve(self, text: str, since: float = -math.inf) -> Curve:
        """The values of an expression, by ascending time; those before ``since`` [s] may lack.

        Raises:
            FileError: It is none, or there are no such messages.
        """


def ascending(found: Curve) -> Curve:
    """The curve with late messages in their place."""
    if (np.diff(found.times) >= 0.0).all():
        return found
    order = np.argsort(found.times, kind="stable")
    return found._replace(times=found.times[order], values=found.values[order])


class _Payloads:
    """Of one kind of message. Arrays have room at their ends: what is new is not copied together with all that was."""

    def __init__(self, message_class: Message) -> None:
        self.type = payload_type(message_class)
        self._table: NDArray[np.void] = np.zeros(0, dtype=self.type)
        self._all_times: Floats = np.zeros(0)
        self._first = self._end = 0  # of what is kept
        self._waiting: list[bytes] = []
        self._waiting_times: list[float] = []

    @property
    def table(self) -> NDArray[np.void]:
        """The payloads."""
        return self._table[self._first : self._end]

    @property
    def times(self) -> Floats:
        """The times of the messages [s]."""
        return self._all_times[self._first : self._end]

    def add(self, payload: bytes, time: float) -> None:
        """Take a message's payload and time [s]."""
        self._waiting.append(payload)
        self._waiting_times.append(time)
        if len(self._waiting) >= SETTLED_AT:
            self.settle()

    def settle(self) -> None:
        """Put what waits into the arrays; what is too old goes."""
        if not self._waiting:
            return
        count, size = len(self._waiting), self.type.itemsize
        if self._end + count > len(self._table):
            self._make_room(count)
        data = b"".join(payload.ljust(size, b"\0")[:size] for payload in self._waiting)
        self._table[self._end : self._end + count] = np.frombuffer(data, dtype=self.type)
        self._all_times[self._end : self._end + count] = self._waiting_times
        self._end += count
        self._waiting, self._waiting_times = [], []
        old = int(np.searchsorted(self.times, self._all_times[self._end - 1] - KEPT_TIME))
        self._first = max(self._first + old, self._end - MAX_MESSAGES)

    def _make_room(self, count: int) -> None:
        kept = self._end - self._first
        room = max(SETTLED_AT, 2 * (kept + count))
        for name, values in (("_table", self.table), ("_all_times", self.times)):
            larger = np.zeros(room, dtype=values.dtype)
            larger[:kept] = values
            setattr(self, name, larger)
        self._first, self._end = 0, kept


def _payload(frame: bytes | bytearray) -> bytes:
    """The payload of a frame, without the zeros that MAVLink 2 leaves out at its end."""
    begin = HEADER_V1 if frame[0] == MAGIC_V1 else HEADER_V2
    return bytes(frame[begin : begin + frame[1]])


class FieldHistory:
    """The history of one vehicle at a time; that of another one begins when it is chosen.

    Attributes:
        where: In words, for errors.
        marks: Jumps and modes, by time.
        begin: Time of the first message [s].
    """

    where = "the vehicle"

    def __init__(self) -> None:
        self._source: Source | None = None
        self._since = -math.inf  # what a curve needs [s]
        self._forget()

    def _forget(self) -> None:
        self._kinds: dict[str, _Payloads] = {}
        self.marks: deque[ChartMark] = deque(maxlen=MAX_MARKS)
        self._boot, self._boot_at, self._earlier, self._mode = 0.0, -1.0, 0, -1
        self.begin = self._newest = 0.0

    def elsewhere(self, name: str) -> str:  # noqa: ARG002 - what others send is not kept
        """Nothing."""
        return ""

    def follow(self, source: Source | None) -> None:
        """Keep the messages of another vehicle from now on."""
        if source != self._source:
            self._source = source
            self._forget()

    def take(self, messages: Iterable[Message], now: float) -> None:
        """Take messages that arrived at a time [s]; those of other senders are left out."""
        for message in messages:
            if source_of(message) == self._source:
                self._take(message, now)

    def _take(self, message: Message, now: float) -> None:
        time, name = self._time_of(message, now), message.get_type()
        if not self._kinds:
            self.begin = time
        payloads = self._kinds.get(name)
        if payloads is None:
            payloads = self._kinds[name] = _Payloads(type(message))
        payloads.add(_payload(message.get_msgbuf()), time)
        self._newest = max(self._newest, time)
        if name == "DARKO_JUMP":
            self.marks.append(ChartMark(time, law_label(message.law_to)))
        elif name == "HEARTBEAT" and message.custom_mode != self._mode:
            if self._mode >= 0:
                mode = mode_name(message.autopilot, message.type, message.custom_mode)
                self.marks.append(ChartMark(time, mode or f"MODE {message.custom_mode}"))
            self._mode = message.custom_mode

    def _time_of(self, message: Message, now: float) -> float:
        """Time at which the vehicle made a message, by its own clock [s]; by ours until it has told its own."""
        told = getattr(message, "time_boot_ms", None)
        if told is None:
            return now if self._boot_at < 0.0 else self._boot + min(max(now - self._boot_at, 0.0), MAX_AHEAD)
        time = float(told) / 1e3
        if self._boot_at < 0.0:
            self._forget_untimed()
        self._earlier = self._earlier + 1 if time < self._boot - CLOCK_STEP_BACK else 0
        if self._earlier >= CLOCK_MESSAGES:
            self._forget()
        if not self._earlier:
            self._boot, self._boot_at = max(self._boot, time), now
        return time

    def _forget_untimed(self) -> None:
        """Forget messages from before the vehicle told its clock: they have times of ours."""
        mode = self._mode
        self._forget()
        self._mode = mode

    # As a table of fields

    @property
    def names(self) -> Collection[str]:
        """Messages that came."""
        return self._kinds.keys()

    def times(self, name: str) -> Floats:
        """Times of the messages of a name [s], shape (n,)."""
        payloads = self._settled(name)
        return payloads.times[self._first_row(payloads) :]

    def columns(self, name: str) -> Mapping[str, NDArray[Any]]:
        """Their fields."""
        payloads = self._settled(name)
        table = payloads.table[self._first_row(payloads) :]
        return {field: table[field] for field in table.dtype.names or ()}

    def _first_row(self, payloads: _Payloads) -> int:
        """The first message that a curve needs, and some before it: its line begins there, and late ones are near."""
        if self._since == -math.inf:
            return 0
        return max(0, int(np.searchsorted(payloads.times, self._since)) - MESSAGES_BEFORE)

    def _settled(self, name: str) -> _Payloads:
        payloads = self._kinds.get(name)
        if payloads is None:
            return _Payloads(message_named(name))
        payloads.settle()
        return payloads

    # As a source of charts

    @property
    def now(self) -> float:
        """The vehicle's newest time [s]."""
        return self._newest

    def curve(self, text: str, since: float = -math.inf) -> Curve:
        """The values of an expression, by ascending time; those before ``since`` [s] may lack.

        Raises:
            FileError: It is none, or the vehicle has not sent such messages.
        """
        if self._source is None:
            raise FileError("no vehicle has been heard")
        self._since = since
        return ascending(curve(self, text))
