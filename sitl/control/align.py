"""Law that holds a place and turns the belly to where the path leads, before the transition to forward flight."""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.allocation import allocate
from sitl.control.estimate import Estimate, air_ahead
from sitl.control.forward_flight.forward_guidance import air_course
from sitl.control.hover_zero_moment import HoverGoal, Pointing, ZeroMomentGains, fly_to
from sitl.control.reference import Reference
from sitl.model.airframe import Airframe
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add_scaled

HOLD_AHEAD = 0.5  # the place is where the vehicle would be this much later [s]


class AlignState(NamedTuple):
    """State slots of the law."""

    pointing: Pointing  # of the zero-moment law
    hold: Vector  # the place to hold, world NWU [m]
    course: float  # azimuth the belly was to point to [rad]


@kernel
def start_hold(estimate: Estimate) -> Vector:
    """Jump map on entering the law: the place to hold, world NWU [m]."""
    return add_scaled(estimate.position, estimate.velocity, HOLD_AHEAD)


@kernel
def step(
    estimate: Estimate,
    reference: Reference,
    gains: ZeroMomentGains,
    a: Airframe,
    state: AlignState,
    dt: float,
) -> tuple[Actuators, int, AlignState]:
    """One tick: actuator commands, DARKO_SATURATION bits, and the state after it.

    Args:
        estimate: The state as it is believed to be.
        reference: Its path is what the belly turns to.
        gains: Gains of the zero-moment law.
        a: The airframe.
        state: The law's state.
        dt: Tick [s].
    """
    course = air_course(estimate, reference, state.course)
    u, pointing = fly_to(estimate, HoverGoal(state.hold, course, reference.speed), gains, state.pointing, dt)
    command, saturation = allocate(u, a, air_ahead(estimate))
    return command, saturation, AlignState(pointing, state.hold, course)
