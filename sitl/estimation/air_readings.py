"""Updates of the wind by pitot and wing, and of nothing else: a wrong model shall not move the vehicle."""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.estimation.air import (
    MIN_WIND_DEVIATION,
    ToldByWing,
    body_deviations,
    expected_turnover,
    shaken,
    told_by_wing,
)
from sitl.estimation.filter import (
    LACKED_SHARE,
    SLOW_STEP,
    Filter,
    Step,
    meters_gusts,
    put_air_doubt,
    put_gusts,
    put_wing,
)
from sitl.estimation.fusion import (
    Agreement,
    correct_nominal,
    fuse,
    fuse_cautiously,
    innovation_ratio_of,
    may_be_fused,
    note,
    put_vector,
    sum_of_errors,
)
from sitl.estimation.gust_meter import Felt, corrected_by, felt_anew, lacking_after, metered
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
from sitl.model.vectors import Vector, add, add_scaled, cross, dot, norm, scaled, subtract
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import FIRST_DELAYED, N_DELAYED, PITOT, Instruments
from sitl.storage import value_of

WING = N_DELAYED  # where the wing's innovations are counted, beside the lines
WING_NOISE = 0.12  # of the force across the wing, mean of a slow step, unshaken [m/s2]
NOTCHED_NOISE = 0.012  # likewise behind the notch, where it is metered [m/s2]
NOTCHED_SHARE = 0.1  # of the propellers' vibration that the notch leaves [-]
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


@kernel
def _of_what_lacks(f: Filter) -> float:
    """Part of the innovation's variance by what the force lacks, beside what the believed wind explains [m2/s4]."""
    together = 0.0
    for k in range(f.settings.states):
        together += f.covariance[WING_ERROR, k] * f.H[k]
    lacks: float = f.H[WING_ERROR]
    return max(lacks * together, 0.0)


@kernel
def _a_while_before(b: NominalState, step: Step, v_b: Vector, g: float, time: float) -> Vector:
    """Velocity through the air so long before [s], as in the middle of a slow step, whose mean is felt, body [m/s]."""
    pushed = add(subtract(step.force, b.accel_bias), rotate_inverse(b.attitude, Vector(0.0, 0.0, -g)))
    turned = cross(subtract(step.rates, b.gyro_bias), v_b)
    return add_scaled(v_b, subtract(pushed, turned), -time)


class Across(NamedTuple):
    """The force across the wing as it is expected."""

    told: ToldByWing
    through: Vector  # believed velocity through the air, body FLU [m/s]
    misread: float  # variance by what its derivative does not tell [m2/s4]
    is_checked: bool  # whether a tube checks the wind along the nose


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
    if meters_gusts(f):
        _observe_metered(f, step, has_tube, vibration)
    else:
        _observe_at_fixed_level(f, step, has_tube, vibration)


@subroutine
def _look_across(f: Filter, step: Step, has_tube: bool, before: float) -> Across:
    """Expect the force across the wing, and put its derivative but that by what the model lacks in H.

    Args:
        f: The filter.
        step: The slow step.
        has_tube: Whether there is a pitot that may be believed.
        before: By how much earlier than the filter's instant it is felt [s].
    """
    b, a, H = value_of(f.nominal), value_of(f.model), f.H
    v_b = rotate_inverse(b.attitude, subtract(b.velocity, b.wind))
    deviations = body_deviations(f.covariance, b.attitude)
    felt_at = _a_while_before(b, step, v_b, a.g, before) if before > 0.0 else v_b
    told = told_by_wing(felt_at, deviations, b.gyro_bias, step, a)
    # The wing tells the product of speed and incidence: unchecked by a tube, gusts would be taken for speed. Along the
    # span a wind of either sign does the same.
    is_checked = has_tube and v_b.x > f.settings.wind.min_pitot
    slope = Vector(told.slope.x if is_checked else 0.0, 0.0, told.slope.z)
    ahead, aside = (told.slope.x - slope.x) * deviations.x, told.slope.y * deviations.y
    by_wind = rotate(b.attitude, slope)
    put_vector(H, WIND_ERROR, scaled(by_wind, -1.0))
    put_vector(H, VELOCITY_ERROR, by_wind)
    put_vector(H, ATTITUDE_ERROR, cross(slope, v_b))
    H[ACCEL_BIAS_ERROR + 2] = 1.0
    return Across(told, v_b, told.bend + ahead * ahead + aside * aside, is_checked)


@subroutine
def _observe_at_fixed_level(f: Filter, step: Step, has_tube: bool, vibration: float) -> None:
    b, a, H = value_of(f.nominal), value_of(f.model), f.H
    told, v_b, misread, _ = _look_across(f, step, has_tube, 0.0)
    misread += WING_LACKS * WING_LACKS
    H[WING_ERROR] = told.mean * _lacking(v_b)
    push = 1.0 / innovation_ratio(f.covariance, H, f.settings.states, 1.0, misread)
    put_air_doubt(f, math.sqrt(push))
    if f.on_ground:  # what holds the wing there is not the air alone
        H[:] = 0.0
        return
    innovation = step.force.z - b.accel_bias.z - told.mean
    noise = WING_NOISE * WING_NOISE + shaken(step.actuators, vibration, a.vibration_speed)
    _count(f, innovation, push + noise)
    # What an unknown wind along nose and span does to the force lasts: as noise it counts for as much longer.
    lasting = (misread - WING_LACKS * WING_LACKS) * UNKNOWN_TIME / SLOW_STEP
    fuse(f, WIND_ERROR, innovation, noise + lasting + WING_DOUBT * WING_DOUBT)
    correct_nominal(f)


@subroutine
def _observe_metered(f: Filter, step: Step, has_tube: bool, vibration: float) -> None:
    b, a, H = value_of(f.nominal), value_of(f.model), f.H
    told, v_b, misread, is_checked = _look_across(f, step, has_tube, 0.5 * SLOW_STEP)
    lacking = told.mean * _lacking(v_b)
    expected = f.wing.share * lacking
    # What an unknown wind does to the force lasts. Where the tube checks it, it is one more lack of the force; in the
    # hover it changes with every gust, and counts as noise for as long as a gust lasts.
    lasting = 0.0 if is_checked else misread
    lacked = misread - lasting + expected * expected
    H[WING_ERROR] = math.sqrt(lacked) / LACKED_SHARE
    push = 1.0 / innovation_ratio(f.covariance, H, f.settings.states, 1.0, lasting)
    unexplained = _of_what_lacks(f) * (expected * expected / max(lacked, 1e-12))
    lacks = LACKED_SHARE * lacking
    put_air_doubt(f, math.sqrt(push + WING_LACKS * WING_LACKS + lacks * lacks))
    if f.on_ground or f.numb:  # what is felt there is not the air alone, or not felt at all
        put_gusts(f, felt_anew(value_of(f.gusts)))
    if f.on_ground:
        H[:] = 0.0
        return
    innovation = step.force.z - b.accel_bias.z - told.mean
    noise = NOTCHED_NOISE * NOTCHED_NOISE + shaken(step.actuators, NOTCHED_SHARE * vibration, a.vibration_speed)
    turnover = expected_turnover(f, b)
    if not f.numb:
        put_gusts(f, metered(value_of(f.gusts), _felt(told, innovation, noise, turnover), v_b, SLOW_STEP))
        put_wing(f, lacking_after(value_of(f.wing), innovation, unexplained, push + noise))
    _count(f, innovation, push + noise)
    fuse_cautiously(f, WIND_ERROR, innovation, noise + lasting * (turnover / SLOW_STEP), WING_DOUBT * WING_DOUBT)
    correct_nominal(f)


@kernel
def _felt(told: ToldByWing, innovation: float, noise: float, turnover: float) -> Felt:
    return Felt(
        innovation=innovation,
        made=told.mean,
        slope=told.slope,
        steep=told.steep,
        curve=told.curve,
        raised=told.raised,
        bend=told.bend,
        noise=noise,
        step=SLOW_STEP / turnover,
    )


@kernel
def _count(f: Filter, innovation: float, variance: float) -> None:
    f.squares[WING] += innovation * innovation / variance
    f.scalars[WING] += 1.0


@kernel
def note_corrections(f: Filter) -> None:
    """Note by how much the readings of a slow step have corrected the velocity through the air."""
    b = value_of(f.nominal)
    put_gusts(f, corrected_by(value_of(f.gusts), rotate_inverse(b.attitude, subtract(b.velocity, b.wind))))


@kernel
def nose_wind_fading(b: NominalState, time: float) -> NominalState:
    """The belief with the wind along the nose a slow step nearer to calm: without a tube nothing tells it."""
    nose = rotate(b.attitude, Vector(1.0, 0.0, 0.0))
    wind = add_scaled(b.wind, nose, -dot(b.wind, nose) * SLOW_STEP / time)
    return with_wind(b, wind)
