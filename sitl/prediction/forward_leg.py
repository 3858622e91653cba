"""One leg in forward flight, flown by a point mass: front transition, cruise, climbing stop, what is left to settle.

What the position loops ask for (:mod:`sitl.control.forward_flight.forward_guidance`, :mod:`sitl.control.braking`) is
the acceleration, late by the attitude's lag; attitude, thrust and elevons are those of
:mod:`sitl.prediction.equilibrium`. So the prediction climbs where the stop climbs and idles where the motors idle, and
follows the laws when they change. A steady cruise is not stepped through but continued to where something changes.
"""

import math
from typing import NamedTuple

from sitl.compiled import entry, kernel
from sitl.control.braking import Stop, brake
from sitl.control.forward_flight.forward_guidance import (
    GuidanceGains,
    MotionInAir,
    cruise,
    stop_within,
    stopping_distance,
)
from sitl.control.forward_flight.line_of_sight import TURN_BELOW, TURN_RATE
from sitl.control.reference import Path, progress
from sitl.model.arithmetic import arctangent, clipped, exponential, wrapped
from sitl.model.vectors import (
    Vector,
    add,
    add_scaled,
    level_norm,
    norm,
    scaled,
    shortened,
    subtract,
)
from sitl.prediction.equilibrium import equilibrium, level, looking_ahead, pushed, steady_power, weight
from sitl.prediction.hover_leg import MAX_PREDICTION_STEPS, PREDICTION_STEP, STEADY, HoverLeg, fly_hover, hover_value
from sitl.prediction.point_mass import PointMass, Prediction
from sitl.supervisor.guards import CALM_WIND, STANDING_SPEED

STOP_ROOM = 12.0  # more than stopping from a creep takes [m]
MIN_CREEP = 0.1  # towards the end; slower than this it only holds [m/s]
EARLY = 1.1  # braking distances before which nothing changes


class WingLeg(NamedTuple):
    """Inputs of the prediction of a leg in forward flight."""

    path: Path  # from the origin along x
    wind: Vector  # [m/s]
    waiting: float  # in the alignment [s]
    learnt: Vector  # what the integral of the linear hover law held against before the leg [N]
    heading: float  # at the beginning, from the leg's direction to the left [rad]
    stand: float  # heading of the hover at the end, likewise [rad]
    acceptance: float  # distance to the end that counts as arrived [m]
    speed: float  # horizontal limit of the hover [m/s]
    begin: bool  # whether it begins in the hover, else in the cruise
    end: bool  # whether it ends in the hover, else abeam of its end
    upright: bool  # whether it is flown upright all along, under the law of the transition to the hover


class WingMotion(NamedTuple):
    """State of the flight."""

    position: Vector  # [m]
    velocity: Vector  # [m/s]
    wanted: Vector  # acceleration that the guidance asks for, its jerk limited [m/s2]
    acceleration: Vector  # the same, late by the attitude's lag [m/s2]
    integral: Vector  # of the guidance [m/s2]
    ahead: Vector  # where the belly points, level
    heading: float  # from the leg's direction to the left [rad]
    travel: float  # share of the elevons' that is in use
    is_braking: bool
    has_arrived: bool  # has been within acceptance of the end
    time: float  # [s]
    energy: float  # [J]


@entry
def fly_wing(leg: WingLeg, body: PointMass) -> Prediction:
    """Time and energy of a leg in forward flight, or upright in a wind, infinite if it never arrives.

    Args:
        leg: To be flown.
        body: What flies.
    """
    share = 1.0 - exponential(-PREDICTION_STEP / body.lag)
    is_calm = level_norm(leg.wind.x, leg.wind.y) < CALM_WIND  # else the law of the transition goes on in the hover
    s = _begun(leg, body)
    for _ in range(MAX_PREDICTION_STEPS):
        along, length, _ = progress(leg.path, s.position)
        if not leg.end and along >= length:
            return Prediction(s.time, s.energy)
        s = _continued(_moved(_guided(s, leg, share, body), leg, body), leg, body)
        if s.is_braking and norm(s.velocity) < STANDING_SPEED:
            value = _value(s, leg, body)
            if s.has_arrived and value < body.linear.v_waited:
                return Prediction(s.time, s.energy)
            if is_calm and value < body.linear.settled:
                off = subtract(s.position, leg.path.end)
                rest = fly_hover(
                    HoverLeg(
                        offset=off,
                        velocity=s.velocity,
                        wind=leg.wind,
                        heading=leg.stand,
                        learnt=leg.learnt,
                        speed=leg.speed,
                        acceptance=leg.acceptance,
                    ),
                    body,
                )
                return Prediction(s.time + rest.time, s.energy + rest.energy)
    return Prediction(math.inf, math.inf)


@kernel
def _begun(leg: WingLeg, body: PointMass) -> WingMotion:
    """In the hover, the alignment done, or in the cruise."""
    none, belly = Vector(0.0, 0.0, 0.0), level(leg.heading)
    cruising = Vector(_cruise_speed(leg), 0.0, 0.0)
    waited = leg.waiting if leg.begin else 0.0
    energy = waited * steady_power(scaled(leg.wind, -1.0), belly, body.airframe)
    v = none if leg.begin else cruising
    return WingMotion(
        position=none,
        velocity=v,
        wanted=none,
        acceleration=none,
        integral=none,
        ahead=belly,
        heading=leg.heading,
        travel=0.0,
        is_braking=leg.upright,
        has_arrived=False,
        time=waited,
        energy=energy,
    )


@kernel
def _cruise_speed(leg: WingLeg) -> float:
    """Over the ground along the leg, at its airspeed [m/s]."""
    airspeed, across = leg.path.airspeed, leg.wind.y
    return leg.wind.x + math.sqrt(max(airspeed * airspeed - across * across, 4.0))


@kernel
def _guided(s: WingMotion, leg: WingLeg, share: float, body: PointMass) -> WingMotion:
    """The guidance's set-point, and the attitude's response to it; ``share``: of a change, in a step."""
    p, v, gains, path = s.position, s.velocity, body.guidance, leg.path
    flown = MotionInAir(p, v, leg.wind)
    is_braking = s.is_braking or (leg.end and stop_within(flown, path, 1.0, gains))
    if is_braking:
        asked, integral = brake(flown, Stop(path, leg.speed), s.travel, s.integral, PREDICTION_STEP, gains)
        turn = clipped(wrapped(leg.stand - s.heading), -TURN_RATE * PREDICTION_STEP, TURN_RATE * PREDICTION_STEP)
        heading = s.heading + (turn if level_norm(v.x, v.y) < TURN_BELOW else 0.0)
    else:
        asked, integral = cruise(flown, path, s.integral, PREDICTION_STEP, gains)
        heading = arctangent(v.y - leg.wind.y, max(v.x - leg.wind.x, 1.0))
    wanted = add(s.wanted, shortened(subtract(asked, s.wanted), gains.max_jerk * PREDICTION_STEP))
    wanted = Vector(wanted.x, wanted.y, clipped(wanted.z, -gains.max_down, gains.max_up))
    acceleration = add_scaled(s.acceleration, subtract(wanted, s.acceleration), share)
    ahead = looking_ahead(heading, subtract(v, leg.wind), body.blend_from, body.blend_to)
    return WingMotion(
        position=p,
        velocity=v,
        wanted=wanted,
        acceleration=acceleration,
        integral=integral,
        ahead=ahead,
        heading=heading,
        travel=s.travel,
        is_braking=is_braking,
        has_arrived=s.has_arrived,
        time=s.time,
        energy=s.energy,
    )


@kernel
def _moved(s: WingMotion, leg: WingLeg, body: PointMass) -> WingMotion:
    """One step of the motion."""
    a, v = body.airframe, s.velocity
    push = pushed(s.acceleration, subtract(v, leg.wind), s.ahead, a)
    p = add_scaled(s.position, add_scaled(v, push.acceleration, 0.5 * PREDICTION_STEP), PREDICTION_STEP)
    travel = min(abs(push.elevons) / a.delta_max, 1.0)
    return WingMotion(
        position=p,
        velocity=add_scaled(v, push.acceleration, PREDICTION_STEP),
        wanted=s.wanted,
        acceleration=s.acceleration,
        integral=s.integral,
        ahead=s.ahead,
        heading=s.heading,
        travel=travel,
        is_braking=s.is_braking,
        has_arrived=s.has_arrived,
        time=s.time + PREDICTION_STEP,
        energy=s.energy + push.power * PREDICTION_STEP,
    )


@kernel
def _continued(s: WingMotion, leg: WingLeg, body: PointMass) -> WingMotion:
    """A flight that is steady goes on as it is until something changes; and whether it has been at the end by then."""
    p, v, integral, time, energy = s.position, s.velocity, s.integral, s.time, s.energy
    if s.is_braking == leg.upright and norm(s.acceleration) < STEADY:
        if leg.upright:
            rest = _creeping(subtract(p, leg.path.end), v)
        else:
            # The linear law flies it, which holds the airspeed.
            v, integral = Vector(_cruise_speed(leg), v.y, v.z), Vector(0.0, 0.0, 0.0)
            rest = _straight(p, v, leg, body.guidance)
        p, time = add_scaled(p, v, rest), time + rest
        energy += rest * steady_power(subtract(v, leg.wind), s.ahead, body.airframe)
    has_arrived = s.has_arrived or (leg.end and norm(subtract(p, leg.path.end)) <= leg.acceptance)
    return WingMotion(
        position=p,
        velocity=v,
        wanted=s.wanted,
        acceleration=s.acceleration,
        integral=integral,
        ahead=s.ahead,
        heading=s.heading,
        travel=s.travel,
        is_braking=s.is_braking,
        has_arrived=has_arrived,
        time=time,
        energy=energy,
    )


@kernel
def _creeping(off: Vector, v: Vector) -> float:
    """Time for which a vehicle that rides the wind goes on as it is [s]."""
    distance = level_norm(off.x, off.y)
    closing = -(off.x * v.x + off.y * v.y) / max(distance, 1e-6)
    creeps = closing > MIN_CREEP and abs(v.z) < STEADY
    return max(distance - STOP_ROOM, 0.0) / closing if creeps else 0.0


@kernel
def _straight(p: Vector, v: Vector, leg: WingLeg, gains: GuidanceGains) -> float:
    """Time for which a steady cruise goes on as it is: until the leg's level end, or shortly before its braking [s]."""
    path = leg.path
    along, length, _ = progress(path, p)
    close = path.level if along < length - path.level else 0.0
    if path.stop:
        close = max(close, EARLY * stopping_distance(v.x, leg.wind.x, leg.wind.y, gains))
    return max(length - close - along, 0.0) / max(v.x, 1.0)


@kernel
def _value(s: WingMotion, leg: WingLeg, body: PointMass) -> float:
    """V of the linear hover law about the end."""
    a = body.airframe
    force = add_scaled(weight(a), s.acceleration, a.m)
    nose = equilibrium(force, subtract(s.velocity, leg.wind), s.ahead, a).nose
    return hover_value(subtract(s.position, leg.path.end), s.velocity, nose, leg.stand, s.heading, body.linear)
