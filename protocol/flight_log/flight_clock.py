"""The vehicle's own time of records: a log has the time of the recorder, which may run slower than a simulation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from protocol.tlog import TlogReader
from protocol.tlog.replay import playing_times
from protocol.wire.message import Source

__all__ = ["flight_times", "times_since_boot"]

_TIMED = ("ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "SYSTEM_TIME")  # messages with a time since boot


def flight_times(reader: TlogReader, source: Source) -> NDArray[np.float64]:
    """Time of each record on a vehicle's clock [s], shape (n,): 0 at its first timed message, never backwards.

    Between timed messages it is interpolated; across a restart it goes on by the recorder's clock. Without any timed
    message it is the playing time.

    Args:
        reader: The log.
        source: The vehicle's (system, component).
    """
    playing = playing_times(reader.times)
    rows, boot = _timed(reader, source)
    if len(rows) < 2:
        return playing
    steps, passed = np.diff(boot), np.diff(playing[rows])
    restarted = (steps < 0.0) | (steps > passed + _longest_silence(passed, steps))
    flight = np.concatenate(([0.0], np.cumsum(np.where(restarted, passed, steps))))
    before = np.minimum(playing - playing[rows[0]], 0.0)
    after = np.maximum(playing - playing[rows[-1]], 0.0)
    times: NDArray[np.float64] = np.interp(np.arange(len(reader)), rows, flight) + before + after
    return times


def times_since_boot(reader: TlogReader, source: Source) -> NDArray[np.float64]:
    """Time of each record since the vehicle was switched on [s], shape (n,); arguments as of :func:`flight_times`."""
    _, boot = _timed(reader, source)
    return flight_times(reader, source) + (float(boot[0]) if len(boot) else 0.0)


def _timed(reader: TlogReader, source: Source) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Records of the first message in _TIMED that the vehicle sends, and their times since boot [s]."""
    for name in _TIMED:
        rows = reader.rows(name, source)
        if len(rows) > 1:
            return rows, reader.columns(name, source)["time_boot_ms"].astype(np.float64) / 1e3
    return np.zeros(0, dtype=np.int64), np.zeros(0)


def _longest_silence(passed: NDArray[np.float64], steps: NDArray[np.float64]) -> float:
    """How much faster than the recorder's clock the vehicle's may run between two messages before it is a leap [s]."""
    ratio = float(np.median(steps / np.maximum(passed, 1e-6)))
    return float(max(60.0, 10.0 * ratio * np.median(passed)))
