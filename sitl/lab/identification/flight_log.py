"""Sensors and commands of a recorded flight."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from protocol.errors import FileError
from protocol.flight_log.flight_summary import damage_note
from protocol.foreign_logs import read_log
from protocol.frames import Geodetic, LocalFrame, quaternion_from_euler
from protocol.tlog import TlogReader
from protocol.wire.message import Source
from sitl import Airframe, Array, SitlError
from sitl.lab.identification import rotations

# Sensors and commands out of a telemetry log, from whichever of the standard messages it has.
#
# Each quantity is taken from the first message of its list that comes often enough, else from the most frequent one.
# What is missing or too seldom is said all at once. Own time stamps count; clocks that differ are aligned by the log's.
#
# https://mavlink.io/en/messages/common.html#HIGHRES_IMU and the other messages named below

# Measurements of a flight: sensors and commands, each on its own clock ticks, world NWU and body FLU.


Indices: TypeAlias = npt.NDArray[np.int64]

FLIP_SIGNS = np.array([1.0, -1.0, -1.0])  # FRD to FLU, NED to NWU, and back
GRID_STEP = 0.001  # between commands as they are replayed [s]
LEAD_TIME = 0.4  # in which the actuators come to where they are when a stretch begins [s]


class Series(NamedTuple):
    """Samples of one sensor."""

    time: Array  # (n,) ascending [s]
    values: Array  # (n, k)

    @property
    def rate(self) -> float:
        """Samples a second, by the median interval; 0 for fewer than two."""
        return float(1.0 / np.median(np.diff(self.time))) if len(self.time) > 1 else 0.0

    def between(self, begin: float, end: float) -> Series:
        """The samples of a span of time [s], both ends included."""
        kept = slice(int(np.searchsorted(self.time, begin)), int(np.searchsorted(self.time, end, side="right")))
        return Series(self.time[kept], self.values[kept])


@dataclass(frozen=True)
class SensorRecord:
    """A whole log."""

    imu: Series  # p, q, r [rad/s] and specific force [m/s2], body FLU: (n, 6)
    commands: Series  # w1, w2 [rad/s], d1, d2 [rad]: (n, 4)
    attitude: Series  # quaternions body FLU to world NWU: (n, 4)
    motion: Series  # position [m] and velocity [m/s], world NWU: (n, 6)
    sources: tuple[str, ...]  # which message each of the four came from
    damage: str = ""  # that the file has, in words


@dataclass(frozen=True)
class FlightStretch:
    """A part of the flight without gaps, off the ground. Attitudes and motion are moved to the nearest IMU sample."""

    time: Array  # of the IMU, (n,) [s]
    gyro: Array  # (n, 3)
    accelerometer: Array  # (n, 3)
    commands: Array  # (m, 4), constant over steps of GRID_STEP, from LEAD_TIME before time[0] on
    attitude_at: Indices  # IMU samples of the attitudes, (a,)
    attitude: Array  # (a, 4)
    motion_at: Indices  # (b,)
    position: Array  # (b, 3)
    velocity: Array  # (b, 3)

    @property
    def seconds(self) -> float:
        """Duration of the record [s]."""
        return float(self.time[-1] - self.time[0])


Columns = Mapping[str, npt.NDArray[Any]]
MILLI_G = 9.80665e-3  # of SCALED_IMU [m/s2]
SAME_CLOCK = 0.5  # time stamps are of one clock if they differ by no more [s]
PWM_LOW, PWM_HIGH = 1000.0, 2000.0  # [us]
OUTPUTS = ("left motor", "right motor", "left elevon", "right elevon")
STANDARD_CHANNELS = (1, 2, 3, 4)  # of ACTUATOR_OUTPUT_STATUS, unless the user says otherwise


class LogConventions(NamedTuple):
    """Conventions that a log does not state: outputs of the actuators, from 1, negative if reversed; the frame."""

    numbers: tuple[int, ...] | None  # of OUTPUTS; None: as ours, and none of SERVO_OUTPUT_RAW
    airframe: Airframe  # whose limits are at the ends of the outputs
    hover_frame: bool = True  # whether attitude and IMU are those of the hover frame, as PX4's, or of forward flight


class _Kind(NamedTuple):
    """One message that tells a quantity."""

    name: str
    stamp: str  # field of its own time
    values: Callable[[Columns], Array]


class _Quantity(NamedTuple):
    what: str
    kinds: Sequence[_Kind]
    enough: float  # samples a second
    least: float


def read_flight(path: Path, channels: LogConventions) -> SensorRecord:
    """The sensors and commands of a log.

    Raises:
        SitlError: The log cannot be read or lacks something; all that it lacks is named.
    """
    try:
        reader = read_log(path)
    except FileError as error:
        raise SitlError(str(error)) from error
    source = _vehicle(reader)
    found, missing = [], []
    for quantity in _quantities(channels):
        best, complaint = _best(reader, source, quantity)
        missing += [complaint] if complaint else []
        found.append(best)
    if missing:
        raise SitlError(f"{path}: cannot identify from this log: {'; '.join(missing)}")
    chosen = [one for one in found if one is not None]
    imu, commands, attitude, motion = _on_one_clock([(one.series, one.offset) for one in chosen])
    if channels.hover_frame:
        imu = Series(imu.time, rotations.to_flying_frame(imu.values))
        attitude = Series(attitude.time, rotations.flying_attitudes(attitude.values))
    names = tuple(one.kind.name for one in chosen)
    return SensorRecord(imu, commands, attitude, motion, names, damage_note(reader))


def _quantities(channels: LogConventions) -> Sequence[_Quantity]:
    names = [f"{axis}{kind}" for kind in ("gyro", "acc") for axis in "xyz"]

    def scaled(c: Columns) -> Array:
        return _imu(c, names, 1e-3, MILLI_G)

    imu = [_Kind("HIGHRES_IMU", "time_usec", lambda c: _imu(c, names, 1.0, 1.0))]
    imu += [_Kind(name, "time_boot_ms", scaled) for name in ("SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3")]
    imu += [_Kind("RAW_IMU", "time_usec", scaled)]
    outputs = [
        _Kind("DARKO_ACTUATORS", "time_boot_ms", lambda c: np.hstack([c["motor_command"], c["elevon_command"]])),
        _Kind("ACTUATOR_OUTPUT_STATUS", "time_usec", lambda c: _outputs(c["actuator"], channels)),
    ]
    if channels.numbers is not None:
        outputs.append(_Kind("SERVO_OUTPUT_RAW", "time_usec", lambda c: _servos(c, channels)))
    return (
        _Quantity("IMU", imu, enough=90.0, least=8.0),
        _Quantity("actuator outputs", outputs, enough=45.0, least=18.0),
        _Quantity(
            "attitude",
            [
                _Kind("ATTITUDE_QUATERNION", "time_boot_ms", lambda c: _attitude(_table(c, "q1", "q2", "q3", "q4"))),
                _Kind("ODOMETRY", "time_usec", lambda c: _attitude(c["q"])),
                _Kind("ATTITUDE", "time_boot_ms", lambda c: _attitude(_of_angles(_table(c, "roll", "pitch", "yaw")))),
            ],
            enough=15.0,
            least=4.0,
        ),
        _Quantity(
            "position and velocity",
            [
                _Kind("LOCAL_POSITION_NED", "time_boot_ms", _local),
                _Kind("GLOBAL_POSITION_INT", "time_boot_ms", _global),
            ],
            enough=9.0,
            least=3.0,
        ),
    )


def _vehicle(reader: TlogReader) -> Source | None:
    """The component that sends most: its messages count, not those of ground stations and cameras."""
    if not len(reader):
        return None
    pairs = 256 * reader.systems.astype(np.int64) + reader.components
    return divmod(int(np.bincount(pairs).argmax()), 256)


class _Found(NamedTuple):
    kind: _Kind
    series: Series
    offset: float  # of the log's clock against its own, median [s]


def _best(reader: TlogReader, source: Source | None, quantity: _Quantity) -> tuple[_Found | None, str]:
    """The message to take, and what is wrong with the best there is; empty if nothing."""
    found = [one for kind in quantity.kinds if (one := _found(reader, source, kind)) is not None]
    often = [one for one in found if one.series.rate >= quantity.enough]
    names = ", ".join(kind.name for kind in quantity.kinds)
    if not found:
        more = "" if quantity.what != "actuator outputs" else _hint(reader, source)
        return None, f"no {quantity.what} ({names}){more}"
    best = often[0] if often else max(found, key=lambda one: one.series.rate)
    if best.series.rate < quantity.least:
        return best, f"{quantity.what} at {best.series.rate:.1f} Hz ({best.kind.name}), must be {quantity.least:g} Hz"
    return best, ""


def _hint(reader: TlogReader, source: Source | None) -> str:
    if not len(reader.rows("SERVO_OUTPUT_RAW", source)):
        return ""
    return f"; SERVO_OUTPUT_RAW takes --channels, the outputs of {', '.join(OUTPUTS)}"


def _found(reader: TlogReader, source: Source | None, kind: _Kind) -> _Found | None:
    rows = reader.rows(kind.name, source)
    if len(rows) < 2:
        return None
    columns = reader.columns(kind.name, source)
    own = columns[kind.stamp].astype(np.float64) * (1e-6 if kind.stamp == "time_usec" else 1e-3)
    values = np.asarray(kind.values(columns), np.float64)
    kept = np.isfinite(values).all(axis=1)
    kept &= np.concatenate(([True], np.diff(np.maximum.accumulate(own)) > 0.0))  # repeated and late samples
    if np.count_nonzero(kept) < 2:
        return None
    offset = float(np.median(reader.times[rows] * 1e-6 - own))
    return _Found(kind, Series(own[kept], values[kept]), offset)


def _on_one_clock(found: Sequence[tuple[Series, float]]) -> list[Series]:
    """The series with times since the first sample of all; clocks that differ by more than a little are shifted."""
    reference = found[0][1]
    shifts = [0.0 if abs(offset - reference) <= SAME_CLOCK else offset - reference for _, offset in found]
    shifted = [Series(series.time + shift, series.values) for (series, _), shift in zip(found, shifts, strict=True)]
    zero = min(series.time[0] for series in shifted)
    return [Series(series.time - zero, series.values) for series in shifted]


def _table(c: Columns, *names: str) -> Array:
    return np.stack([np.asarray(c[name], np.float64) for name in names], axis=1)


def _imu(c: Columns, names: Sequence[str], turning: float, force: float) -> Array:
    return np.asarray(_table(c, *names) * np.concatenate([turning * FLIP_SIGNS, force * FLIP_SIGNS]))


def _attitude(q: Array) -> Array:
    """FRD to NED as FLU to NWU, of norm one; what is no attitude becomes NaN."""
    norm = np.linalg.norm(q, axis=1)
    norm[np.abs(norm - 1.0) > 0.1] = np.nan
    return np.asarray(q / norm[:, None] * np.array([1.0, 1.0, -1.0, -1.0]))


def _of_angles(angles: Array) -> Array:
    return np.array([quaternion_from_euler(*row) for row in angles.tolist()])


def _local(c: Columns) -> Array:
    return np.asarray(_table(c, "x", "y", "z", "vx", "vy", "vz") * np.concatenate([FLIP_SIGNS, FLIP_SIGNS]))


def _global(c: Columns) -> Array:
    points = _table(c, "lat", "lon", "alt") * np.array([1e-7, 1e-7, 1e-3])
    frame = LocalFrame(Geodetic(*points[0].tolist()))
    positions = np.array([frame.to_ned(Geodetic(*row)) for row in points.tolist()])
    return np.hstack([positions * FLIP_SIGNS, 0.01 * _table(c, "vx", "vy", "vz") * FLIP_SIGNS])


def _outputs(values: Array, channels: LogConventions) -> Array:
    """Commands of outputs that go from 0 to 1 for motors and from -1 to 1 for elevons."""
    numbers = np.array(channels.numbers or STANDARD_CHANNELS)
    a = channels.airframe
    chosen = values[:, np.abs(numbers) - 1] * np.sign(numbers)
    return np.asarray(chosen * np.array([a.omega_max, a.omega_max, a.delta_max, a.delta_max]))


def _servos(c: Columns, channels: LogConventions) -> Array:
    """The same of pulse widths [us]; outputs without pulses stand still."""
    widths = _table(c, *(f"servo{number}_raw" for number in range(1, 17)))
    share = np.clip((widths - PWM_LOW) / (PWM_HIGH - PWM_LOW), 0.0, 1.0)
    numbers = np.abs(np.array(channels.numbers))
    share[:, numbers[2:] - 1] = 2.0 * share[:, numbers[2:] - 1] - 1.0
    return _outputs(share, channels)
