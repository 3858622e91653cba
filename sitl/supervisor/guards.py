"""The guards: each one inequality of the estimate, the reference or the controller, defined here and nowhere else.

A guard's docstring is its meaning, its parameters are what it looks at; the compiled loop passes them by name. The
table of jumps is written in these objects, so flow sets and jump sets are one statement.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.estimate import Estimate
from sitl.control.forward_flight.forward_guidance import GuidanceGains, due_to_stop
from sitl.control.indi import IndiState
from sitl.control.reference import LEG, Reference
from sitl.model.arithmetic import sine_cosine
from sitl.model.quaternions import conjugate, multiply, x_axis, z_axis
from sitl.model.vectors import Vector, level_norm, norm, subtract

DWELL = 0.5  # [s]
WING_SPEED = 8.0  # the wing carries from this airspeed on, or from most of the wanted one [m/s]
WING_SPEED_RATIO = 0.85
MIN_TRANSITION_LEG = 15.0  # less than this of a leg is not worth a transition [m]
LYAPUNOV_PATIENCE = 10.0  # in calm the zero-moment law comes below v_enter sooner: within 8 s in 100 recoveries [s]
BRAKING_MARGIN = 2.0  # braking distances that make it worth flying on [-]
SLIDE_TIME, SLIDE_SPEED = 4.0, 4.0  # [s], [m/s]
STRONG_HOVER_WIND, CALM_WIND = 4.0, 3.0  # level wind [m/s]
# How upright: the vertical part of the nose's direction, 1 straight up [-].
NOSE_ABOVE_LEVEL = 0.0
STANDING_UPRIGHT = 0.3  # within 73 deg of straight up
TURNING_UPRIGHT = 0.5  # within 60 deg: the alignment can begin
UPRIGHT = 0.7  # within 46 deg
STEADY_UPRIGHT = 0.9  # within 26 deg
TURNING_SPEED = 3.5  # the alignment begins below this [m/s]
ALIGNED_SPEED = 2.5  # [m/s]
ALIGNED_ANGLE = math.radians(12.0)
ALIGNED_COSINE = 0.97814760073380563793  # of that angle
ALIGNING_PATIENCE = 10.0  # half a turn takes 6 s; a wind from behind may hold the belly aside for ever [s]
RECOVERED_RATE = 1.0  # [rad/s]
CAUGHT_TIME = 2.0  # [s]
STANDING_SPEED = 2.0  # [m/s]
MAX_SINK = 14.0  # no law sinks faster than this for long [m/s]
GROUND_TIME = 0.8  # nearer to the ground than this at the present sink rate, a fall is caught [s]
SINK = 3.0  # sinking faster than this counts as a fall there [m/s]
# INDI gives way to the law that catches falls where the vehicle does what it never asks for: it sinks at 2.5 m/s at
# most. Where a wing carries, in a strong wind too, it turns much, and catches itself.
UNCARRIED = 7.0  # slower through the air than this, level [m/s]
UNCARRIED_SINK, CARRIED_SINK = 4.0, 6.5  # [m/s]
SPIN = 7.0  # [rad/s]
TURNED_AWAY = 0.7  # cosine of half the angle from the attitude wanted [-]
TURNED_SINK, TURNED_RATE = 2.0, 3.0  # while that far from it [m/s], [rad/s]
DIVERGED_ATTITUDE = 0.3  # W, the V of the attitude law, when it is 45 deg off at rest [rad2]
# A vehicle that lands is let go as soon as its tail stands: what the laws do about the ground would bounce it.
REST_TIME = 0.04  # on the ground this long is landed [s]
# Near the height where flights begin the ground is likely; far above it a gust is, and it is not let go so soon.
GROUND_HEIGHT, GROUND_REST_TIME = 0.6, 0.02  # [m], [s]
HILL_HEIGHT, HILL_REST_TIME = 4.0, 1.0  # [m], [s]
HILL_SLOPE, MAX_HILL_RISE = 0.1, 8.0  # away from there the ground may be this much higher [-], [m]
LEANING, LEANING_TIME = 0.93, 0.3  # what leans by more than 22 deg may yet stand up by the law that flies [-], [s]
REST_SPEED = 0.6  # vertical speed that counts as rest there [m/s]


@kernel
def _may_be_ground(p: Vector) -> bool:
    """Whether a position, world NWU [m], is as low as the ground may be, which may rise away from home."""
    return p.z < HILL_HEIGHT + min(HILL_SLOPE * level_norm(p.x, p.y), MAX_HILL_RISE)


class Thresholds(NamedTuple):
    """Switching thresholds of the supervisor: the hysteresis of the two linear laws."""

    v_enter: float  # the linear hover law is entered below, and left above
    v_leave: float
    v_waited: float  # it is entered below this, too, by a law that has been in force for LYAPUNOV_PATIENCE
    v_settled: float  # TO_HOVER hands over to it below this
    v_forward_enter: float  # the linear forward law likewise
    v_forward_leave: float
    single_law: bool  # a hover law is flown alone, whatever comes of it: no wind, slide or fall ends it
    use_indi: bool  # INDI is to fly wherever no other law is better
    indi_alone: bool  # and where one is, too
    use_robust_pi: bool  # the robust PI law is to hover


@dataclass(frozen=True)
class Guard:
    """A predicate of the supervisor."""

    name: str
    meaning: str
    bit: int
    test: Callable[..., bool]  # compiled; parameters by name


GUARDS: list[Guard] = []


def guard(function: Callable[..., bool]) -> Guard:
    """Register a predicate as the next guard."""
    meaning = " ".join((function.__doc__ or "").split())
    made = Guard(function.__name__.rstrip("_"), meaning, 1 << len(GUARDS), kernel(function))
    GUARDS.append(made)
    return made


@guard
def armed(is_armed: bool) -> bool:
    """The motors may turn."""
    return is_armed


@guard
def flight_requested(is_flying: bool) -> bool:
    """The autopilot wants to be in the air."""
    return is_flying


@guard
def resting(at_rest: float, estimate: Estimate) -> bool:
    """On the ground and no longer moving up or down: for a moment, or for longer where it leans or is high."""
    p = estimate.position
    usual = GROUND_REST_TIME if p.z < GROUND_HEIGHT else REST_TIME
    enough = usual if _may_be_ground(p) else HILL_REST_TIME
    return at_rest >= (max(enough, LEANING_TIME) if x_axis(estimate.attitude).z < LEANING else enough)


@guard
def v_below_enter(
    v_hover: float, v_integral: float, estimate: Estimate, thresholds: Thresholds, inhibited: float, law_time: float
) -> bool:
    """V of the linear hover law is below v_enter, or long below v_waited; the nose is up, no tilt is flown off."""
    # V does not see the sign of the quaternion's scalar part: it is as small with the nose straight down.
    is_upright = x_axis(estimate.attitude).z > NOSE_ABOVE_LEVEL and inhibited <= 0.0
    waited = law_time >= LYAPUNOV_PATIENCE and v_hover < thresholds.v_waited
    return (v_hover + v_integral < thresholds.v_enter or waited) and is_upright


@guard
def v_below_settled(v_hover: float, estimate: Estimate, thresholds: Thresholds, law_time: float) -> bool:
    """V of the linear hover law is below v_settled, or after a while below v_waited, and the nose is up."""
    # A steady wind holds V up: without the second threshold a transition may never end.
    enough = thresholds.v_settled if law_time < LYAPUNOV_PATIENCE else max(thresholds.v_settled, thresholds.v_waited)
    return v_hover < enough and x_axis(estimate.attitude).z > NOSE_ABOVE_LEVEL


@guard
def v_above_leave(v_hover: float, thresholds: Thresholds) -> bool:
    """V of the linear hover law is above v_leave."""
    return v_hover > thresholds.v_leave


@guard
def dwell_elapsed(law_time: float) -> bool:
    """The law has been in force for its dwell time."""
    return law_time >= DWELL


@guard
def wind_strong(estimate: Estimate, thresholds: Thresholds) -> bool:
    """There is more wind than laws without a wind estimate hover well in."""
    return not thresholds.single_law and level_norm(estimate.wind.x, estimate.wind.y) > STRONG_HOVER_WIND


@guard
def wind_calm(estimate: Estimate) -> bool:
    """There is clearly less wind than that."""
    return level_norm(estimate.wind.x, estimate.wind.y) < CALM_WIND


@guard
def upright_and_slow(estimate: Estimate) -> bool:
    """Upright and slow enough to begin the alignment."""
    return x_axis(estimate.attitude).z > TURNING_UPRIGHT and norm(estimate.velocity) < TURNING_SPEED


@guard
def recovered(estimate: Estimate) -> bool:
    """Upright, turning slowly and sinking slower than a fall: not on the way through some other attitude."""
    steady = x_axis(estimate.attitude).z > UPRIGHT and norm(estimate.rates) < RECOVERED_RATE
    return steady and -estimate.velocity.z < SINK


@guard
def caught(estimate: Estimate, law_time: float) -> bool:
    """For some time no fall any more, though it leans: in a strong wind it may never stand upright."""
    steady = norm(estimate.rates) < RECOVERED_RATE and -estimate.velocity.z < SINK
    return steady and law_time >= CAUGHT_TIME


@guard
def aligned(estimate: Estimate, course: float, law_time: float) -> bool:
    """Upright and slow, the belly towards the course, or as far as a wind has let it for ALIGNING_PATIENCE."""
    z_b = z_axis(estimate.attitude)
    s, c = sine_cosine(course)
    towards = -(z_b.x * c + z_b.y * s) > ALIGNED_COSINE * level_norm(z_b.x, z_b.y)
    ready = towards and x_axis(estimate.attitude).z > UPRIGHT and norm(estimate.velocity) < ALIGNED_SPEED
    return ready or law_time >= ALIGNING_PATIENCE


@guard
def standing(estimate: Estimate) -> bool:
    """Upright and nearly at rest: the transition is over."""
    return x_axis(estimate.attitude).z > STANDING_UPRIGHT and norm(estimate.velocity) < STANDING_SPEED


@guard
def sliding(estimate: Estimate, law_time: float, thresholds: Thresholds) -> bool:
    """An upright law moves fast and tilted by more than 26 deg, some time after it began."""
    tilted = x_axis(estimate.attitude).z < STEADY_UPRIGHT
    slides = law_time > SLIDE_TIME and norm(estimate.velocity) > SLIDE_SPEED and tilted
    return slides and not thresholds.single_law


@guard
def falling(estimate: Estimate, thresholds: Thresholds) -> bool:
    """Sinking faster than any law asks for, or too near the ground to go on so."""
    sink = -estimate.velocity.z
    low = estimate.position.z < GROUND_TIME * sink and sink > SINK
    return (sink > MAX_SINK or low) and not thresholds.single_law


@guard
def forward_requested(reference: Reference) -> bool:
    """Guidance wants the path flown forward."""
    return reference.forward


@guard
def leg_long_enough(estimate: Estimate, reference: Reference) -> bool:
    """Enough of the path is left for a transition."""
    path, p = reference.path, estimate.position
    to_go = level_norm(path.end.x - p.x, path.end.y - p.y)
    return path.kind != LEG or not path.stop or to_go > MIN_TRANSITION_LEG


@guard
def stop_due(estimate: Estimate, reference: Reference, guidance: GuidanceGains) -> bool:
    """The rest of the path is no longer than the braking distance."""
    return reference.forward and due_to_stop(estimate, reference.path, 1.0, guidance)


@guard
def has_stopping_distance(estimate: Estimate, reference: Reference, guidance: GuidanceGains) -> bool:
    """Far more than the braking distance is left of the path."""
    return reference.forward and not due_to_stop(estimate, reference.path, BRAKING_MARGIN, guidance)


@guard
def wing_borne(estimate: Estimate, reference: Reference) -> bool:
    """Fast enough for the wing to carry, which ends the front transition."""
    airspeed = norm(subtract(estimate.velocity, estimate.wind))
    return airspeed > min(WING_SPEED, WING_SPEED_RATIO * reference.path.airspeed)


@guard
def straight(reference: Reference) -> bool:
    """The path is a leg."""
    return reference.path.kind == LEG


@guard
def has_forward_linear(thresholds: Thresholds) -> bool:
    """The linear forward law is in use."""
    return thresholds.v_forward_enter > 0.0


@guard
def v_forward_below_enter(v_forward: float, thresholds: Thresholds) -> bool:
    """V of the linear forward law is below its entry threshold."""
    return v_forward < thresholds.v_forward_enter


@guard
def v_forward_above_leave(v_forward: float, thresholds: Thresholds) -> bool:
    """V of the linear forward law is above its exit threshold."""
    return v_forward > thresholds.v_forward_leave


@guard
def attitude_commanded(reference: Reference) -> bool:
    """Attitude set-points are coming."""
    return reference.steered


@guard
def attitude_diverged(v_attitude: float) -> bool:
    """The vehicle does not follow the commanded attitude."""
    return v_attitude > DIVERGED_ATTITUDE


@guard
def crashed(has_crashed: bool) -> bool:
    """The ground was hit too fast."""
    return has_crashed


@guard
def indi_chosen(thresholds: Thresholds) -> bool:
    """INDI is chosen to fly, alone or in the hybrid controller."""
    return thresholds.use_indi


@guard
def indi_alone(thresholds: Thresholds) -> bool:
    """INDI is chosen to fly whatever happens."""
    return thresholds.indi_alone


@guard
def out_of_hand(estimate: Estimate, increment: IndiState) -> bool:
    """Sinking faster than INDI asks for or, where no wing carries, turning or turned as it never asks for."""
    off = multiply(conjugate(increment.attitude), estimate.attitude)
    v, wind, sink = estimate.velocity, estimate.wind, -estimate.velocity.z
    if level_norm(v.x - wind.x, v.y - wind.y) >= UNCARRIED:
        return sink > CARRIED_SINK
    turning = norm(estimate.rates)
    is_turned = abs(off.w) < TURNED_AWAY and (sink > TURNED_SINK or turning > TURNED_RATE)
    return sink > UNCARRIED_SINK or turning > SPIN or is_turned


@guard
def robust_pi_chosen(thresholds: Thresholds) -> bool:
    """The robust PI law is chosen to hover."""
    return thresholds.use_robust_pi


@guard
def touching_down(is_landing: bool, estimate: Estimate) -> bool:
    """Landing, where the ground may be: the law that began the last way down ends it, as a change leans."""
    return is_landing and _may_be_ground(estimate.position)
