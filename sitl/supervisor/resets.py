"""Reset maps: the state of the law that takes over starts without a step in what it commands.

A reset names the parts of the controller that it sets, and the guards that cannot hold right after it; its
parameters are passed by name. Every jump begins the timers anew besides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sitl.compiled import kernel
from sitl.control import align, handover, hover_attitude, hover_zero_moment, indi, robust_pi
from sitl.control.attitude_loop import NOT_CHOSEN
from sitl.control.estimate import Estimate
from sitl.control.forward_flight import line_of_sight
from sitl.control.forward_flight.line_of_sight import LineOfSight
from sitl.control.handover import Handover
from sitl.control.hover_attitude import AttitudeGains, Steering
from sitl.control.hover_zero_moment import Pointing, ZeroMomentGains
from sitl.control.indi import IndiState
from sitl.control.landed import CARRIED
from sitl.control.robust_pi import RobustPiGains, RobustPiState
from sitl.model.airframe import Airframe
from sitl.model.vectors import Vector
from sitl.supervisor.guards import (
    Guard,
    armed,
    attitude_diverged,
    caught,
    dwell_elapsed,
    flight_requested,
    resting,
    sliding,
    v_below_enter,
)

LET_GO_TIME = 1.0  # a tilt that was commanded is flown off by the zero-moment law so long [s]


@dataclass(frozen=True)
class Reset:
    """One reset map."""

    name: str
    sets: tuple[str, ...]  # fields of the controller or slots of the laws
    map: Callable[..., object]  # compiled; gives one value for one field, a tuple for several
    clears: tuple[Guard, ...] = ()  # guards that do not hold right after it


def reset(*sets: str, clears: tuple[Guard, ...] = ()) -> Callable[[Callable[..., object]], Reset]:
    """Make a reset map of a function of named parts."""
    return lambda function: Reset(function.__name__, sets, kernel(function), clears)


@reset("pointing")
def point_from_here(estimate: Estimate, zero_moment_gains: ZeroMomentGains, a: Airframe) -> Pointing:
    """The zero-moment law begins at the attitude and with the force there is."""
    return hover_zero_moment.start(estimate, zero_moment_gains, a)


@reset("steering", "handover", clears=(attitude_diverged,))
def steering_from_here(
    estimate: Estimate, hover_attitude_gains: AttitudeGains, a: Airframe
) -> tuple[Steering, Handover]:
    """The attitude law's reference begins where the vehicle is."""
    return hover_attitude.start(estimate, hover_attitude_gains, a), handover.requested()


@reset("handover", "inhibited", clears=(v_below_enter,))
def level_first(estimate: Estimate) -> tuple[Handover, float]:  # noqa: ARG001 - a reset map of the estimate like others
    """A commanded tilt is flown off: V may be small with it, but the linear law has to wait for it to be gone."""
    return handover.requested(), LET_GO_TIME


@reset("hold")
def hold_here(estimate: Estimate) -> Vector:
    """The alignment stays where the vehicle comes to rest."""
    return align.start_hold(estimate)


@reset("sight")
def sight_from_here(estimate: Estimate, a: Airframe) -> LineOfSight:
    """The line-of-sight law begins from the attitude as it is, with nothing accumulated."""
    return line_of_sight.start(estimate, a)


@reset("increment")
def increment_from_here(estimate: Estimate, a: Airframe) -> IndiState:
    """INDI begins from the attitude as it is, with nothing unmodelled."""
    return indi.start(estimate, a)


@reset("robust_pi")
def robust_pi_from_here(estimate: Estimate, robust_pi_gains: RobustPiGains) -> RobustPiState:
    """The robust PI law begins where the vehicle is, with the thrust and the elevons there are."""
    return robust_pi.start(estimate, robust_pi_gains)


@reset("is_flying", "integral", clears=(flight_requested,))
def landed(estimate: Estimate) -> tuple[bool, Vector]:  # noqa: ARG001
    """Flight is no longer requested, and the integral is cleared, which would push a standing vehicle over."""
    return False, Vector(0.0, 0.0, 0.0)


@reset("pointing")
def carry_weight(estimate: Estimate, zero_moment_gains: ZeroMomentGains) -> Pointing:
    """Most of the weight is carried: a law that catches a fast descent has let go of it by the time of the touch."""
    force = CARRIED * zero_moment_gains.m * zero_moment_gains.g
    return Pointing(estimate.attitude, force, NOT_CHOSEN, NOT_CHOSEN)


@reset("pointing")
def let_go(estimate: Estimate) -> Pointing:
    """Nothing is carried: the elevons stay straight."""
    return Pointing(estimate.attitude, 0.0, NOT_CHOSEN, NOT_CHOSEN)


@reset("is_armed", "is_flying", "integral", clears=(armed, flight_requested))
def broken(estimate: Estimate) -> tuple[bool, bool, Vector]:  # noqa: ARG001
    """Motors off, and nothing is wanted any more."""
    return False, False, Vector(0.0, 0.0, 0.0)


@reset("law_time", "at_rest", "inhibited", "handover", "side", clears=(caught, dwell_elapsed, resting, sliding))
def begin_anew(estimate: Estimate) -> tuple[float, float, float, Handover, float]:  # noqa: ARG001
    """Part of every jump: timers begin at zero, what was handed over is forgotten, and the nearer side is taken."""
    return 0.0, 0.0, 0.0, handover.none(), NOT_CHOSEN
