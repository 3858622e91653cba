r"""The air as the filter believes it to move, and what wing and tube make of it.

The wind :math:`w` wanders about the steady wind as Dryden's turbulence does along the way of the vehicle,

.. math::
    \dot w = -(w - \bar w) / \tau + \sigma \sqrt{2 / \tau}\, n, \quad \tau = L / V.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.estimation.filter import SLOW_STEP, Filter, Step, meters_gusts, put_nominal
from sitl.estimation.kalman import transform_row
from sitl.estimation.nominal_state import (
    ATTITUDE_ERROR,
    TUBE_SPEED_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    NominalState,
    with_tube_speed,
)
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import decay, sine_cosine
from sitl.model.quaternions import Quaternion, rotate, rotate_inverse
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, cross, dot, norm, subtract
from sitl.sensors.instruments import Pitot, speed_before_tube
from sitl.storage import value_of

EXPECTED_LENGTH = 30.0  # L, of turbulence some tens of metres above the ground [m]
MIN_TURNOVER = 1.0  # V of a vehicle that the air stands still about [m/s]
MIN_WIND_DEVIATION = 0.1  # of the wind, where its effect is worked out [m/s]
SPAN = 1.7320508075688772  # of divided differences, in deviations: the square root of 3


@kernel
def turnover_time(b: NominalState) -> float:
    """Duration of a gust for a vehicle that flies through it as it believes to [s]."""
    return EXPECTED_LENGTH / max(norm(subtract(b.velocity, b.wind)), MIN_TURNOVER)


@kernel
def expected_turnover(f: Filter, b: NominalState) -> float:
    """Duration of a gust [s]; where their level is metered, at the airspeed that is expected in the mean.

    What is not known of the wind makes that larger: without it gusts that pass fast would be taken for strong ones.
    """
    if not meters_gusts(f):
        return turnover_time(b)
    P, w = f.covariance, WIND_ERROR
    airspeed = subtract(b.velocity, b.wind)
    mean_square = dot(airspeed, airspeed) + P[w, w] + P[w + 1, w + 1] + P[w + 2, w + 2]
    return EXPECTED_LENGTH / max(math.sqrt(mean_square), MIN_TURNOVER)


@subroutine
def predict_wind(f: Filter, b: NominalState) -> float:
    """Set how the wind goes on over a slow step, and its process noise, at the airspeed of now.

    A gust that nothing tells is as uncertain as the gusts are strong: with their level its error grows or shrinks.

    Args:
        f: The filter, whose ``decay`` and ``process_noise`` are set.
        b: Its nominal state.

    Returns:
        Share of the gust that is left.
    """
    decays, process_noise, level = f.decay, f.process_noise, f.gusts.level
    keep = decay(SLOW_STEP / expected_turnover(f, b))
    for k in range(WIND_ERROR, WIND_ERROR + 3):
        decays[k], process_noise[k] = keep * f.gusts.growth, level * level * (1.0 - keep * keep)
    return keep


class ToldByWing(NamedTuple):
    """Expected specific force across the wing, in an uncertain wind."""

    mean: float  # specific force along z_b [m/s2]
    slope: Vector  # its derivative by the velocity through the air, body frame [1/s]
    steep: float  # mean square of its parts along nose and span, within the wind's uncertainty [1/s2]
    curve: float  # derivative of the slope across the wing by the speed across it [1/m]
    raised: float  # by how much the wind's uncertainty across the wing raises the mean [m/s2]
    bend: float  # variance by what no slope tells [m2/s4]


@kernel
def body_deviations(P: Array, q: Quaternion) -> Vector:
    """Deviations of the wind along the body's axes [m/s]."""
    x, y, z = rotate(q, Vector(1.0, 0.0, 0.0)), rotate(q, Vector(0.0, 1.0, 0.0)), rotate(q, Vector(0.0, 0.0, 1.0))
    return Vector(_deviation(P, x), _deviation(P, y), _deviation(P, z))


@kernel
def _deviation(P: Array, axis: Vector) -> float:
    w = WIND_ERROR
    variance = axis.x * axis.x * P[w, w] + axis.y * axis.y * P[w + 1, w + 1] + axis.z * axis.z * P[w + 2, w + 2]
    crossed = axis.x * axis.y * P[w, w + 1] + axis.x * axis.z * P[w, w + 2] + axis.y * axis.z * P[w + 1, w + 2]
    return math.sqrt(max(variance + 2.0 * crossed, MIN_WIND_DEVIATION * MIN_WIND_DEVIATION))


@subroutine
def told_by_wing(v_b: Vector, deviations: Vector, gyro_bias: Vector, step: Step, a: Airframe) -> ToldByWing:
    """The force across the wing by divided differences (M. Norgaard and others, *Automatica* 36, 2000).

    A wing in the hover stalls and fills within the wind's uncertainty: a derivative at one point tells too much.

    Args:
        v_b: Velocity through the air, body frame [m/s].
        deviations: Of the wind along the body's axes [m/s].
        gyro_bias: [rad/s].
        step: With rates and actuators.
        a: The airframe.
    """
    rates = subtract(step.rates, gyro_bias)
    x, y, z = SPAN * deviations.x, SPAN * deviations.y, SPAN * deviations.z
    middle = _force_across(v_b, rates, step, a)
    up = _force_across(Vector(v_b.x + x, v_b.y, v_b.z), rates, step, a) - middle
    down = _force_across(Vector(v_b.x - x, v_b.y, v_b.z), rates, step, a) - middle
    left = _force_across(Vector(v_b.x, v_b.y + y, v_b.z), rates, step, a) - middle
    right = _force_across(Vector(v_b.x, v_b.y - y, v_b.z), rates, step, a) - middle
    belly = _force_across(Vector(v_b.x, v_b.y, v_b.z + z), rates, step, a) - middle
    back = _force_across(Vector(v_b.x, v_b.y, v_b.z - z), rates, step, a) - middle
    bent_x, bent_y, bent_z = up + down, left + right, belly + back
    slope = Vector((up - down) / (2.0 * x), (left - right) / (2.0 * y), (belly - back) / (2.0 * z))
    unsure = (bent_x * bent_x / (x * x) + bent_y * bent_y / (y * y)) / 3.0
    return ToldByWing(
        middle + (bent_x + bent_y + bent_z) / 6.0,
        slope,
        slope.x * slope.x + slope.y * slope.y + unsure,
        bent_z / (z * z),
        bent_z / 6.0,
        (bent_x * bent_x + bent_y * bent_y + bent_z * bent_z) / 18.0,
    )


@kernel
def shaken(actuators: Actuators, vibration: float, reference: float) -> float:
    """Rest of both propellers' vibration in the mean force of a slow step, as a variance [m2/s4].

    Args:
        actuators: As believed.
        vibration: Amplitude by a propeller at the reference [m/s2].
        reference: Speed of a propeller [rad/s].
    """
    speed = 0.5 * (actuators.left_motor + actuators.right_motor)
    sine, _ = sine_cosine(0.5 * speed * SLOW_STEP)
    left = vibration * speed * sine / (reference * reference * 0.5 * SLOW_STEP)
    return left * left


@kernel
def _force_across(v_b: Vector, rates: Vector, step: Step, a: Airframe) -> float:
    F, _ = wrench(v_b, rates, step.actuators, a)
    return F.z / a.m


@subroutine
def predict_tube(f: Filter, step: Step, spec: Pitot) -> None:
    """Predict the pitot's diaphragm over a slow step, and the covariance of its error."""
    b, a = value_of(f.nominal), value_of(f.model)
    taken = 1.0 - decay(SLOW_STEP / spec.lag)
    v_b = rotate_inverse(b.attitude, subtract(b.velocity, b.wind))
    felt = speed_before_tube(v_b.x, step.actuators, a, spec)
    put_nominal(f, with_tube_speed(b, b.tube_speed + taken * (felt - b.tube_speed)))
    _feel(f, b, taken)


@subroutine
def feel_for_long(f: Filter) -> None:
    """Let the error of what the diaphragm is believed to feel be that of the airspeed itself."""
    _feel(f, value_of(f.nominal), 1.0)


@kernel
def _feel(f: Filter, b: NominalState, taken: float) -> None:
    """Take a share of the airspeed's error into that of what the diaphragm feels."""
    H, x = f.H, Vector(taken, 0.0, 0.0)
    nose, turned = rotate(b.attitude, x), cross(x, rotate_inverse(b.attitude, subtract(b.velocity, b.wind)))
    H[VELOCITY_ERROR], H[VELOCITY_ERROR + 1], H[VELOCITY_ERROR + 2] = nose.x, nose.y, nose.z
    H[WIND_ERROR], H[WIND_ERROR + 1], H[WIND_ERROR + 2] = -nose.x, -nose.y, -nose.z
    H[ATTITUDE_ERROR], H[ATTITUDE_ERROR + 1], H[ATTITUDE_ERROR + 2] = turned.x, turned.y, turned.z
    H[TUBE_SPEED_ERROR] = 1.0 - taken
    transform_row(f.covariance, H, f.PH, f.settings.states, TUBE_SPEED_ERROR)
