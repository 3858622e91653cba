"""One vehicle's flight out of a log of another kind, as the messages that it would have sent.

All quantities are SI, attitudes FRD to NED, places and velocities NED, times since the vehicle was switched on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.foreign_logs.message_tables import MessageRows

Floats = NDArray[np.float64]

MAX_SILENCE = 3600.0  # in a log; what is farther off in time was damaged [s]
LAST_TIME = float(0xFFFFFFFF // 1000)  # that a time since boot in milliseconds tells [s]
IMU_FIELDS = 0b111111  # of HIGHRES_IMU: accelerations and rates
TEXT_SIZE = 50  # of STATUSTEXT [characters]
NOT_KNOWN = -1  # current, charge
OUTPUTS_TOLD = 32  # of ACTUATOR_OUTPUT_STATUS
SERVOS_TOLD = 16  # of SERVO_OUTPUT_RAW


class VehicleKind(NamedTuple):
    """A vehicle as HEARTBEAT names it: MAV_AUTOPILOT and MAV_TYPE."""

    autopilot: int
    type: int


class VehicleMessages:
    """Collects what a log tells of one vehicle.

    Args:
        system: System id, 1 to 255.
        kind: Of the vehicle.
    """

    def __init__(self, system: int, kind: VehicleKind) -> None:
        self._system, self.kind = system, kind
        self._tables: list[MessageRows] = []
        self._gyro: tuple[Floats, Floats] | None = None
        self._motion: tuple[Floats, Floats, Floats] | None = None
        self._attitudes: tuple[Floats, Floats] | None = None
        self._airspeed: tuple[Floats, Floats] | None = None
        self._state: tuple[Floats, NDArray[np.int64], NDArray[np.bool_]] | None = None

    def imu(self, times: Floats, rates: Floats, force: Floats) -> None:
        """Body rates [rad/s] and specific force [m/s2], body FRD, (n, 3) each."""
        self._gyro = times, rates
        names = [f"{axis}{what}" for what in ("gyro", "acc") for axis in "xyz"]
        columns = dict(zip(names, np.hstack([rates, force]).T, strict=True))
        updated = np.full(len(times), IMU_FIELDS)
        self._add("HIGHRES_IMU", times, time_usec=times * 1e6, fields_updated=updated, **columns)

    def attitude(self, times: Floats, quaternions: Floats) -> None:
        """Attitudes (n, 4), of any norm."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            self._attitudes = times, quaternions / np.linalg.norm(quaternions, axis=1)[:, np.newaxis]

    def motion(self, times: Floats, positions: Floats, velocities: Floats) -> None:
        """Positions [m] and velocities [m/s], NED, (n, 3) each."""
        self._motion = times, positions, velocities
        names = ("x", "y", "z", "vx", "vy", "vz")
        columns = dict(zip(names, np.hstack([positions, velocities]).T, strict=True))
        self._add("LOCAL_POSITION_NED", times, time_boot_ms=times * 1e3, **columns)

    def place(self, times: Floats, places: Floats, height: Floats, velocities: Floats | None = None) -> None:
        """Latitude, longitude [deg] and altitude [m] (n, 3), height above home [m] (n,), velocities NED (n, 3)."""
        lat, lon, alt = places.T
        columns = {"lat": lat * 1e7, "lon": lon * 1e7, "alt": alt * 1e3, "relative_alt": height * 1e3}
        if velocities is not None:
            columns |= dict(zip(("vx", "vy", "vz"), velocities.T * 100.0, strict=True))
        heading = np.full(len(times), 0xFFFF)  # not known
        self._add("GLOBAL_POSITION_INT", times, time_boot_ms=times * 1e3, hdg=heading, **columns)

    def outputs(self, times: Floats, values: Floats) -> None:
        """Outputs of actuators, 0 to 1 for motors and -1 to 1 for surfaces, (n, k)."""
        told = np.zeros((len(times), OUTPUTS_TOLD))
        used = min(values.shape[1], OUTPUTS_TOLD)
        told[:, :used] = np.nan_to_num(values[:, :used])
        active = np.full(len(times), (1 << used) - 1)
        self._add("ACTUATOR_OUTPUT_STATUS", times, time_usec=times * 1e6, active=active, actuator=told)

    def pulses(self, times: Floats, widths: Floats) -> None:
        """Widths of servo pulses [us], (n, k)."""
        used = min(widths.shape[1], SERVOS_TOLD)
        columns = {f"servo{number + 1}_raw": widths[:, number] for number in range(used)}
        self._add("SERVO_OUTPUT_RAW", times, time_usec=np.mod(times * 1e6, 2.0**32), **columns)

    def battery(
        self, times: Floats, voltage: Floats, current: Floats | None = None, charge: Floats | None = None
    ) -> None:
        """Voltage [V], current [A] and the share of the charge that is left [-], (n,) each; negative: not known."""
        told = {"current_battery": current, "battery_remaining": charge}
        columns = {
            name: np.full(len(times), NOT_KNOWN) if values is None else _hundredths(values)
            for name, values in told.items()
        }
        self._add("SYS_STATUS", times, voltage_battery=voltage * 1e3, **columns)

    def airspeed(self, times: Floats, speed: Floats) -> None:
        """Airspeed [m/s], (n,)."""
        self._airspeed = (times, speed) if len(times) else None

    def state(self, times: Floats, modes: NDArray[np.int64], armed: NDArray[np.bool_]) -> None:
        """Changes of HEARTBEAT's custom mode and of arming, (n,) each, by time; each holds until the next."""
        changed = np.ones(len(times), np.bool_)
        changed[1:] = (np.diff(modes) != 0) | (armed[1:] != armed[:-1])
        self._state = times[changed], modes[changed], armed[changed]

    def vtol(self, times: Floats, states: NDArray[Any]) -> None:
        """MAV_VTOL_STATE, (n,)."""
        self._add("EXTENDED_SYS_STATE", times, vtol_state=states)

    def texts(self, times: Floats, severities: Sequence[int], texts: Sequence[str]) -> None:
        """Texts with their MAV_SEVERITY; the wire has their first 50 characters."""
        kept = np.array([text.encode("ascii", "replace")[:TEXT_SIZE] for text in texts], dtype=f"S{TEXT_SIZE}")
        self._add("STATUSTEXT", times, severity=np.array(severities, np.int64), text=kept)

    def tables(self) -> list[MessageRows]:
        """All messages, with a HEARTBEAT in each second that has any; empty if there are none."""
        tables = [*self._tables, *self._attitude_tables(), *self._speed_tables()]
        times = np.concatenate([table.times for table in tables]) if tables else np.zeros(0)
        return [*tables, self._heartbeats(times)] if len(times) else []

    def _add(self, name: str, times: Floats, **fields: NDArray[Any]) -> None:
        if len(times):
            self._tables.append(MessageRows(name, self._system, times, fields))

    def _attitude_tables(self) -> Iterator[MessageRows]:
        if self._attitudes is None:
            return
        times, q = self._attitudes
        rates = np.full((len(times), 3), np.nan) if self._gyro is None else _at(times, *self._gyro)
        shared = dict(zip(("rollspeed", "pitchspeed", "yawspeed"), rates.T, strict=True))
        shared["time_boot_ms"] = times * 1e3
        quaternions = dict(zip(("q1", "q2", "q3", "q4"), q.T, strict=True))
        yield MessageRows("ATTITUDE_QUATERNION", self._system, times, {**shared, **quaternions})
        angles = dict(zip(("roll", "pitch", "yaw"), angles_of(q).T, strict=True))
        yield MessageRows("ATTITUDE", self._system, times, {**shared, **angles})

    def _speed_tables(self) -> Iterator[MessageRows]:
        if self._airspeed is None:
            return
        times, speed = self._airspeed
        fields = {"airspeed": speed}
        if self._motion is not None:
            velocity = _at(times, self._motion[0], self._motion[2])
            fields |= {"groundspeed": np.hypot(velocity[:, 0], velocity[:, 1]), "climb": -velocity[:, 2]}
            fields["alt"] = -_at(times, self._motion[0], self._motion[1])[:, 2]
        yield MessageRows("VFR_HUD", self._system, times, fields)

    def _heartbeats(self, times: Floats) -> MessageRows:
        beats = np.unique(np.floor(times))  # in seconds that have messages: a silence stays one
        beats[0] = times.min()
        modes, armed = np.zeros(len(beats), np.int64), np.zeros(len(beats), np.bool_)
        if self._state is not None and len(self._state[0]):
            changes, told, motors = self._state
            beats = np.unique(np.concatenate([beats, changes]))
            at = np.searchsorted(changes, beats, side="right") - 1
            modes = np.where(at >= 0, told[np.maximum(at, 0)], 0)
            armed = np.where(at >= 0, motors[np.maximum(at, 0)], False)
        base = np.where(armed, int(mavlink.MAV_MODE_FLAG_SAFETY_ARMED), 0) | int(
            mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        )
        state = np.where(armed, int(mavlink.MAV_STATE_ACTIVE), int(mavlink.MAV_STATE_STANDBY))
        return MessageRows(
            "HEARTBEAT",
            self._system,
            beats,
            {
                "type": np.full(len(beats), self.kind.type),
                "autopilot": np.full(len(beats), self.kind.autopilot),
                "base_mode": base,
                "custom_mode": modes,
                "system_status": state,
                "mavlink_version": np.full(len(beats), 3),
            },
        )


@np.errstate(invalid="ignore", over="ignore")
def _hundredths(values: Floats) -> Floats:
    return np.where(values >= 0.0, 100.0 * values, NOT_KNOWN)


def _at(times: Floats, known: Floats, values: Floats) -> Floats:
    """Values (n, k) at other times, joined by straight lines."""
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)


@np.errstate(invalid="ignore")
def angles_of(q: Floats) -> Floats:
    """Roll, pitch, yaw [rad] (ZYX) of attitudes (n, 4), shape (n, 3)."""
    w, x, y, z = q.T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=1)


def quaternions_of(angles: Floats) -> Floats:
    """Attitudes (n, 4) of roll, pitch, yaw [rad] (ZYX), shape (n, 3)."""
    with np.errstate(invalid="ignore"):
        (cr, cp, cy), (sr, sp, sy) = np.cos(0.5 * angles.T), np.sin(0.5 * angles.T)
    parts = [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
    return np.stack(parts, axis=1)


def within_flight(times: Sequence[Floats]) -> tuple[float, float]:
    """The span of time [s] of a flight: the greatest run of samples without a silence that no flight has.

    A damaged time stamp would else make the log years long.
    """
    joined = np.concatenate(times) if times else np.zeros(0)
    joined = np.sort(joined[(joined >= 0.0) & (joined <= LAST_TIME)])
    if not len(joined):
        return 0.0, 0.0
    cuts = [0, *(np.flatnonzero(np.diff(joined) > MAX_SILENCE) + 1).tolist(), len(joined)]
    begin, end = max(pairwise(cuts), key=lambda run: run[1] - run[0])
    return float(joined[begin]), float(joined[end - 1])
