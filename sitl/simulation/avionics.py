"""Navigation of a flight: the truth, its sensors outdoors, or motion capture; and its records for the loop."""

from __future__ import annotations

import enum
import math
from functools import cache
from typing import Any

import numpy as np

from sitl.control.wind_estimator import WindGains
from sitl.design.gains import wind_gains
from sitl.estimation.filter import (
    ALIGNING,
    MAX_HORIZON,
    REALIGNING,
    RUNNING,
    Filter,
    Step,
    filter_settings,
    new_filter,
)
from sitl.estimation.kalman import reset_block
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    ATTITUDE_ERROR,
    ERRORS,
    GYRO_BIAS_ERROR,
    POSITION_ERROR,
    VELOCITY_ERROR,
    at_origin,
)
from sitl.estimation.notch import quiet
from sitl.estimation.strapdown import moved_by, no_increment
from sitl.model.airframe import Airframe, Array
from sitl.model.battery import Battery
from sitl.model.ground import GroundPlane, is_touching
from sitl.model.quaternions import Quaternion, multiply, normalised, rotate_inverse, small_rotation
from sitl.model.state import Plant
from sitl.model.vectors import Vector, add, scaled, subtract
from sitl.sensors.battery_monitor import BatteryReading, monitored
from sitl.sensors.draws import PERIOD, SLOW_PERIODS, in_fine_steps
from sitl.sensors.hidden_errors import ERROR_DRAWS, MOUNTING_DRAWS, drawn_errors
from sitl.sensors.instruments import (
    AIDS,
    DROPOUT,
    EXTERNAL_POSE,
    FAST_COLUMNS,
    FIRST_DELAYED,
    HEALTHY,
    MOTION_CAPTURE,
    OFF,
    POSE_DROPOUT,
    SLOW_COLUMNS,
    Instruments,
    SensorSet,
    instruments,
    send,
    speed_before_tube,
)
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.noise import BLOCK
from sitl.simulation.sensed import Aboard
from sitl.storage import copy_of, record_of, record_type

# Of the belief after an impact, which the accelerometers cannot follow [m], [m/s], [rad], [rad/s], [m/s2].
IMPACT_DEVIATIONS = {
    POSITION_ERROR: 5.0,
    VELOCITY_ERROR: 15.0,
    ATTITUDE_ERROR: 0.3,
    GYRO_BIAS_ERROR: 0.2,
    ACCEL_BIAS_ERROR: 2.0,
}
NO_FAST, NO_SLOW = np.zeros((0, FAST_COLUMNS)), np.zeros((0, SLOW_COLUMNS))


class Navigation(enum.Enum):
    """Source of the estimate."""

    TRUTH = "truth"
    SENSORS = "sensors"
    MOCAP = "mocap"


class Avionics:
    """Instruments, filter and random draws of one vehicle.

    Args:
        navigation: What fills the estimate.
        sensors: Specifications of the instruments.
        model: The airframe as the vehicle knows it.
        seed: Of the instruments' errors and noise; one seed is one flight, to the bit.

    ``has_cameras`` tells whether the arena's cameras, which are simulated, give poses; ``filter`` and ``instruments``
    are views of ``records``, whose fields can be assigned.
    """

    def __init__(self, navigation: Navigation, sensors: SensorSet, model: Airframe, seed: int) -> None:
        self.navigation = navigation
        self.sensors = sensors
        self.fast, self.slow = NO_FAST, NO_SLOW
        self._block = -1
        self.has_cameras = True
        self._seed, self._converged = seed, 0
        self._random = np.random.default_rng((seed, 2))
        mounting = in_fine_steps(np.random.default_rng((seed, 6)).standard_normal(MOUNTING_DRAWS))
        errors = drawn_errors(sensors, in_fine_steps(self._random.standard_normal(ERROR_DRAWS)), mounting)
        settings = filter_settings(sensors, wind_gains(), arena=navigation is Navigation.MOCAP)
        self.records = record_of(Aboard, Aboard(instruments(sensors, errors), new_filter(settings, model)))
        self.filter: Filter = self.records[0]["filter"]
        self.instruments: Instruments = self.records[0]["instruments"]
        self.steps = np.zeros(MAX_HORIZON, record_type(Step))

    @property
    def is_sensed(self) -> bool:
        """Whether the estimate comes from sensors."""
        return self.navigation is not Navigation.TRUTH

    @property
    def latency(self) -> float:
        """From inertial reading to servo, beyond the control period, in the mean [s]."""
        return self.sensors.pipeline.mean_delay if self.is_sensed else 0.0

    @property
    def horizon_periods(self) -> int:
        """Delay of the filter's horizon [control periods]."""
        return int(self.filter.filled) * SLOW_PERIODS

    def has_failed(self, instrument: int) -> bool:
        """Whether the vehicle has found out that its gyroscope or accelerometer fails."""
        return self.is_sensed and bool(self.filter.failed[instrument] > 0.0)

    @property
    def resets(self) -> int:
        """Number of times that the filter has diverged and was reset."""
        return int(self.filter.resets) if self.is_sensed else 0

    def battery_reading(self, battery: Battery, power: float, period: int) -> BatteryReading:
        """Reading of the battery monitor at a power [W]; exact where the vehicle sees the truth."""
        voltage, current = battery.voltage(power), battery.current(power)
        if not self.is_sensed:
            return BatteryReading(voltage, current)
        return monitored(voltage, current, self.sensors.battery, period, self._seed)

    def deviation(self, first: int) -> Vector:
        """Standard deviations of three errors, the first of which is numbered so."""
        variances = np.diagonal(self.filter.covariance)[first : first + 3]
        return Vector(*(math.sqrt(max(float(x), 0.0)) for x in variances))

    def switch_motion_capture(self, *, on: bool) -> None:
        """Whether the arena's cameras, which are simulated, give poses; a failure that they have is kept."""
        if self.is_sensed and on != self.has_cameras:
            self.instruments.failures[MOTION_CAPTURE] = HEALTHY if on else OFF
            self.has_cameras = on

    def receive_pose(
        self, position: Vector, attitude: Quaternion, place: float, turn: float, *, age: int, period: int
    ) -> str:
        """Take a pose that somebody else measured; gives why it is of no use, or nothing.

        Args:
            position: World NWU [m].
            attitude: Body FLU to world NWU.
            place: Variance of each axis of the position [m2].
            turn: Variance of the attitude about each axis [rad2].
            age: Control periods since it was measured.
            period: Control periods flown.
        """
        i, line = self.instruments, EXTERNAL_POSE - FIRST_DELAYED
        back = int(self.filter.settings.horizon) * SLOW_PERIODS
        if age > back:
            return f"{1e3 * age * PERIOD:.0f} ms late, the filter looks back {1e3 * back * PERIOD:.0f} ms"
        sampled = period - age
        if sampled < i.sampled[line].max():
            return "older than the one before"
        if i.failures[EXTERNAL_POSE] != OFF:
            i.last[line] = (*position, *attitude, place, turn, 1.0)
            send(line, i, sampled, period)
        return ""

    def draw(self, period: int) -> None:
        """Make the draws for the block of periods that this one is in."""
        while self.is_sensed and self._block < period // BLOCK:
            self._block += 1
            self.fast = in_fine_steps(self._random.standard_normal((BLOCK, FAST_COLUMNS)))
            self.fast[:, POSE_DROPOUT] = self._random.random(BLOCK)
            self.slow = in_fine_steps(self._random.standard_normal((BLOCK // SLOW_PERIODS, SLOW_COLUMNS)))
            self.slow[:, DROPOUT : DROPOUT + AIDS] = self._random.random((BLOCK // SLOW_PERIODS, AIDS))

    def redesign(self, model: Airframe, wind: WindGains) -> None:
        """Take another model or tuning, in flight or not."""
        if not self.is_sensed:
            return
        f: Any = self.filter
        f["model"] = model
        f["settings"]["wind"] = wind

    def restart(self, *, carries_on: bool = True) -> None:
        """Restart the filter, as after a fault of its computer: it is aligned anew.

        Args:
            carries_on: Whether the inertial readings carry the last estimate on meanwhile; else it is forgotten.
        """
        if not self.is_sensed:
            return
        f: Any = self.filter
        fresh = copy_of(f.nominal)
        ahead = copy_of(f.ahead)
        if not carries_on:
            fresh, ahead = at_origin(), no_increment()
        place, velocity, q = moved_by(ahead, fresh.position, fresh.velocity, fresh.attitude, float(f["model"]["g"]))
        f["nominal"] = fresh._replace(position=place, velocity=velocity, attitude=q)
        f["ahead"], f["step"]["increment"] = no_increment(), no_increment()
        f["mean_rates"] = f["mean_force"] = _NONE
        f["filled"] = f["aligned_periods"] = f["moved"] = 0
        f["repeated"] = f["fault_count"] = f["failed"] = 0.0
        f["doubted_until"] = -1.0
        f["phase"] = REALIGNING if carries_on and f["phase"] != ALIGNING else ALIGNING

    def doubt_motion(self) -> None:
        """Doubt all that an impact makes wrong, so that the next readings are believed instead of refused."""
        if not self.is_sensed:
            return
        f: Any = self.filter
        for first, deviation in IMPACT_DEVIATIONS.items():
            reset_block(f["covariance"], first, deviation * deviation)
        f["leapt"] = 0.0
        f["refused_since"] = -1.0

    def converge(self, plant: Plant, period: int, wind: Vector, ground: GroundPlane, airframe: Airframe) -> None:
        """Begin with a converged filter that has just taken its origin.

        Its errors are drawn from its own covariance; its wind estimate is zero.

        Args:
            plant: The vehicle as it is.
            period: Control periods flown.
            wind: There, which the pitot has felt for long, world NWU [m/s].
            ground: Where the ground is.
            airframe: Of the vehicle itself.
        """
        if not self.is_sensed:
            return
        f: Any = self.filter
        i: Any = self.instruments
        body = plant.body
        self._settle_tube(plant, wind, airframe)
        i["errors"]["gnss_drift"], i["errors"]["barometer_drift"] = _NONE, 0.0
        errors = copy_of(i.errors)
        initial = np.array(f["settings"]["initial"])
        self._converged += 1
        draws = np.random.default_rng((self._seed, 3, self._converged)).standard_normal(ERRORS)
        wrong = np.sqrt(np.diag(initial)) * in_fine_steps(draws)
        turn = small_rotation(scaled(_vector(wrong, ATTITUDE_ERROR), -1.0))
        f["nominal"] = at_origin()._replace(
            position=subtract(body.position, _vector(wrong, POSITION_ERROR)),
            velocity=subtract(body.velocity, _vector(wrong, VELOCITY_ERROR)),
            attitude=normalised(multiply(body.attitude, turn)),
            gyro_bias=subtract(add(errors.gyro_bias, errors.gyro_drift), _vector(wrong, GYRO_BIAS_ERROR)),
        )
        f["covariance"], f["air_doubt"] = initial, 0.0
        f["actuators"] = plant.actuators
        f["on_ground"] = stands = is_touching(plant, ground, copy_of(f.model))
        f["support"] = f["support_of_late"] = f["model"]["g"] if stands else 0.0
        f["ahead"], f["step"] = (
            no_increment(),
            Step(
                increment=no_increment(),
                gyro_bias=_NONE,
                accel_bias=_NONE,
                force=_NONE,
                rates=_NONE,
                actuators=plant.actuators,
            ),
        )
        f["filled"], f["phase"] = 0, RUNNING
        f["refused_since"], f["fused_at"] = -1.0, float(period)
        f["refused_at"], f["doubted_until"], f["before"] = -1e9, -1.0, 0.0
        f["repeated"] = f["fault_count"] = f["failed"] = 0.0
        f["speed_notch"], f["velocity"] = quiet(body.velocity), body.velocity
        f["notch"], f["rates"], f["acceleration"] = quiet(body.rates), body.rates, _NONE
        i["waiting"], i["pending"], i["held"] = 0.0, np.array(plant.actuators), np.array(plant.actuators)

    def _settle_tube(self, plant: Plant, wind: Vector, airframe: Airframe) -> None:
        """Let the pitot have felt its airspeed for long: what it lags behind would be taken for a wind."""
        pitot, model = self.sensors.pitot, copy_of(self.filter.model)
        q, velocity = plant.body.attitude, plant.body.velocity
        through, over_ground = rotate_inverse(q, subtract(velocity, wind)).x, rotate_inverse(q, velocity).x
        f: Any = self.filter
        i: Any = self.instruments
        i["errors"]["tube_speed"] = speed_before_tube(through, plant.actuators, airframe, pitot)
        f["nominal"]["tube_speed"] = speed_before_tube(over_ground, plant.actuators, model, pitot)


_NONE = Vector(0.0, 0.0, 0.0)


def _vector(numbers: Array, first: int) -> Vector:
    return Vector(*(float(x) for x in numbers[first : first + 3]))


@cache
def _unread(model: Airframe) -> Avionics:
    """Avionics of a vehicle that sees the truth: instruments that nobody reads; shared, and never written."""
    return Avionics(Navigation.TRUTH, load_sensors(), model, 0)


def equipped(navigation: Navigation, sensors: SensorSet, model: Airframe, seed: int) -> Avionics:
    """The avionics of a vehicle; see :class:`Avionics`."""
    return _unread(model) if navigation is Navigation.TRUTH else Avionics(navigation, sensors, model, seed)
