"""The one clock of a log: seconds since its first record, as the vehicle counts them.

A summary, a table, a page, a replay and their options all count by it. The recorder's clock may run slower than a
simulation's, and a late message came when others did that were made after it. Most messages say when they were made
(``time_boot_ms``); that is their time, also if they came late, behind their successors. A restart is a step back of
that time, to what may have passed since, that stays; a late message is followed by the old time again. Other messages
have the time between those that came before and after them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from protocol.tlog import TlogReader
from protocol.tlog.message_set import message_named
from protocol.tlog.reader import BOOT_TIMED
from protocol.wire.message import Source

Floats = NDArray[np.float64]
Rows = NDArray[np.int64]

MAX_DELAY = 30.0  # of a message that is only late [s]; another time than its neighbours' by more is not its own
MIN_STEP = 1.0  # back, before which a message may be late or the vehicle restarted: messages are not sent in order [s]
BOOT_TIME = 2.0  # that a vehicle's clock may show, more than has passed since it was last heard, after a restart [s]
OWN_TIMES = {"time_boot_ms": 1e-3, "time_usec": 1e-6}  # fields [s]; the second one may be since 1970
SAME_RATE = 0.05  # difference of two clocks' rates, below which they are told to run alike
ORDER = 1e-9  # keeps records of one recorded time apart [s]


@dataclass(frozen=True)
class FlightClock:
    """Times of a log's records on one vehicle's clock.

    Attributes:
        reader: The log.
        source: The vehicle's (system, component).
        arrivals: When each record came [s since the log's first one], shape (n,), never backwards. Across a restart it
            goes on by the recorder's clock. Without any timed message it is the playing time.
        rate: How much faster than the recorder's clock the vehicle's ran; 1 if that is not known.
    """

    reader: TlogReader
    source: Source
    arrivals: Floats
    rate: float
    _timed: Rows  # the vehicle's records that tell a time since boot
    _shifts: Floats  # of each of these: its time on this clock less the one it tells [s]

    @cached_property
    def times(self) -> Floats:
        """Time of each record [s since the log's first one], shape (n,): late ones go back."""
        times = self.arrivals.copy()
        for name in self.reader.names:
            times[self.reader.rows(name, self.source)] = self.times_of(name)
        return times

    def times_of(self, name: str) -> Floats:
        """Time at which the vehicle made each of its messages ``name`` [s], in the order of the log."""
        rows = self.reader.rows(name, self.source)
        times, fields = self.arrivals[rows], message_named(name).fieldnames
        stamp = next((field for field in OWN_TIMES if field in fields), None)
        if stamp is None or not len(rows) or not len(self._timed):
            return times
        shifts = self._shifts[np.maximum(np.searchsorted(self._timed, rows, side="right") - 1, 0)]
        own = self.reader.columns(name, self.source)[stamp] * OWN_TIMES[stamp] + shifts
        return np.where(np.abs(own - times) < MAX_DELAY, own, times)

    def at(self, playing: float) -> float:
        """Time of a playing time [s]."""
        return float(np.interp(playing, self.reader.clock.playing, self.arrivals))

    def playing_at(self, time: float) -> float:
        """Playing time of a time [s]; beyond the log's ends that of its end."""
        return float(np.interp(time, self.arrivals, self.reader.clock.playing))

    @property
    def restarts(self) -> Floats:
        """Times on this clock at which the vehicle's own began anew [s]."""
        back = np.flatnonzero(np.diff(self._shifts) > MIN_STEP) + 1
        return self._shifts[back]

    def since_boot(self, playing: float) -> float:
        """The vehicle's own clock at a playing time [s]: after a restart it begins anew."""
        now = self.at(playing)
        if not len(self._timed):
            return now
        last = int(np.searchsorted(self.reader.clock.playing[self._timed], playing, side="right")) - 1
        return now - float(self._shifts[max(last, 0)])


def flight_clock(reader: TlogReader, source: Source) -> FlightClock:
    """The clock of a vehicle in a log.

    Args:
        reader: The log.
        source: The vehicle's (system, component).
    """
    playing = reader.clock.playing
    rows, boot = _timed(reader, source)
    if len(rows) < 2:
        return FlightClock(reader, source, playing, 1.0, np.zeros(0, dtype=np.int64), np.zeros(0))
    passed, steps = _steps(reader, source)
    silence = _longest_silence(passed, steps)
    rate = _rate(passed, steps, silence)
    lives, timely = _lives(boot, playing[rows], silence, rate)
    shifts = _shifts(lives, boot, playing[rows], timely)
    told = boot + shifts
    pace = rate if rate > 0.0 and abs(rate - 1.0) > SAME_RATE else 1.0  # so that vehicles agree that join later
    place = playing + np.arange(len(reader)) * ORDER
    anchors = np.flatnonzero(timely)
    before = np.minimum(playing - playing[rows[anchors[0]]], 0.0) * pace
    after = np.maximum(playing - playing[rows[anchors[-1]]], 0.0)
    arrivals = np.interp(place, place[rows[anchors]], np.maximum.accumulate(told[anchors])) + before + after
    begin = arrivals[0] - pace * playing[0]  # a part of a log may begin later than the log
    return FlightClock(reader, source, arrivals - begin, rate, rows, shifts - begin)


def times_in_log(reader: TlogReader, source: Source) -> Floats:
    """Time of each record [s since the log's first one], shape (n,)."""
    return flight_clock(reader, source).times


def _timed(reader: TlogReader, source: Source) -> tuple[Rows, Floats]:
    """Records of the vehicle that tell its time since boot, and that time [s]."""
    rows = [reader.rows(name, source) for name in BOOT_TIMED]
    boots = [reader.columns(name, source)["time_boot_ms"].astype(np.float64) / 1e3 for name in BOOT_TIMED]
    order = np.argsort(np.concatenate(rows), kind="stable")
    return np.concatenate(rows)[order], np.concatenate(boots)[order]


def _steps(reader: TlogReader, source: Source) -> tuple[Floats, Floats]:
    """Between two messages of the first kind that tells a time: what passed by the recorder and by them [s]."""
    for name in BOOT_TIMED:
        rows = reader.rows(name, source)
        if len(rows) > 1:
            boot = reader.columns(name, source)["time_boot_ms"].astype(np.float64) / 1e3
            return np.diff(reader.clock.playing[rows]), np.diff(boot)
    return np.ones(1), np.ones(1)


def _rate(passed: Floats, steps: Floats, silence: float) -> float:
    """Rate of the vehicle's clock, as a multiple of the recorder's."""
    usual = (steps >= 0.0) & (steps <= passed + silence)
    total = float(passed[usual].sum())
    return float(steps[usual].sum()) / total if total > 0.0 else 1.0


def _lives(boot: Floats, playing: Floats, silence: float, rate: float) -> tuple[Rows, NDArray[np.bool_]]:
    """First row of each life of the vehicle, and whether each message came in order, as ``arrivals`` has them.

    Args:
        boot: Time since boot that the messages tell [s], shape (n,).
        playing: When they were recorded [s], shape (n,).
        silence: How much more than the recorder's clock the vehicle's may step before it is another life [s].
        rate: How much faster than the recorder's clock the vehicle's runs.
    """
    begins, timely = [0], np.ones(len(boot), dtype=np.bool_)
    while True:
        begin = begins[-1]
        restart = _next_life(boot[begin:], playing[begin:], timely[begin:], silence, rate)
        if restart is None:
            return np.array(begins), timely
        begins.append(begin + restart)


def _next_life(boot: Floats, playing: Floats, timely: NDArray[np.bool_], silence: float, rate: float) -> int | None:
    """Index of the first message of the next life; None if there is none. Marks the late and the odd ones before."""
    steps = np.diff(boot, prepend=boot[0])
    ahead = np.flatnonzero(steps > np.diff(playing, prepend=playing[0]) + silence)
    leap = next((k for k in ahead.tolist() if not _is_odd(boot, k)), len(boot))
    odd = [k for k in ahead.tolist() if k < leap]
    timely[odd] = False
    highest = np.maximum.accumulate(np.where(timely, boot, -np.inf))
    behind = np.flatnonzero(boot[:leap] < highest[:leap] - MIN_STEP)
    done = 0
    for k in behind.tolist():
        if k < done:
            continue
        back = _return(boot, playing, float(highest[k]), k)
        passed = max(rate, 1.0) * float(playing[k] - playing[max(k - 1, 0)])
        may_be = bool(boot[k] <= passed + BOOT_TIME)
        if _is_restart(boot, playing, float(highest[k]), k, back, may_be=may_be):
            timely[behind[behind < k]], timely[k:] = False, True
            return k
        done = back if back is not None else len(boot)
    timely[behind] = False
    return leap if leap < len(boot) else None


def _is_odd(boot: Floats, k: int) -> bool:
    """Whether a message alone tells a time far ahead."""
    return k + 1 < len(boot) and bool(boot[k + 1] < boot[k] - MIN_STEP)


def _return(boot: Floats, playing: Floats, highest: float, k: int) -> int | None:
    """The first message behind the k-th that tells the old time again; None if none does within the longest delay."""
    end = int(np.searchsorted(playing, playing[k] + MAX_DELAY, side="right"))
    found = np.flatnonzero(boot[k:end] >= highest - MIN_STEP)
    return k + int(found[0]) if len(found) else None


def _is_restart(boot: Floats, playing: Floats, highest: float, k: int, back: int | None, *, may_be: bool) -> bool:
    """Whether the vehicle restarted before its k-th message, which goes back.

    Args:
        boot: Times since boot [s].
        playing: When the messages were recorded [s].
        highest: The latest time since boot before [s].
        k: Of the message.
        back: The first message behind it that tells the old time again.
        may_be: It tells no later time than a vehicle can that has restarted since it was last heard.
    """
    if back is None:
        return may_be or bool(playing[-1] - playing[k] > MAX_DELAY)
    return may_be and bool(boot[back] - boot[back - 1] < (highest - boot[k]) / 2.0)


def _shifts(lives: Rows, boot: Floats, playing: Floats, timely: NDArray[np.bool_]) -> Floats:
    """Shift that is added to each message's time since boot: 0 in the first life, then the time passed before [s]."""
    shifts, shift, last = np.zeros(len(boot)), 0.0, 0.0
    for begin, end in zip(lives.tolist(), [*lives.tolist()[1:], len(boot)], strict=True):
        if begin:
            shift = last + float(playing[begin] - playing[begin - 1]) - float(boot[begin])
        shifts[begin:end] = shift
        last = shift + float(boot[begin:end][timely[begin:end]].max(initial=boot[begin]))
    return shifts


def _longest_silence(passed: Floats, steps: Floats) -> float:
    """Greatest lead of the vehicle's clock over the recorder's between two messages that is not a leap [s]."""
    ratio = float(np.median(steps / np.maximum(passed, 1e-6)))
    return float(max(60.0, 10.0 * ratio * np.median(passed)))
