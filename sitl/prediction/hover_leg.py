"""One leg in the hover, flown by a point mass under the linear hover law and the velocity governor.

In a wind the zero-moment law counts on accelerations that the wing does not allow, and the wing's moment turns the
nose: both slow the vehicle down, and both are in the prediction. Far from the end the speeds do not depend on the
distance; the flight is not stepped through there but continued as it is.
"""

import math
from typing import NamedTuple

from sitl.compiled import entry, kernel
from sitl.control.governor import gamma
from sitl.control.hover_linear import SQRT_HALF, HoverError, quadratic
from sitl.control.hover_zero_moment import AHEAD, PER_AHEAD
from sitl.model.aerodynamics import slopes, trimmed_slope
from sitl.model.airframe import elevon_arm, slipstream_slope
from sitl.model.arithmetic import arctangent, clipped, exponential, sine_cosine, wrapped
from sitl.model.vectors import Vector, add_scaled, cross, dot, level_norm, norm, scaled, subtract
from sitl.prediction.equilibrium import MIN_GRIP, back, in_axes, level, power, weight
from sitl.prediction.point_mass import LinearHover, PointMass, Prediction
from sitl.supervisor.guards import LYAPUNOV_PATIENCE

PREDICTION_STEP = 0.05  # [s]
MAX_PREDICTION_STEPS = 6000
STEADY = 0.02  # acceleration [m/s2], or climb rate [m/s], that counts as none
FAR_OFF = 6.0  # the governor is at its limit so many seconds away


class HoverLeg(NamedTuple):
    """Inputs of the prediction of a leg in hover."""

    offset: Vector  # position less the end's [m]
    velocity: Vector  # at the beginning [m/s]
    wind: Vector  # [m/s]
    heading: float  # from the leg's direction to the left [rad]: the wing feels no wind along its span
    learnt: Vector  # what the integral of the linear law holds against [N]
    speed: float  # horizontal limit [m/s]
    acceptance: float  # distance to the end that counts as arrived [m]


class HoverMotion(NamedTuple):
    """State of the flight."""

    offset: Vector  # [m]
    velocity: Vector  # [m/s]
    force: Vector  # of the propellers as the laws see it, along the nose wanted [N]
    nose: Vector  # unit
    sag: float  # of the nose towards the belly, from where it is wanted [rad]
    acceleration: Vector  # [m/s2]
    integral: Vector  # of the linear law [m s]
    is_linear: bool  # which law flies
    time: float  # [s]
    energy: float  # [J]


@entry
def fly_hover(leg: HoverLeg, body: PointMass) -> Prediction:
    """Time and energy in the hover until within acceptance of the end, infinite if it is never reached.

    Args:
        leg: To be flown; the linear law begins it.
        body: What flies.
    """
    none, share = Vector(0.0, 0.0, 0.0), 1.0 - exponential(-PREDICTION_STEP / body.hover_lag)
    nose, force = Vector(0.0, 0.0, 1.0), weight(body.airframe)
    s = HoverMotion(
        offset=leg.offset,
        velocity=leg.velocity,
        force=force,
        nose=nose,
        sag=0.0,
        acceleration=none,
        integral=none,
        is_linear=True,
        time=0.0,
        energy=0.0,
    )
    ahead = level(leg.heading)
    for _ in range(MAX_PREDICTION_STEPS):
        if norm(s.offset) <= leg.acceptance:
            return Prediction(s.time, s.energy)
        s = _moved(_commanded(s, leg, ahead, share, body), leg, ahead, body)
    return Prediction(math.inf, math.inf)


@kernel
def hover_value(
    offset: Vector, velocity: Vector, nose: Vector, wanted: float, heading: float, law: LinearHover
) -> float:
    """V of the linear hover law without body rates, at a nose direction and a heading when another is wanted [rad]."""
    s, c = sine_cosine(wanted)
    sh, ch = sine_cosine(heading)
    tilted, _ = sine_cosine(0.5 * arctangent(nose.z, nose.x * ch + nose.y * sh))
    so, co = sine_cosine(0.5 * wrapped(heading - wanted))
    e, v = offset, velocity
    x = HoverError(
        Vector(c * e.x + s * e.y, c * e.y - s * e.x, e.z),
        Vector(c * v.x + s * v.y, c * v.y - s * v.x, v.z),
        Vector(so * SQRT_HALF, SQRT_HALF - co * tilted, so * SQRT_HALF),
        Vector(0.0, 0.0, 0.0),
    )
    return quadratic(x, law.S)


@kernel
def _commanded(s: HoverMotion, leg: HoverLeg, ahead: Vector, share: float, body: PointMass) -> HoverMotion:
    """The force and the nose that the law in force makes.

    Args:
        s: State before the step.
        leg: What is flown.
        ahead: Where the belly points, level.
        share: Of a change, that the attitude follows in a step.
        body: What flies.
    """
    a, law = body.airframe, body.linear
    value = hover_value(s.offset, s.velocity, s.nose, leg.heading, leg.heading, law)
    entered = law.v_waited if s.time >= LYAPUNOV_PATIENCE else law.v_enter
    is_linear = value < (law.v_leave if s.is_linear else entered)
    integral, force, sag = s.integral, s.force, 0.0
    if is_linear:
        integral = _integrated(s, leg.speed, law)
        asked = add_scaled(weight(a), _linear(s, integral, leg.speed, law), a.m)
        force = add_scaled(force, subtract(subtract(asked, leg.learnt), force), share)
    else:
        force = add_scaled(force, _steer(s, leg.speed, body), PREDICTION_STEP)
    nose = scaled(force, 1.0 / max(norm(force), 1e-6))
    if not is_linear:
        sag = s.sag + (_sag(s, nose, force, ahead, leg.wind, body) - s.sag) * share
        sine, cosine = sine_cosine(sag)
        nose = add_scaled(scaled(nose, cosine), back(nose, ahead), -sine)
    return HoverMotion(
        offset=s.offset,
        velocity=s.velocity,
        force=force,
        nose=nose,
        sag=sag,
        acceleration=s.acceleration,
        integral=integral,
        is_linear=is_linear,
        time=s.time,
        energy=s.energy,
    )


@kernel
def _moved(s: HoverMotion, leg: HoverLeg, ahead: Vector, body: PointMass) -> HoverMotion:
    """The point mass after a step under its force, or after as long as a steady flight goes on as it is."""
    a, v_a, push = body.airframe, subtract(s.velocity, leg.wind), norm(s.force)
    z = back(s.nose, ahead)
    inflow, thrust = dot(v_a, s.nose), 0.5 * push / (1.0 - a.S_ratio * a.C_d0)
    lift = trimmed_slope(slopes(in_axes(v_a, s.nose, cross(z, s.nose), z), thrust, thrust, a), a) * dot(v_a, z)
    total = subtract(add_scaled(scaled(s.nose, push), z, -lift), weight(a))
    real = scaled(total, 1.0 / a.m)
    is_steady = not s.is_linear and norm(real) < STEADY
    step = PREDICTION_STEP + (_unchanged(s.offset, s.velocity, FAR_OFF * leg.speed) if is_steady else 0.0)
    offset = add_scaled(add_scaled(s.offset, s.velocity, step), real, 0.5 * PREDICTION_STEP * PREDICTION_STEP)
    velocity = add_scaled(s.velocity, real, PREDICTION_STEP)
    energy = s.energy + step * power(thrust, inflow, a)
    return HoverMotion(
        offset=offset,
        velocity=velocity,
        force=s.force,
        nose=s.nose,
        sag=s.sag,
        acceleration=real,
        integral=s.integral,
        is_linear=s.is_linear,
        time=s.time + step,
        energy=energy,
    )


@kernel
def _unchanged(offset: Vector, v: Vector, near: float) -> float:
    """Time for which a governed flight goes on as it is: its speeds do not depend on great distances [s]."""
    distance = level_norm(offset.x, offset.y)
    closing = -(offset.x * v.x + offset.y * v.y) / max(distance, 1e-6)
    level_time = max(distance - near, 0.0) / max(closing, 1e-9) if closing > 0.0 else 0.0
    climb = abs(v.z)
    vertical_time = max(abs(offset.z) - near, 0.0) / climb if climb >= STEADY else math.inf
    return min(level_time, vertical_time)


@kernel
def _steer(s: HoverMotion, speed: float, body: PointMass) -> Vector:
    """Rate of the zero-moment law's force: its nu [N/s]."""
    a, governor = body.airframe, body.governor
    pull = subtract(s.force, weight(a))  # the law knows of no wing: what is missing stays missing
    now = gamma(s.offset, s.velocity, speed, governor)
    soon = gamma(add_scaled(s.offset, s.velocity, AHEAD), add_scaled(s.velocity, pull, AHEAD / a.m), speed, governor)
    return add_scaled(scaled(subtract(soon, now), PER_AHEAD), subtract(pull, now), -body.k_delta)


@kernel
def _sag(s: HoverMotion, nose: Vector, force: Vector, ahead: Vector, wind: Vector, body: PointMass) -> float:
    """Angle by which the wing's moment turns the nose to the belly from the zero-moment law's attitude [rad].

    That law has no integral, and its feed-forward turns the nose after an acceleration that the wing does not allow.
    """
    a, z, v_a = body.airframe, back(nose, ahead), subtract(s.velocity, wind)
    push = norm(force)
    thrust = 0.5 * push
    stream = slopes(in_axes(v_a, nose, cross(z, nose), z), thrust, thrust, a)
    grip = max(stream.left_elevon + stream.right_elevon, MIN_GRIP)
    delta = clipped(-stream.moment * dot(v_a, z) / (elevon_arm(a) * grip), -a.delta_max, a.delta_max)
    moment = 2.0 * a.S_ratio * slipstream_slope(a) * a.xi_m * a.Delta_r * delta * thrust
    missing = subtract(scaled(subtract(force, weight(a)), 1.0 / a.m), s.acceleration)
    turned = body.k_delta * body.governor.k_pd * dot(missing, z) / max(push, 1e-6)
    return (moment / a.J2 + turned) / (body.lam * body.lam)


@kernel
def _integrated(s: HoverMotion, speed: float, law: LinearHover) -> Vector:
    """The linear law's integral a step later [m s]."""
    due, most = add_scaled(_followed(s.offset, speed * law.lead), s.velocity, law.lead), law.integral_limit
    bounded = Vector(clipped(due.x, -most, most), clipped(due.y, -most, most), clipped(due.z, -most, most))
    return add_scaled(s.integral, bounded, PREDICTION_STEP)


@kernel
def _linear(s: HoverMotion, integral: Vector, speed: float, law: LinearHover) -> Vector:
    """Acceleration that the linear law asks for [m/s2]."""
    e, v = _followed(s.offset, speed * law.headway), s.velocity
    e = scaled(e, min(1.0, law.reach / max(norm(e), 1e-9)))
    return Vector(
        -law.k_p * e.x - law.k_v * v.x - law.k_i * integral.x,
        -law.k_p * e.y - law.k_v * v.y - law.k_i * integral.y,
        -law.k_z * e.z - law.k_vz * v.z - law.k_iz * integral.z,
    )


@kernel
def _followed(offset: Vector, most: float) -> Vector:
    """The position less that of the point that the linear law follows, which is no farther than so on the level [m]."""
    share = min(1.0, most / max(level_norm(offset.x, offset.y), 1e-9))
    return Vector(share * offset.x, share * offset.y, offset.z)
