"""The recorder's clock: playing time, which starts at 0 with the first record, and where that clock was set.

Playing time never runs backwards, also if the recording clock did: where that clock was set back, playing continues
from there, and a single record with a time far from its neighbours' gets theirs. A leap forward is a clock that was
set, not a silence, if it is of more than a day, or if the vehicle's own clock says that less than half of it passed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from protocol.tlog.reader import TlogReader

__all__ = ["BOOT_TIMED", "RecorderClock", "recorder_clock"]

Ints = NDArray[np.int64]
BOOT_TIMED = ("ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "SYSTEM_TIME")  # with a time since boot
DAY = 86_400_000_000  # [us]
MIN_LEAP = 60_000_000  # that is looked at: a shorter one is a silence [us]


@dataclass(frozen=True)
class RecorderClock:
    """The times of a log's records.

    Attributes:
        playing: Playing time of each record [s], ascending, shape (n,).
        backward: Records with an earlier time than the one before.
        forward: Records before which the clock was set forward.
        times: As recorded [us since 1970], shape (n,).
    """

    playing: NDArray[np.float64]
    backward: Ints
    forward: Ints
    times: Ints

    @property
    def duration(self) -> float:
        """Playing time of the last record [s]."""
        return float(self.playing[-1]) if len(self.playing) else 0.0

    @cached_property
    def start_usec(self) -> int:
        """Time of the first record, by the clock that most records were made by [us since 1970]."""
        cuts = [0, *sorted({*self.backward.tolist(), *self.forward.tolist()}), len(self.times)]
        begin = max(pairwise(cuts), key=lambda cut: cut[1] - cut[0])[0]
        return int(self.times[begin]) - round(float(self.playing[begin]) * 1e6) if len(self.times) else 0

    def steps(self, rows: Ints) -> NDArray[np.float64]:
        """By how much the clock stepped before some records [s]."""
        return (self.times[rows] - self.times[rows - 1]) / 1e6


def recorder_clock(times: Ints, reader: TlogReader | None = None) -> RecorderClock:
    """The clock of times as recorded [us], shape (n,); the log's messages tell the vehicle's clock."""
    if not len(times):
        return RecorderClock(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), times)
    before, now, after = times[:-2], times[1:-1], times[2:]
    steady = times.copy()
    odd = (before <= after) & ((now < before) | (now > after))
    steady[1:-1][odd] = before[odd]
    steps = np.diff(steady)
    forward = np.zeros(0, dtype=np.int64)
    if steps.max(initial=0) > MIN_LEAP:
        forward = _set_forward(steps, times, reader)
        steps[forward - 1] = 0
    playing = np.concatenate(([0.0], np.cumsum(np.maximum(steps, 0)) / 1e6))
    return RecorderClock(playing, np.flatnonzero(np.diff(times) < 0) + 1, forward, times)


def _set_forward(steps: Ints, times: Ints, reader: TlogReader | None) -> Ints:
    """Records before which the clock was set forward."""
    leaps = np.flatnonzero(steps > MIN_LEAP) + 1
    is_set = steps[leaps - 1] > DAY
    for name in BOOT_TIMED if reader is not None else ():
        if not is_set.all():
            is_set |= _is_silence_too_short(name, leaps, times, reader)
    return leaps[is_set]


def _is_silence_too_short(name: str, leaps: Ints, times: Ints, reader: TlogReader | None) -> NDArray[np.bool_]:
    """Before which records the sender's time since boot went on by less than half of what the recorder's did."""
    found = np.zeros(len(leaps), dtype=np.bool_)
    if reader is None or len(rows := reader.rows(name)) < 2:
        return found
    at = np.searchsorted(rows, leaps)
    inside = (at > 0) & (at < len(rows))
    first, then = rows[at[inside] - 1], rows[at[inside]]
    boot = reader.columns(name)["time_boot_ms"].astype(np.int64) * 1000
    passed = boot[at[inside]] - boot[at[inside] - 1]
    is_one_sender = (reader.systems[first] == reader.systems[then]) & (
        reader.components[first] == reader.components[then]
    )
    found[inside] = is_one_sender & (passed >= 0) & (2 * passed < times[then] - times[first])
    return found
