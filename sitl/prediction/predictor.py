"""Time and energy of a leg in the hover and in forward flight, as the autopilot would have it flown."""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.control.reference import APPROACH_SPEED, Path, along, hover_at
from sitl.control.reference import leg as straight
from sitl.guidance.leg_speeds import MAX_CORNER_SHARE, braking_distance, corner_cut, speed_along
from sitl.guidance.legs import crosswind_heading, leg_reference
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import arctangent, exponential, sine_cosine, wrapped
from sitl.model.vectors import Vector, level_norm
from sitl.prediction.corners import FlyingOn, Leg, flying_on
from sitl.prediction.equilibrium import wind_force
from sitl.prediction.forward_leg import WingLeg, fly_wing
from sitl.prediction.hover_leg import HoverLeg, fly_hover
from sitl.prediction.indi_leg import IndiLeg, fly_indi, indi_point_mass
from sitl.prediction.point_mass import IMPOSSIBLE, Prediction, point_mass
from sitl.simulation.tuning import Tuning, uses_indi
from sitl.supervisor.guards import ALIGNED_ANGLE, DWELL, STRONG_HOVER_WIND

ACCEPTANCE = 0.5  # a leg ends this near its point [m]
MIN_PROGRESS = 2.0  # over the ground, less is no way to fly [m/s]
HIGH = 100.0  # of a leg whose height is not known [m]
ORIGIN = (0.0, 0.0, 0.0)


class Abilities(NamedTuple):
    """Abilities of the vehicle, as the prediction needs them."""

    airframe: Airframe  # that the laws are designed for
    tuning: Tuning  # of the laws, as it is now
    can_fly_forward: bool
    hover_speed: float  # [m/s]
    airspeed: float  # of the cruise [m/s]
    deadline: float = 0.0  # of a leg [s]; 0: none


def predict_hover(leg: Leg, abilities: Abilities) -> Prediction:
    """The leg flown upright, the heading kept as it is, or under INDI the span in the wind."""
    if uses_indi(abilities.tuning):
        return _indi_hover(leg, abilities)
    body, wind, heading = point_mass(abilities.airframe, abilities.tuning), _wind(leg), float(-leg.turn)
    learnt = wind_force(wind, heading, body.airframe)
    if level_norm(wind.x, wind.y) > STRONG_HOVER_WIND:
        path = straight(ORIGIN, (leg.distance, 0.0, leg.climb), APPROACH_SPEED)
        path = path._replace(start=path.end)
        speed = float(abilities.hover_speed)
        return fly_wing(
            WingLeg(
                path=path,
                wind=wind,
                waiting=DWELL,
                learnt=learnt,
                heading=heading,
                stand=heading,
                acceptance=ACCEPTANCE,
                speed=speed,
                begin=True,
                end=True,
                upright=True,
            ),
            body,
        )
    start, still = Vector(float(-leg.distance), 0.0, float(-leg.climb)), Vector(0.0, 0.0, 0.0)
    return fly_hover(
        HoverLeg(
            offset=start,
            velocity=still,
            wind=wind,
            heading=heading,
            learnt=learnt,
            speed=float(abilities.hover_speed),
            acceptance=ACCEPTANCE,
        ),
        body,
    )


def predict_forward(
    leg: Leg, abilities: Abilities, *, begin: bool = True, end: bool = True, row: FlyingOn | None = None
) -> Prediction:
    """The leg flown forward.

    Args:
        leg: The leg.
        abilities: What the vehicle can do.
        begin: Whether it begins in the hover (else in forward flight on the course before its turn).
        end: Whether it ends in the hover.
        row: Its flight among others; None: after a leg as long as itself, and before one straight ahead.
    """
    # Across a wind a share of the airspeed is needed to stay on the leg.
    ahead = abilities.airspeed * abilities.airspeed - leg.cross_wind * leg.cross_wind
    if ahead <= 0.0 or math.sqrt(ahead) + leg.tail_wind < MIN_PROGRESS:
        return IMPOSSIBLE
    wind = _wind(leg)
    row = _row(leg, abilities.airspeed, row, begin=begin, end=end)
    path = _as_flown(leg, row.airspeed, end=end)
    if uses_indi(abilities.tuning):
        return _indi_forward(leg, abilities, path, row, begin=begin, end=end)
    body = point_mass(abilities.airframe, abilities.tuning)
    crab = arctangent(-wind.y, math.sqrt(max(path.airspeed * path.airspeed - wind.y * wind.y, 0.0)))
    waiting = DWELL + alignment(leg.turn + crab, body.turn)
    stand = float(crosswind_heading(0.0, wind))
    # The integral holds what it learnt where the leg began; without one the offset that a wind leaves is not predicted.
    learnt = wind_force(wind, float(-leg.turn) if body.linear.k_i != 0.0 else stand, body.airframe)
    speed = float(abilities.hover_speed)
    return fly_wing(
        WingLeg(
            path=path,
            wind=wind,
            waiting=waiting,
            learnt=learnt,
            heading=0.0,
            stand=stand,
            acceptance=ACCEPTANCE,
            speed=speed,
            begin=begin,
            end=end,
            upright=False,
        ),
        body,
    )


def _indi_hover(leg: Leg, abilities: Abilities) -> Prediction:
    wind, end = _wind(leg), (float(leg.distance), 0.0, float(leg.climb))
    heading = float(crosswind_heading(float(-leg.turn), wind))
    flown = IndiLeg(
        reference=hover_at(end, heading, float(abilities.hover_speed)),
        wind=wind,
        position=Vector(0.0, 0.0, 0.0),
        velocity=Vector(0.0, 0.0, 0.0),
        course=heading,
        acceptance=ACCEPTANCE,
        end=True,
        early=0.0,
        reach=math.inf,
        exit=math.inf,
        slowing=0.0,
    )
    return fly_indi(flown, indi_point_mass(abilities.airframe, abilities.tuning))


def _indi_forward(leg: Leg, abilities: Abilities, path: Path, row: FlyingOn, *, begin: bool, end: bool) -> Prediction:
    wind, goal = _wind(leg), (float(leg.distance), 0.0, float(leg.climb))
    stand = float(crosswind_heading(0.0, wind))
    position = velocity = Vector(0.0, 0.0, 0.0)
    course = float(-leg.turn)
    if not begin:  # on the course before the turn, over the ground
        sine, cosine = sine_cosine(course)
        before = (-cosine, -sine, 0.0)
        speed = speed_along(before, ORIGIN, min(path.airspeed, row.entry), wind)
        position = Vector(float(-row.lead * cosine), float(-row.lead * sine), 0.0)
        velocity = Vector(float(speed * cosine), float(speed * sine), 0.0)
        course = arctangent(velocity.y - wind.y, velocity.x - wind.x)
    slow = path.airspeed if end else min(path.airspeed, row.exit)
    slowing = braking_distance(path.airspeed, (ORIGIN, goal), wind) - braking_distance(slow, (ORIGIN, goal), wind)
    flown = IndiLeg(
        reference=along(hover_at(goal, stand, float(abilities.hover_speed)), path, stand),
        wind=wind,
        position=position,
        velocity=velocity,
        course=course,
        acceptance=ACCEPTANCE,
        end=end,
        early=float(row.early),
        reach=float(max(corner_cut(speed_along(ORIGIN, goal, slow, wind)), ACCEPTANCE)),
        exit=float(slow),
        slowing=float(slowing),
    )
    return fly_indi(flown, indi_point_mass(abilities.airframe, abilities.tuning))


def _row(leg: Leg, airspeed: float, row: FlyingOn | None, *, begin: bool, end: bool) -> FlyingOn:
    """The flight of a leg that may end at rest, or begin so, where its row would not."""
    if row is not None and not end:
        return row
    most = MAX_CORNER_SHARE * leg.distance if row is None else row.lead
    return flying_on([leg], airspeed, lead=None if begin else most, is_long=not end)[0]


def alignment(turn: float, bandwidth: float) -> float:
    """Time of turning by an angle to within the alignment's tolerance [s], under psi' = -k sin(psi / 2).

    Args:
        turn: The angle [rad].
        bandwidth: The k of the law [rad/s]; the law that has none never turns.
    """
    turn = abs(wrapped(turn))
    if turn <= ALIGNED_ANGLE:
        return 0.0
    if bandwidth <= 0.0:
        return math.inf
    return 2.0 / bandwidth * _logarithm(_tangent(0.25 * turn) / _tangent(0.25 * ALIGNED_ANGLE))


def _wind(leg: Leg) -> Vector:
    return Vector(float(leg.tail_wind), float(leg.cross_wind), 0.0)


def _as_flown(leg: Leg, airspeed: float, *, end: bool) -> Path:
    """The path that the autopilot makes of a leg, in the leg's frame."""
    height = leg.height if math.isfinite(leg.height) else HIGH
    start, stop = (0.0, 0.0, height + max(-leg.climb, 0.0)), (leg.distance, 0.0, height + max(leg.climb, 0.0))
    flown = leg_reference(start, stop, hover_at(stop, 0.0, 0.0), airspeed, stop=end).path
    return straight(ORIGIN, (leg.distance, 0.0, leg.climb), airspeed, stop=end, level=flown.level, low=flown.low)


def _tangent(angle: float) -> float:
    sine, cosine = sine_cosine(angle)
    return sine / cosine


def _logarithm(x: float) -> float:
    """Natural logarithm, by Halley's method on the exponential; for x between 1 and 20."""
    y = 0.0
    for _ in range(5):
        power = exponential(y)
        y += 2.0 * (x - power) / (x + power)
    return y
