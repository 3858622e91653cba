"""One leg under INDI, upright or forward, flown by a point mass: the law has no mode, so one prediction does for both.

The acceleration is what the law's own guidance asks for (:mod:`sitl.control.indi_guidance`), late by the attitude's
lag; attitude, thrust and elevons are those of :mod:`sitl.prediction.equilibrium`. A steady flight is not stepped
through but continued to where something changes.
"""

import math
from functools import lru_cache
from typing import NamedTuple

from sitl.compiled import entry, kernel
from sitl.control.estimate import Ages, Estimate
from sitl.control.indi import EDGE_ON, turned_course
from sitl.control.indi_guidance import IndiGuidanceGains, stopping_distance, turns_edge_on, wanted_acceleration
from sitl.control.reference import CIRCLE, Path, Reference, progress
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped, exponential
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, add_scaled, level_norm, norm, shortened, subtract
from sitl.prediction.equilibrium import level, looking_ahead, pushed, steady_power
from sitl.prediction.forward_leg import EARLY
from sitl.prediction.hover_leg import MAX_PREDICTION_STEPS, PREDICTION_STEP, STEADY
from sitl.prediction.passing import Passing, first_passing, is_passed, passed_on
from sitl.prediction.point_mass import Prediction
from sitl.simulation.tuning import Tuning, designed
from sitl.supervisor.guards import STANDING_SPEED

MIN_CONTINUED = 0.5  # slower than this, nothing is continued [m/s]


class IndiPointMass(NamedTuple):
    """The airframe with INDI, as a point mass whose attitude is in equilibrium."""

    airframe: Airframe
    guidance: IndiGuidanceGains
    lag: float  # of the attitude [s]
    course_rate: float  # at which the belly turns without airspeed [rad/s]
    blend_from: float  # airspeeds between which the heading gives way to the air stream [m/s]
    blend_to: float


class IndiLeg(NamedTuple):
    """Inputs of the prediction."""

    reference: Reference  # a position to hover at, or a path to fly
    wind: Vector  # [m/s]
    position: Vector  # where it begins [m]
    velocity: Vector  # there [m/s]
    course: float  # of the belly there [rad]
    acceptance: float  # distance to the end that counts as arrived [m]
    end: bool  # whether it ends in the hover, else flies past its end
    early: float  # so far before that it is past it [m]
    reach: float  # so far beside it at most [m]
    exit: float  # airspeed there at most [m/s]
    slowing: float  # so far before it the vehicle slows down to that [m]


class IndiMotion(NamedTuple):
    """State of the flight."""

    position: Vector  # [m]
    velocity: Vector  # [m/s]
    wanted: Vector  # acceleration that the guidance asks for, its jerk limited [m/s2]
    acceleration: Vector  # the same, late by the attitude's lag [m/s2]
    course: float  # of the belly [rad]
    ahead: Vector  # where the belly points, level
    elevon: float  # of both [rad]
    time: float  # [s]
    energy: float  # [J]


@lru_cache(maxsize=8)
def indi_point_mass(a: Airframe, tuning: Tuning) -> IndiPointMass:
    """The point mass of a design; arguments as for :func:`sitl.prediction.point_mass.point_mass`."""
    gains = designed(a, tuning).gains.indi
    return IndiPointMass(
        airframe=a,
        guidance=gains.guidance,
        lag=1.0 / gains.rate.y,  # the rest is fed forward
        course_rate=gains.course_rate,
        blend_from=gains.blend_from,
        blend_to=gains.blend_to,
    )


@entry
def fly_indi(leg: IndiLeg, body: IndiPointMass) -> Prediction:
    """Time and energy of a leg under INDI, infinite if it never arrives.

    Args:
        leg: To be flown.
        body: What flies.
    """
    share, none = 1.0 - exponential(-PREDICTION_STEP / body.lag), Vector(0.0, 0.0, 0.0)
    s = IndiMotion(leg.position, leg.velocity, none, none, leg.course, level(leg.course), 0.0, 0.0, 0.0)
    passing = first_passing(leg.reference.path, leg.early)
    for _ in range(MAX_PREDICTION_STEPS):
        if not leg.end:
            passing = passed_on(passing, s.position, s.velocity, leg.reference.path, leg.wind, leg.reach)
            if is_passed(passing, s.position, leg.reach):
                return Prediction(s.time, s.energy)
        now = _along(leg, passing, s.position)
        s = _continued(_moved(_guided(s, now, share, body), now, body), now, body)
        off = norm(subtract(s.position, leg.reference.position))
        if leg.end and off <= leg.acceptance and norm(s.velocity) < STANDING_SPEED:
            return Prediction(s.time, s.energy)
    return Prediction(math.inf, math.inf)


@kernel
def _along(leg: IndiLeg, passing: Passing, p: Vector) -> IndiLeg:
    """The leg by the path that is followed now, as fast as that is flown at a position."""
    r, path = leg.reference, passing.path
    reference = Reference(
        position=r.position,
        heading=r.heading,
        speed=r.speed,
        forward=r.forward,
        path=Path(
            kind=path.kind,
            start=path.start,
            end=path.end,
            airspeed=_slowed(leg, path, p),
            stop=path.stop,
            level=path.level,
            low=path.low,
            radius=path.radius,
        ),
        steered=r.steered,
        attitude=r.attitude,
    )
    return IndiLeg(
        reference=reference,
        wind=leg.wind,
        position=leg.position,
        velocity=leg.velocity,
        course=leg.course,
        acceptance=leg.acceptance,
        end=leg.end,
        early=passing.early,
        reach=leg.reach,
        exit=leg.exit,
        slowing=leg.slowing,
    )


@kernel
def _slowed(leg: IndiLeg, path: Path, p: Vector) -> float:
    """Airspeed from which an even deceleration leads to that at the end [m/s]."""
    if path.kind == CIRCLE or leg.slowing <= 0.0:
        return path.airspeed
    along, length, _ = progress(path, p)
    left = clipped((length - along - leg.early) / leg.slowing, 0.0, 1.0)
    return math.sqrt(leg.exit * leg.exit + left * (path.airspeed * path.airspeed - leg.exit * leg.exit))


@kernel
def _guided(s: IndiMotion, leg: IndiLeg, share: float, body: IndiPointMass) -> IndiMotion:
    """The guidance's set-point, and the attitude's response to it; ``share``: of a change, in a step."""
    estimate, gains = _believed(s, leg.wind), body.guidance
    edge_on = turns_edge_on(estimate, leg.reference, gains)
    raised = EDGE_ON if edge_on else 0.0
    course = turned_course(s.course, estimate, leg.reference, edge_on, body.course_rate * PREDICTION_STEP)
    asked = wanted_acceleration(estimate, s.velocity, leg.reference, course, gains, body.airframe)
    wanted = add(s.wanted, shortened(subtract(asked, s.wanted), gains.max_jerk * PREDICTION_STEP))
    return IndiMotion(
        position=s.position,
        velocity=s.velocity,
        wanted=wanted,
        acceleration=add_scaled(s.acceleration, subtract(wanted, s.acceleration), share),
        course=course,
        ahead=looking_ahead(course, subtract(s.velocity, leg.wind), body.blend_from + raised, body.blend_to + raised),
        elevon=s.elevon,
        time=s.time,
        energy=s.energy,
    )


@kernel
def _believed(s: IndiMotion, wind: Vector) -> Estimate:
    """An estimate for the guidance, which looks at neither attitude nor rates."""
    none = Vector(0.0, 0.0, 0.0)
    return Estimate(
        position=s.position,
        velocity=s.velocity,
        acceleration=s.acceleration,
        attitude=Quaternion(1.0, 0.0, 0.0, 0.0),
        rates=none,
        wind=wind,
        actuators=Actuators(0.0, 0.0, s.elevon, s.elevon),
        on_ground=False,
        age=Ages(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    )


@kernel
def _moved(s: IndiMotion, leg: IndiLeg, body: IndiPointMass) -> IndiMotion:
    """One step of the motion."""
    a, v = body.airframe, s.velocity
    push = pushed(s.acceleration, subtract(v, leg.wind), s.ahead, a)
    return IndiMotion(
        position=add_scaled(s.position, add_scaled(v, push.acceleration, 0.5 * PREDICTION_STEP), PREDICTION_STEP),
        velocity=add_scaled(v, push.acceleration, PREDICTION_STEP),
        wanted=s.wanted,
        acceleration=s.acceleration,
        course=s.course,
        ahead=s.ahead,
        elevon=clipped(push.elevons, -a.delta_max, a.delta_max),
        time=s.time + PREDICTION_STEP,
        energy=s.energy + push.power * PREDICTION_STEP,
    )


@kernel
def _continued(s: IndiMotion, leg: IndiLeg, body: IndiPointMass) -> IndiMotion:
    """A flight that is steady goes on as it is until something changes."""
    rest = _steady_time(s, leg, body.guidance) if norm(s.acceleration) < STEADY else 0.0
    if rest <= 0.0:
        return s
    return IndiMotion(
        position=add_scaled(s.position, s.velocity, rest),
        velocity=s.velocity,
        wanted=s.wanted,
        acceleration=s.acceleration,
        course=s.course,
        ahead=s.ahead,
        elevon=s.elevon,
        time=s.time + rest,
        energy=s.energy + rest * steady_power(subtract(s.velocity, leg.wind), s.ahead, body.airframe),
    )


@kernel
def _steady_time(s: IndiMotion, leg: IndiLeg, gains: IndiGuidanceGains) -> float:
    """Time until the path's level end, or shortly before the braking; none while a hover climbs [s]."""
    p, v, path, end = s.position, s.velocity, leg.reference.path, leg.reference.position
    distance, speed = level_norm(end.x - p.x, end.y - p.y), level_norm(v.x, v.y)
    close = EARLY * stopping_distance(speed, gains) + speed if leg.end else 0.0
    if leg.reference.forward:
        along, length, _ = progress(path, p)
        close = max(close, path.level if along < length - path.level else 0.0, leg.early + leg.slowing)
        distance = length - along
    climbs = abs(v.z) >= STEADY and not leg.reference.forward
    return 0.0 if speed < MIN_CONTINUED or climbs else max(distance - close, 0.0) / speed
