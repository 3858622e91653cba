"""Injected failures: instruments, actuators, battery and link of one vehicle, as MAV_CMD_INJECT_FAILURE names them.

The vehicle is told nothing but what its motors' controllers report; what else it notices, it notices by itself. https://mavlink.io/en/messages/common.html#FAILURE_UNIT
"""

from __future__ import annotations

from typing import NamedTuple

from protocol.dialect import mavlink
from sitl.autopilot.answers import ACCEPTED, DENIED, UNSUPPORTED, Answer
from sitl.model.battery import Battery
from sitl.sensors.instruments import (
    ACCELEROMETER,
    BAROMETER,
    DELAYED,
    DRIFTING,
    GARBAGE,
    GNSS,
    GYROSCOPE,
    HEALTHY,
    INTERMITTENT,
    MAGNETOMETER,
    MOTION_CAPTURE,
    OFF,
    PITOT,
    SCALED,
    STUCK,
    WRONG,
)
from sitl.simulation.actuator_faults import ACTUATOR_FAILURES, ActuatorFaults
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation

LEFT_AFTER_SAG = 0.05  # share of the battery that is left when it fails
LOST_CELL = 3.0  # voltage that goes with it [V]
MISREAD = 0.2  # share that a wrong reading is off
FLICKER_TIME = 1.0  # an intermittent link works and fails in turns of so long [s]
GARBAGE_SEED = 1  # of actuators at random
FAILURE_TYPES = frozenset(range(INTERMITTENT + 1))  # that MAVLink has a number for
WAYS_TO_BE_WRONG = (WRONG, SCALED, DRIFTING)  # by SIM_FAIL_WRONG
INERTIAL_FAILURES = frozenset({HEALTHY, OFF, STUCK, GARBAGE, DELAYED, *WAYS_TO_BE_WRONG})
READING_FAILURES = FAILURE_TYPES | frozenset(WAYS_TO_BE_WRONG)
FAILURE_NAMES = ("healthy", "off", "stuck", "garbage", "wrong", "slow", "delayed", "intermittent", "scaled", "drifting")
ON_SATELLITES, ON_CAPTURE = frozenset({Navigation.SENSORS}), frozenset({Navigation.MOCAP})
EVERYWHERE = ON_SATELLITES | ON_CAPTURE


class _Instrument(NamedTuple):
    """A unit that reads something."""

    name: str
    number: int  # GYROSCOPE ... MOTION_CAPTURE
    failures: frozenset[int]
    navigation: frozenset[Navigation]  # that reads it


class _Actuator(NamedTuple):
    """A unit that moves something; there are two of each."""

    name: str
    fields: tuple[str, str]  # of ActuatorFaults, by instance


INSTRUMENT_UNITS = {
    mavlink.FAILURE_UNIT_SENSOR_GYRO: _Instrument("gyroscope", GYROSCOPE, INERTIAL_FAILURES, EVERYWHERE),
    mavlink.FAILURE_UNIT_SENSOR_ACCEL: _Instrument("accelerometer", ACCELEROMETER, INERTIAL_FAILURES, EVERYWHERE),
    mavlink.FAILURE_UNIT_SENSOR_MAG: _Instrument("magnetometer", MAGNETOMETER, READING_FAILURES, ON_SATELLITES),
    mavlink.FAILURE_UNIT_SENSOR_BARO: _Instrument("barometer", BAROMETER, READING_FAILURES, ON_SATELLITES),
    mavlink.FAILURE_UNIT_SENSOR_GPS: _Instrument("GNSS", GNSS, READING_FAILURES, ON_SATELLITES),
    mavlink.FAILURE_UNIT_SENSOR_VIO: _Instrument("motion capture", MOTION_CAPTURE, READING_FAILURES, ON_CAPTURE),
    mavlink.FAILURE_UNIT_SENSOR_AIRSPEED: _Instrument("pitot tube", PITOT, READING_FAILURES, EVERYWHERE),
}
ACTUATOR_UNITS = {
    mavlink.FAILURE_UNIT_SYSTEM_MOTOR: _Actuator("motor", ("left_motor", "right_motor")),
    mavlink.FAILURE_UNIT_SYSTEM_SERVO: _Actuator("elevon", ("left_elevon", "right_elevon")),
}
BATTERY_UNIT, LINK_UNIT = mavlink.FAILURE_UNIT_SYSTEM_BATTERY, mavlink.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL
BATTERY_FAILURES, LINK_FAILURES = frozenset({HEALTHY, OFF, WRONG}), frozenset({HEALTHY, OFF, INTERMITTENT})
MISSING_UNITS = {
    mavlink.FAILURE_UNIT_SENSOR_OPTICAL_FLOW: "optical flow",
    mavlink.FAILURE_UNIT_SENSOR_DISTANCE_SENSOR: "distance sensor",
    mavlink.FAILURE_UNIT_SYSTEM_AVOIDANCE: "avoidance",
    mavlink.FAILURE_UNIT_SYSTEM_RC_SIGNAL: "radio control",
}
ALL = 0  # of the instances


class InjectedFailures:
    """Failures that somebody injects into one vehicle.

    Args:
        vehicle: The vehicle.

    Attributes:
        wrong: How an instrument reads wrong, one of WAYS_TO_BE_WRONG.
        size: How wrong it then reads, in multiples of the usual.
    """

    def __init__(self, vehicle: Simulation) -> None:
        self._vehicle = vehicle
        self._battery = self.link = HEALTHY
        self.wrong, self.size = WRONG, 1.0

    def inject(self, unit: int, failure: int, instance: int = ALL) -> Answer:
        """Have a unit fail, or heal it.

        Args:
            unit: FAILURE_UNIT.
            failure: FAILURE_TYPE, or SCALED or DRIFTING; 0 heals.
            instance: 1 or 2 of motors and elevons, left and right; ALL.
        """
        if failure not in READING_FAILURES:
            return Answer(DENIED, f"Failure denied: {failure} is not a FAILURE_TYPE")
        if unit in INSTRUMENT_UNITS:
            return self._fail_instrument(INSTRUMENT_UNITS[unit], failure, instance)
        if unit in ACTUATOR_UNITS:
            return self._fail_actuator(ACTUATOR_UNITS[unit], failure, instance)
        if unit == BATTERY_UNIT:
            refused = _refuse("battery", failure, BATTERY_FAILURES, instance, 1)
            self._battery = self._battery if refused else failure
            return refused or _done("battery", failure)
        if unit == LINK_UNIT:
            refused = _refuse("link", failure, LINK_FAILURES, instance, 1)
            self.link = self.link if refused else failure
            return refused or _done("link", failure)
        if unit in MISSING_UNITS:
            return Answer(UNSUPPORTED, f"Failure not supported: this vehicle has no {MISSING_UNITS[unit]}")
        return Answer(DENIED, f"Failure denied: {unit} is not a FAILURE_UNIT")

    def _fail_instrument(self, unit: _Instrument, failure: int, instance: int) -> Answer:
        avionics = self._vehicle.avionics
        if avionics.navigation not in unit.navigation:
            why = f"navigation by {avionics.navigation.value} does not read the {unit.name}"
            return Answer(UNSUPPORTED, f"Failure not supported: {why}")
        if refused := _refuse(unit.name, failure, unit.failures, instance, 1):
            return refused
        failure = self.wrong if failure == WRONG else failure
        i, number = avionics.instruments, unit.number
        i.failures[number], i.sizes[number] = failure, self.size
        i.failed_at[number] = self._vehicle.periods
        return _done(unit.name, failure)

    def _fail_actuator(self, unit: _Actuator, failure: int, instance: int) -> Answer:
        if refused := _refuse(unit.name, failure, ACTUATOR_FAILURES, instance, len(unit.fields)):
            return refused
        fields = unit.fields if instance == ALL else unit.fields[instance - 1 : instance]
        faults: ActuatorFaults = self._vehicle.faults
        self._vehicle.faults = faults._replace(seed=GARBAGE_SEED, **dict.fromkeys(fields, failure))
        return _done(f"{unit.name}s" if instance == ALL else f"{unit.name} {instance}", failure)

    @property
    def failed_motors(self) -> tuple[int, ...]:
        """Motors whose controllers report a failure: 1 left, 2 right."""
        fields = ACTUATOR_UNITS[mavlink.FAILURE_UNIT_SYSTEM_MOTOR].fields
        return tuple(k for k, name in enumerate(fields, 1) if getattr(self._vehicle.faults, name) != HEALTHY)

    def read(self, battery: Battery) -> Battery:
        """The battery as it is read, and where it fails, as it is."""
        if self._battery == OFF:
            used = max(battery.used, (1.0 - LEFT_AFTER_SAG) * battery.capacity)
            return battery._replace(used=used, lost=LOST_CELL)
        if self._battery == WRONG:
            return battery._replace(used=min(battery.used + MISREAD * battery.capacity, battery.capacity))
        return battery


def _refuse(name: str, failure: int, known: frozenset[int], instance: int, instances: int) -> Answer | None:
    if not ALL <= instance <= instances:
        return Answer(DENIED, f"Failure denied: there is no {name} {instance}")
    if failure not in known:
        return Answer(UNSUPPORTED, f"Failure not supported: {name} {FAILURE_NAMES[failure]}")
    return None


def _done(name: str, failure: int) -> Answer:
    return Answer(
        ACCEPTED, f"Healed: {name}" if failure == HEALTHY else f"Failure injected: {name} {FAILURE_NAMES[failure]}"
    )
