"""Bumpless transfer: a law that takes over begins where the actuators are, and lets the difference fade."""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.allocation import Virtual
from sitl.model.aerodynamics import thrusts
from sitl.model.airframe import Airframe
from sitl.model.state import Actuators

FADE = 0.15  # of the difference [s]
NEGLIGIBLE = 1e-12  # a difference is gone [N]; numbers that fade for ever slow the processor down


class Handover(NamedTuple):
    """State of the transfer."""

    pending: bool  # the difference is still to be found, at the next tick
    offset: Virtual  # what is added to the law's commands


@kernel
def none() -> Handover:
    """The law's commands are flown as they are."""
    return Handover(False, Virtual(0.0, 0.0, 0.0, 0.0))


@kernel
def requested() -> Handover:
    """The next tick begins where the actuators are."""
    return Handover(True, Virtual(0.0, 0.0, 0.0, 0.0))


@kernel
def smoothed(
    u: Virtual, in_force: Actuators, a: Airframe, handover: Handover, dt: float, inflow: float = 0.0
) -> tuple[Virtual, Handover]:
    """The virtual commands to be flown, and the transfer after ``dt``.

    Args:
        u: Virtual commands of the law.
        in_force: Motor speeds [rad/s] and deflections [rad] that act now.
        a: The airframe.
        handover: The transfer.
        dt: Tick [s].
        inflow: Air along the nose [m/s].
    """
    T1, T2 = thrusts(in_force, inflow, a)
    found, kept = handover.pending, handover.offset
    offset = Virtual(
        T1 - u.T1 if found else kept.T1,
        T2 - u.T2 if found else kept.T2,
        T1 * in_force.left_elevon - u.dT1 if found else kept.dT1,
        T2 * in_force.right_elevon - u.dT2 if found else kept.dT2,
    )
    size = abs(offset.T1) + abs(offset.T2) + abs(offset.dT1) + abs(offset.dT2)
    fade = 1.0 - dt / FADE if size > NEGLIGIBLE else 0.0
    after = Virtual(fade * offset.T1, fade * offset.T2, fade * offset.dT1, fade * offset.dT2)
    flown = Virtual(u.T1 + offset.T1, u.T2 + offset.T2, u.dT1 + offset.dT1, u.dT2 + offset.dT2)
    return flown, Handover(False, after)
