"""From a log to what it tells of an airframe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sitl import Airframe, Array, SitlError
from sitl.lab.identification import rotations
from sitl.lab.identification.flight_log import (
    GRID_STEP,
    LEAD_TIME,
    FlightStretch,
    Indices,
    LogConventions,
    SensorRecord,
    Series,
    read_flight,
)
from sitl.lab.identification.output_error import refined
from sitl.lab.identification.path_reconstruction import reconstructed
from sitl.lab.identification.regression import RATE_LIMITS, FitProblem, solved
from sitl.lab.identification.result import Identification, Row, identification
from sitl.lab.identification.unknowns import unknowns_of, with_values
from sitl.model.ground import CLEAR

# The parts of a log that can be used: off the ground, without gaps, and not more of them than are needed.


MAX_SAMPLE_GAP = 0.25  # between samples of IMU and commands; of attitude and motion four times as long [s]
MIN_STRETCH = 6.0  # stretch that is used [s]
PIECE, MAX_USED = 20.0, 120.0  # of a longer flight the pieces that turn most are used, up to a total [s]
EDGE_TIME = 0.5  # left out after a take-off or a gap and before a landing; more than LEAD_TIME [s]
MAX_SPECIFIC_FORCE = 60.0  # specific force that no flight has: a blow [m/s2]
ALL_LOGGED = 0.375  # commands per step of the grid above which none is taken as left out
TURNING = 0.5  # share of omega_min above which a motor is taken as running


def usable_stretches(record: SensorRecord, a: Airframe) -> list[FlightStretch]:
    """The stretches of a log, oldest first.

    Raises:
        SitlError: There are none.
    """
    spans = _spans(record, a)
    if not spans:
        raise SitlError(f"nothing to identify from: no {MIN_STRETCH:g} s in a row off the ground with all sensors")
    pieces = [piece for span in spans for piece in _pieces(*span)]
    if sum(end - begin for begin, end in pieces) > MAX_USED:
        pieces = _liveliest(record, pieces)
    return [_stretch(record, begin, end) for begin, end in pieces]


def _spans(record: SensorRecord, a: Airframe) -> list[tuple[float, float]]:
    series = (record.imu, record.commands, record.attitude, record.motion)
    begin, end = max(s.time[0] for s in series), min(s.time[-1] for s in series)
    time = record.imu.time[(record.imu.time >= begin) & (record.imu.time <= end)]
    if not len(time):
        return []
    usable = _is_flying(record, time, a)
    for s, gap in zip(series, (1.0, 1.0, 4.0, 4.0), strict=True):
        usable &= _interval_around(s, time) <= gap * MAX_SAMPLE_GAP
    hit = np.abs(record.imu.between(begin, end).values[:, 3:]).max(axis=1) > MAX_SPECIFIC_FORCE
    for at in time[hit]:
        usable &= np.abs(time - at) > EDGE_TIME
    edges = np.flatnonzero(np.diff(np.concatenate(([0], usable.astype(np.int8), [0]))))
    spans = [(time[first] + EDGE_TIME, time[last - 1] - EDGE_TIME) for first, last in edges.reshape(-1, 2)]
    return [(float(first), float(last)) for first, last in spans if last - first >= MIN_STRETCH]


def _is_flying(record: SensorRecord, time: Array, a: Airframe) -> npt.NDArray[np.bool_]:
    """Whether the motors turn and the ground is out of reach: it lies where the vehicle was with motors stopped."""
    running = record.commands.values[:, :2].min(axis=1) > TURNING * a.omega_min
    flying = np.interp(time, record.commands.time, running.astype(float)) > 0.99
    up = record.motion.values[:, 2]
    still = np.interp(record.motion.time, record.commands.time, running.astype(float)) < 0.01
    if still.any():
        flying &= np.interp(time, record.motion.time, up) > float(np.median(up[still])) + CLEAR
    return np.asarray(flying, np.bool_)


def _interval_around(series: Series, time: Array) -> Array:
    """Length of the interval between the samples around each instant [s]."""
    after = np.clip(np.searchsorted(series.time, time), 1, len(series.time) - 1)
    return np.asarray(series.time[after] - series.time[after - 1])


def _pieces(begin: float, end: float) -> list[tuple[float, float]]:
    """A span in pieces of nearly the same length."""
    count = max(1, round((end - begin) / PIECE))
    marks = np.linspace(begin, end, count + 1).tolist()
    return list(pairwise(marks))


def _liveliest(record: SensorRecord, pieces: list[tuple[float, float]]) -> list[tuple[float, float]]:
    def turning(piece: tuple[float, float]) -> float:
        return -float(record.imu.between(*piece).values[:, :3].var(axis=0).sum())

    chosen: list[tuple[float, float]] = []
    for piece in sorted(pieces, key=turning):
        if sum(end - begin for begin, end in (*chosen, piece)) <= MAX_USED:
            chosen.append(piece)
    return sorted(chosen)


def _stretch(record: SensorRecord, begin: float, end: float) -> FlightStretch:
    imu = record.imu.between(begin, end)
    first, last = float(imu.time[0]), float(imu.time[-1])
    middles = np.asarray(
        first - LEAD_TIME + GRID_STEP * (np.arange(int((last - first + LEAD_TIME) / GRID_STEP) + 1) + 0.5), np.float64
    )
    commands = _commands_at(record.commands, middles)
    attitude, motion = record.attitude.between(first, last), record.motion.between(first, last)
    attitude_at, late = _nearest(imu.time, attitude.time)
    turned = rotations.of_vector(imu.values[attitude_at, :3] * late[:, None])
    motion_at, shift = _nearest(imu.time, motion.time)
    position, velocity = motion.values[:, :3], motion.values[:, 3:]
    return FlightStretch(
        time=imu.time,
        gyro=imu.values[:, :3],
        accelerometer=imu.values[:, 3:],
        commands=commands,
        attitude_at=attitude_at,
        attitude=rotations.product(attitude.values, turned),
        motion_at=motion_at,
        position=position + velocity * shift[:, None],
        velocity=velocity + np.gradient(velocity, motion.time, axis=0) * shift[:, None],
    )


def _commands_at(commands: Series, time: Array) -> Array:
    """Commands in force: each holds until the next if all were logged, else what lies between counts."""
    if commands.rate * GRID_STEP > ALL_LOGGED:
        return commands.values[np.searchsorted(commands.time, time, side="right") - 1]
    return np.stack([np.interp(time, commands.time, one) for one in commands.values.T], axis=1)


def _nearest(grid: Array, time: Array) -> tuple[Indices, Array]:
    """Index of the nearest sample, and how much later it is [s]."""
    after = np.clip(np.searchsorted(grid, time), 1, len(grid) - 1)
    at = np.where(time - grid[after - 1] < grid[after] - time, after - 1, after)
    return at, grid[at] - time


# Times as wide are the intervals where commands are missing, so that they hold 95 % of the truths (20 to
# 100 Hz); those of rate limits more, which only a command that steps shows.
WIDER, MUCH_WIDER = 2.0, 10.0


def identify(
    log: Path,
    base: Airframe,
    *,
    known: Mapping[str, float] | None = None,
    channels: tuple[int, ...] | None = None,
    hover_frame: bool = True,
) -> Identification:
    """Identify an airframe from a log.

    Args:
        log: A telemetry log, or one that ``protocol.foreign_logs`` reads.
        base: The set to begin from.
        known: Constants that are known, by field.
        channels: Outputs of left motor, right motor, left elevon and right elevon, from 1; negative: reversed.
        hover_frame: Whether attitude and IMU are of the hover frame, or of that of forward flight.

    Raises:
        SitlError: The log cannot be read, lacks something, or has no flight in it; or a known key is none.
    """
    unknowns_of(base, known)  # a wrong key is said before the log is read
    record = read_flight(log, LogConventions(channels, base, hover_frame))
    found = identify_record(record, base, known=known)
    return replace(found, remarks=(f"the log is {record.damage}", *found.remarks)) if record.damage else found


def identify_record(
    record: SensorRecord, base: Airframe, *, known: Mapping[str, float] | None = None
) -> Identification:
    """The same of what was read already."""
    unknowns = unknowns_of(base, known)
    begin = with_values(base, known or {})
    paths = [reconstructed(stretch, base.g) for stretch in usable_stretches(record, base)]
    problem = FitProblem(paths, begin, unknowns)
    with np.errstate(all="ignore"):  # a step too far gives no number, and is not taken
        solution = refined(problem, solved(problem))
    found = identification(paths, problem, solution, begin, record.sources)
    if record.commands.rate * GRID_STEP > ALL_LOGGED:
        return found
    note = (
        f"commands at {record.commands.rate:.0f} Hz: what lies between them is guessed; intervals are {WIDER:g} times"
    )
    return replace(
        found,
        effects=tuple(_wider(row) for row in found.effects),
        parameters=tuple(_wider(row) for row in found.parameters),
        remarks=(f"{note} as wide for it, those of rate limits {MUCH_WIDER:g} times", *found.remarks),
    )


def _wider(row: Row) -> Row:
    return row._replace(interval=row.interval * (MUCH_WIDER if row.key in RATE_LIMITS else WIDER))
