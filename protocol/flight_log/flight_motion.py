"""Motion of a recorded vehicle as a page draws it in 3-D: places, attitudes, thrusts, elevons, laws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol.flight_log.field_expressions import between
from protocol.flight_log.flight_series import FlightSeries, Prism, Series

Floats = NDArray[np.float64]
RATE = 20.0  # of samples [Hz]
MAX_SAMPLES = 15_000  # of a flight: a longer one has fewer in a second
MAX_SLOW_SAMPLES = 1500  # of what changes slowly, or is only a line beside the path
Motion = dict[str, Any]  # as JSON has it


@np.errstate(invalid="ignore", over="ignore")  # a log may hold any bits, also NaN and infinite numbers
def flight_motion(flight: FlightSeries, scenery: Sequence[Prism], colours: Sequence[tuple[str, str]]) -> Motion | None:
    """Numbers for the 3-D view of a page; None without places. None in a list: nothing was recorded there.

    Places are north, east, down of the local frame's origin [m]. Lists are flat: three numbers for each place.

    - ``start``, ``step``: time of the first sample, and between two [s], on the vehicle's clock
    - ``position``; ``attitude``: quaternions (w, x, y, z), FRD with x along the nose -> NED
    - ``thrust`` [N], ``elevon`` [rad, positive nose-up]: left and right in turn; empty lists where they were not told
    - ``laws``: [time from which on, label, colour]; ``marks``: [time, label, words, kind] of jumps, modes and alarms
    - ``wind`` (velocity of the air) and ``target``: {times, values}; ``truth``: places
    - ``home``: a place, or None; ``waypoints``: [number, place]
    - ``scenery``: {name, corners: [[north, east]], bottom, top above the origin, hollow}

    Args:
        flight: What was recorded.
        scenery: What stands around.
        colours: Label and colour of the law at each sample of ``flight.position``.
    """
    position = flight.position
    if not len(position):
        return None
    span = float(position.times[-1] - position.times[0])
    count = int(min(max(span * RATE, 1.0), MAX_SAMPLES)) + 1
    times = position.times[0] + np.linspace(0.0, span, count)
    return {
        "start": float(times[0]),
        "step": span / (count - 1) or 1.0 / RATE,
        "position": _flat(np.stack([between(times, position.times, position.fields[k]) for k in "xyz"], axis=1), 3),
        "attitude": _flat(_attitudes(flight.attitude, times), 3),
        "thrust": _pairs(flight.actuators, "thrust", times),
        "elevon": _pairs(flight.actuators, "elevon", times),
        "laws": _law_spans(position.times, colours),
        "marks": [[each.time, each.label, each.text, each.kind] for each in flight.events if each.label],
        "wind": _slow(flight.air, "wind_estimate"),
        "target": _slow(_places(flight.target), "place"),
        "truth": _slow(flight.truth, "position")["values"],
        "home": None if flight.home is None else _rounded(flight.home),
        "waypoints": [[seq, _rounded(place)] for seq, place in flight.waypoints],
        "scenery": [
            {"name": p.name, "corners": p.corners, "bottom": p.bottom, "top": p.top, "hollow": p.hollow}
            for p in scenery
        ],
    }


def _attitudes(attitude: Series, times: Floats) -> Floats:
    """Unit quaternions at some times, shape (n, 4); NaN in gaps."""
    if not len(attitude):
        return np.full((len(times), 4), np.nan)
    q = attitude.fields["q"]
    turns_over = np.sum(q[1:] * q[:-1], axis=1) < 0.0  # q and -q are one attitude, but not in between
    signs = np.concatenate(([1.0], np.where(np.cumsum(turns_over) % 2, -1.0, 1.0)))
    q = np.stack([between(times, attitude.times, row) for row in (q * signs[:, None]).T], axis=1)
    length = np.linalg.norm(q, axis=1, keepdims=True)
    return q / np.where(length > 0.0, length, np.nan)


def _pairs(series: Series, name: str, times: Floats) -> list[float | None]:
    if not len(series):
        return []
    return _flat(np.stack([between(times, series.times, row) for row in series.fields[name].T], axis=1), 3)


def _law_spans(times: Floats, colours: Sequence[tuple[str, str]]) -> list[list[float | str]]:
    changes = [k for k in range(len(colours)) if k == 0 or colours[k] != colours[k - 1]]
    return [[float(times[k]), *colours[k]] for k in changes]


def _places(series: Series) -> Series:
    if not len(series):
        return series
    return Series(series.times, {"place": np.stack([series.fields[axis] for axis in "xyz"], axis=1)})


def _slow(series: Series, name: str) -> dict[str, list[float | None]]:
    """A few samples of vectors, the first and the last among them."""
    if not len(series):
        return {"times": [], "values": []}
    rows = np.unique(np.linspace(0, len(series) - 1, min(len(series), MAX_SLOW_SAMPLES)).round().astype(int))
    return {"times": _flat(series.times[rows], 2), "values": _flat(series.fields[name][rows], 2)}


def _rounded(place: Sequence[float]) -> list[float]:
    return [round(each, 3) for each in place]


def _flat(values: Floats, digits: int) -> list[float | None]:
    """The numbers row by row; None for what is not finite."""
    return [each if np.isfinite(each) else None for each in np.round(values, digits).ravel().tolist()]
