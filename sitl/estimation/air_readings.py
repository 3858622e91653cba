"""Updates of the wind by pitot and wing, and of nothing else: a wrong model shall not move the vehicle."""

from __future__ import annotations

import math

from sitl.compiled import kernel, subroutine
from sitl.estimation.air import MIN_WIND_DEVIATION, body_deviations, shaken, told_by_wing
from sitl.estimation.filter import SLOW_STEP, Filter, Step, put_air_doubt
from sitl.estimation.fusion import (
    Agreement,
    correct_nominal,
    fuse,
    innovation_ratio_of,
    may_be_fused,
    note,
    put_vector,
    sum_of_errors,
)
from sitl.estimation.kalman import innovation_ratio
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    ATTITUDE_ERROR,
    TUBE_BIAS_ERROR,
    TUBE_SPEED_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    WING_ERROR,
    NominalState,
    with_wind,
)
from sitl.estimation.tube_check import compare_tube, forget_wind, is_vouched_for
from sitl.model.airframe import Array
from sitl.model.quaternions import rotate, rotate_inverse
from sitl.model.vectors import Vector, add_scaled, cross, dot, norm, scaled, subtract
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import FIRST_DELAYED, N_DELAYED, PITOT, Instruments
from sitl.storage import value_of

WING = N_DELAYED  # where the wing's innovations are counted, beside the lines
WING_NOISE = 0.12  # of the force across the wing, mean of a slow step, unshaken [m/s2]
WING_LACKS = 0.1  # what its model may lack whatever the force is [m/s2]
WING_DOUBT = 1.2  # of one reading beside its noise: what the model lacks and keeps lacking [m/s2]
ATTACHED = 0.45  # of the share that its model may lack, where the air flows along the wing [-]
UNKNOWN_TIME = 10.0  # how long the effect of a wind lasts that no reading tells [s]
TUBE_DEAD = 2.0  # how far beyond its threshold a reading has to be that is not expected [m/s]
TUBE_LEAP = 3.0  # more than an airspeed changes from one reading to the next [m/s]
TUBE_DOUBTED = 3.0  # after a reading that was refused, the tube checks nothing for so long [s]
TUBE_FORGIVEN = 5.0  # refused for so long by a tube that is vouched for, the wind was believed wrong [s]


@subroutine
def observe_airspeed(f: Filter, i: Instruments, reading: Array, period: int, step: Step) -> None:
    """The pitot's airspeed, which tells of the wind alone: a wrong tube shall not move the vehicle."""
    b, gains, H = value_of(f.nominal), value_of(f.settings.wind), f.H
    innovation = reading[0] - b.tube_speed - b.tube_bias
    compare_tube(f, i, reading[0], innovation, step)
    # Of a speed near the threshold only what noise made large would be used, so what is believed decides as well.
    if reading[0] <= (0.0 if b.tube_speed > gains.min_pitot else gains.min_pitot + TUBE_DEAD):
        return
    spec = value_of(i.specification.pitot)
    variance = spec.noise * spec.noise + spec.step * spec.step / 12.0
    _forgive(f, period)
    sum_of_errors(H, TUBE_SPEED_ERROR, TUBE_BIAS_ERROR)
    ratio = innovation_ratio_of(f, innovation, variance)
    fits = _follows(f, reading[0], innovation, period) and may_be_fused(f, PITOT - FIRST_DELAYED, period, ratio)
    fits = fits and f.failed[PITOT] == 0.0
    if fits:
        sum_of_errors(H, TUBE_SPEED_ERROR, TUBE_BIAS_ERROR)
        ratio = fuse(f, WIND_ERROR, innovation, variance)
        correct_nominal(f)
    note(f, PITOT - FIRST_DELAYED, period, Agreement(ratio, ratio, 1), fits)


@subroutine
def _follows(f: Filter, speed: float, innovation: float, period: int) -> bool:
    """Whether the tube may be believed: the air in it is slow, and what has leapt is doubted until it is near again.

    The wind may be anything, so the gate alone would let a wrong tube through.
    """
    at, line = f.refused_at, PITOT - FIRST_DELAYED
    before = f.before[line, 0]
    leaps = before > 0.0 and abs(speed - before) > TUBE_LEAP
    if leaps or (abs(innovation) > TUBE_LEAP and (period - at[line]) * PERIOD <= TUBE_DOUBTED):
        at[line] = period
        return False
    return True


@subroutine
def _forgive(f: Filter, period: int) -> None:
    """Forget the wind where the tube has long been refused, though the force along the nose tells what it does."""
    since, line = f.refused_since, PITOT - FIRST_DELAYED
    if since[line] < 0.0 or (period - since[line]) * PERIOD < TUBE_FORGIVEN or not is_vouched_for(f):
        return
    forget_wind(f, f.settings.wind.max_deviation)
    since[line], f.refused_at[line] = -1.0, period - TUBE_DOUBTED / PERIOD - 1.0


@kernel
def _lacking(v_b: Vector) -> float:
    """Share of the wing's model error that counts: along the wing one constant makes the force, across it two."""
    across = abs(v_b.z) / max(norm(v_b), MIN_WIND_DEVIATION)
    return ATTACHED + (1.0 - ATTACHED) * across


@subroutine
def observe_wing(f: Filter, step: Step, has_tube: bool, vibration: float) -> None:
    """The force across the wing, which tells of the wind alone: a wrong model shall not move the vehicle.

    The share of it that the model lacks is considered and never estimated: the wind that is believed explains what
    is felt, and is as uncertain as the model makes it.

    Args:
        f: The filter.
        step: The slow step.
        has_tube: Whether there is a pitot that may be believed.
        vibration: Of the accelerometer, by a propeller at vibration_speed [m/s2].
    """
    b, a, H = value_of(f.nominal), value_of(f.model), f.H
    v_b = rotate_inverse(b.attitude, subtract(b.velocity, b.wind))
    deviations = body_deviations(f.covariance, b.attitude)
    told = told_by_wing(v_b, deviations, b.gyro_bias, step, a)
    # The wing tells the product of speed and incidence: unchecked by a tube, gusts would be taken for speed. Along the
    # span a wind of either sign does the same.
    is_checked = has_tube and v_b.x > f.settings.wind.min_pitot
    slope = Vector(told.slope.x if is_checked else 0.0, 0.0, told.slope.z)
    ahead, aside = (told.slope.x - slope.x) * deviations.x, told.slope.y * deviations.y
    misread = told.bend + ahead * ahead + aside * aside + WING_LACKS * WING_LACKS
    by_wind = rotate(b.attitude, slope)
    put_vector(H, WIND_ERROR, scaled(by_wind, -1.0))
    put_vector(H, VELOCITY_ERROR, by_wind)
    put_vector(H, ATTITUDE_ERROR, cross(slope, v_b))
    H[ACCEL_BIAS_ERROR + 2] = 1.0
    H[WING_ERROR] = told.mean * _lacking(v_b)
    push = 1.0 / innovation_ratio(f.covariance, H, f.settings.states, 1.0, misread)
    put_air_doubt(f, math.sqrt(push))
    if f.on_ground:  # what holds the wing there is not the air alone
        H[:] = 0.0
        return
    innovation = step.force.z - b.accel_bias.z - told.mean
    noise = WING_NOISE * WING_NOISE + shaken(step.actuators, vibration, a.vibration_speed)
    f.squares[WING] += innovation * innovation / (push + noise)
    f.scalars[WING] += 1.0
    # What an unknown wind along nose and span does to the force lasts: as noise it counts for as much longer.
    lasting = (misread - WING_LACKS * WING_LACKS) * UNKNOWN_TIME / SLOW_STEP
    fuse(f, WIND_ERROR, innovation, noise + lasting + WING_DOUBT * WING_DOUBT)
    correct_nominal(f)


@kernel
def nose_wind_fading(b: NominalState, time: float) -> NominalState:
    """The belief with the wind along the nose a slow step nearer to calm: without a tube nothing tells it."""
    nose = rotate(b.attitude, Vector(1.0, 0.0, 0.0))
    wind = add_scaled(b.wind, nose, -dot(b.wind, nose) * SLOW_STEP / time)
    return with_wind(b, wind)
