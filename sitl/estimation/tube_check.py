"""Whether the pitot is believed: its airspeed against that which the force along the nose tells.

Propellers pull the less, the faster the air meets them, and drag grows: what the accelerometer feels along the nose is
an airspeed that needs no tube, where the wing carries the vehicle. A tube that differs from it for long has failed, and
so has one that begins to differ otherwise than it did, for what the model lacks stays. It is believed again once it has
agreed with that airspeed, and with the wind as it is then believed, for a while. Meanwhile that airspeed stands in for
the tube's.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.estimation.air import feel_for_long
from sitl.estimation.filter import (
    SLOW_STEP,
    Filter,
    Step,
    put_tube_agreed,
    put_tube_changed,
    put_tube_compared,
    put_tube_error,
    put_tube_missed,
    put_tube_silent,
    put_tube_usual,
)
from sitl.estimation.fusion import correct_nominal, fuse, put_vector
from sitl.estimation.kalman import reset_block
from sitl.estimation.nominal_state import ATTITUDE_ERROR, STEADY_WIND_ERROR, VELOCITY_ERROR, WIND_ERROR, NominalState
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped
from sitl.model.quaternions import rotate, rotate_inverse
from sitl.model.vectors import Vector, cross, scaled, subtract
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import FIRST_DELAYED, PITOT, Instruments
from sitl.storage import value_of

COMPARED_FROM, COMPARED_BELOW = 9.0, 0.7  # airspeed [m/s], and upward part of the nose, where they are compared
COMPARED_TIME = 1.0  # that the difference is smoothed over [s]
DIFFERS, AGREES = 3.0, 2.0  # of the smoothed difference [m/s]
USUAL_FROM, USUAL_TIME = 2.0, 20.0  # compared for so long, and in what time that changes, the difference is usual [s]
CHANGED, CHANGED_TIME = 1.5, 2.0  # it may be no farther from what is usual for so long [m/s], [s]
LACK = 0.3  # deviation of the model's force along the nose, over mass [m/s2]
DEVIATIONS = 3.0  # of the deviations of the model's airspeed that a difference has to be beyond
MAX_DIFFERENCE, SLOPE_STEP, MIN_SLOPE = 10.0, 0.5, 0.02  # [m/s], [m/s], [1/s]
MISSED_TIME = 5.0  # without a reading that could be fused where one is expected, the tube has failed [s]
HELPED_LATELY = 1.0  # a tube of which a reading was fused so lately is not missed [s]
READMITTED_TIME = 10.0  # of agreement after which a tube is believed again [s]
LACK_TIME = 5.0  # what the model lacks lasts so long: as noise of a reading it counts for as much longer [s]
STOOD_IN = 1.0  # deviation of the airspeed that stands in, beside the model's [m/s]
LOST_WIND = 2.0  # deviation of the wind that a failed tube has led astray [m/s]


class Told(NamedTuple):
    """An airspeed along the nose that is told by the force along it."""

    speed: float  # [m/s]
    deviation: float  # [m/s]


@subroutine
def told_by_force(b: NominalState, step: Step, a: Airframe) -> Told:
    """The airspeed along the nose at which the model makes the force that is felt along it."""
    v_b = rotate_inverse(b.attitude, subtract(b.velocity, b.wind))
    rates = subtract(step.rates, b.gyro_bias)
    here, _ = wrench(v_b, rates, step.actuators, a)
    faster, _ = wrench(Vector(v_b.x + SLOPE_STEP, v_b.y, v_b.z), rates, step.actuators, a)
    slope = min((faster.x - here.x) / (SLOPE_STEP * a.m), -MIN_SLOPE)
    lacking = step.force.x - b.accel_bias.x - here.x / a.m
    return Told(v_b.x + clipped(lacking / slope, -MAX_DIFFERENCE, MAX_DIFFERENCE), -LACK / slope)


@kernel
def _can_be_compared(f: Filter, speed: float) -> bool:
    b = value_of(f.nominal)
    along = rotate_inverse(b.attitude, subtract(b.velocity, b.wind)).x
    low = rotate(b.attitude, Vector(1.0, 0.0, 0.0)).z < COMPARED_BELOW
    return bool(low and max(speed, along) > COMPARED_FROM and not f.numb)


@subroutine
def compare_tube(f: Filter, i: Instruments, speed: float, innovation: float, step: Step) -> None:
    """Compare a reading of the tube with what the force along the nose tells.

    Args:
        f: The filter.
        i: The instruments.
        speed: That was read [m/s].
        innovation: What it is more than was believed [m/s].
        step: The slow step that it was read in.
    """
    if not _can_be_compared(f, speed):
        put_tube_compared(f, 0.0)
        put_tube_error(f, 0.0)
        put_tube_agreed(f, 0.0)
        return
    told = told_by_force(value_of(f.nominal), step, value_of(f.model))
    time = 1.0 / i.specification.pitot.timing.rate
    difference = clipped(speed - told.speed, -MAX_DIFFERENCE, MAX_DIFFERENCE)
    put_tube_error(f, f.tube_error + time / COMPARED_TIME * (difference - f.tube_error))
    put_tube_compared(f, f.tube_compared + time)
    put_tube_silent(f, 0.0)
    doubt = DEVIATIONS * told.deviation
    settled = f.tube_compared > USUAL_FROM
    put_tube_usual(f, f.tube_usual + (time / USUAL_TIME if settled else 1.0) * (f.tube_error - f.tube_usual))
    differs = abs(f.tube_error - f.tube_usual) > max(CHANGED, 0.5 * doubt)
    put_tube_changed(f, f.tube_changed + time if differs else 0.0)
    changed = f.tube_changed > CHANGED_TIME
    if changed or abs(f.tube_error) > max(DIFFERS, doubt):
        _fail(f, told, AGREES if not changed else 0.0)
    agrees = abs(f.tube_error) < max(AGREES, doubt) and abs(innovation) < AGREES and not changed
    put_tube_agreed(f, f.tube_agreed + time if agrees else 0.0)
    if f.failed[PITOT] > 0.0 and f.tube_agreed >= READMITTED_TIME:
        f.failed[PITOT] = 0.0
        put_tube_missed(f, 0.0)


@subroutine
def _fail(f: Filter, told: Told, astray: float) -> None:
    """The tube has failed; where it has led the wind ``astray`` by so much [m/s], forget that."""
    b = value_of(f.nominal)
    along = rotate_inverse(b.attitude, subtract(b.velocity, b.wind)).x
    if f.failed[PITOT] == 0.0 and abs(along - told.speed) > max(astray, told.deviation):
        forget_wind(f, LOST_WIND)
    f.failed[PITOT] = 1.0


@subroutine
def forget_wind(f: Filter, deviation: float) -> None:
    """Doubt the wind by so much [m/s], as if nothing had told it."""
    reset_block(f.covariance, WIND_ERROR, deviation * deviation)
    reset_block(f.covariance, STEADY_WIND_ERROR, deviation * deviation)
    feel_for_long(f)


@kernel
def is_vouched_for(f: Filter) -> bool:
    """Whether the force along the nose has told for a while what the tube does."""
    compared = f.tube_compared >= COMPARED_TIME and f.tube_silent < COMPARED_TIME
    return bool(compared and abs(f.tube_error) < AGREES and f.failed[PITOT] == 0.0)


@subroutine
def watch_tube(f: Filter, step: Step, has_tube: bool, period: int) -> None:
    """Notice a tube that is missed, and let the force along the nose stand in for one that has failed.

    Args:
        f: The filter.
        step: The slow step.
        has_tube: Whether there is a tube.
        period: Control periods flown.
    """
    if not has_tube or not _can_be_compared(f, 0.0):
        return
    put_tube_silent(f, f.tube_silent + SLOW_STEP)
    helped = (period - f.fused_at[PITOT - FIRST_DELAYED]) * PERIOD < HELPED_LATELY
    put_tube_missed(f, 0.0 if helped else f.tube_missed + SLOW_STEP)
    if f.tube_missed >= MISSED_TIME:
        put_tube_missed(f, 0.0)
        if is_vouched_for(f):
            forget_wind(f, f.settings.wind.max_deviation)
            f.refused_at[PITOT - FIRST_DELAYED] = -1e9
        else:
            f.failed[PITOT] = 1.0
    if f.failed[PITOT] > 0.0:
        _stand_in(f, step)


@subroutine
def _stand_in(f: Filter, step: Step) -> None:
    """Take the airspeed from the force along the nose, which tells of the wind alone."""
    b, H = value_of(f.nominal), f.H
    told = told_by_force(b, step, value_of(f.model))
    v_b = rotate_inverse(b.attitude, subtract(b.velocity, b.wind))
    nose = Vector(1.0, 0.0, 0.0)
    put_vector(H, VELOCITY_ERROR, rotate(b.attitude, nose))
    put_vector(H, WIND_ERROR, scaled(rotate(b.attitude, nose), -1.0))
    put_vector(H, ATTITUDE_ERROR, cross(nose, v_b))
    variance = (STOOD_IN * STOOD_IN + told.deviation * told.deviation) * LACK_TIME / SLOW_STEP
    fuse(f, WIND_ERROR, told.speed - v_b.x, variance)
    correct_nominal(f)
