"""Actions, four numbers from -1 to 1, as actuator commands, virtual commands, body rates or shifted references.

Zero is the hover's thrust with straight elevons, no body rate, or the task's own reference.
"""

from __future__ import annotations

from sitl.compiled import kernel
from sitl.control.allocation import Virtual, allocate
from sitl.control.estimate import Estimate, air_ahead
from sitl.control.hover_zero_moment import realise
from sitl.control.reference import Reference
from sitl.errors import SitlError
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import clipped
from sitl.model.propeller import speed_for, thrust
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, cross
from sitl.simulation.flight import Design
from sitl.storage import value_of, writer

AS_ACTUATORS, AS_VIRTUAL, AS_RATES, AS_REFERENCE = range(4)
ACTION_KINDS = {
    "actuators": AS_ACTUATORS,
    "virtual": AS_VIRTUAL,
    "rates": AS_RATES,
    "reference": AS_REFERENCE,
}
ACTED = 4  # numbers of an action
LARGEST_RATE = 6.0  # body rate of an action of 1, about each axis [rad/s]
LARGEST_SHIFT = 5.0  # of a reference's place, along each axis [m]
LARGEST_TURN = 0.5  # of its heading [rad]

put_place = writer(Reference, lambda reference: reference.position)
put_heading = writer(Reference, lambda reference: reference.heading)


def action_kind(name: str) -> int:
    """The number of a kind of action.

    Raises:
        SitlError: If there is none of this name.
    """
    if name not in ACTION_KINDS:
        raise SitlError(f"actions {name!r}: there is {', '.join(ACTION_KINDS)}")
    return ACTION_KINDS[name]


@kernel
def share(action: float, low: float, middle: float, high: float) -> float:
    """A number by an action: ``low`` at -1, ``middle`` at 0, ``high`` at 1, straight in between."""
    by = clipped(action, -1.0, 1.0)
    return middle + by * ((high - middle) if by > 0.0 else (middle - low))


@kernel
def commanded(kind: int, action: Array, estimate: Estimate, design: Design, a: Airframe) -> Actuators:
    """Actuator commands of an action.

    Args:
        kind: AS_ACTUATORS, AS_VIRTUAL or AS_RATES.
        action: (4,): left and right motor, left and right elevon; or left and right thrust, left and right deflection
            times thrust; or body rates about x, y, z and the thrust.
        estimate: The state as the vehicle knows it.
        design: Of the nominal airframe, a record.
        a: The nominal airframe.
    """
    hovering, most = value_of(design.gains.hover_linear.u_bar).T1, thrust(a.omega_max, 0.0, a)
    if kind == AS_ACTUATORS:
        middle = speed_for(hovering, 0.0, a)
        return Actuators(
            share(action[0], a.omega_min, middle, a.omega_max),
            share(action[1], a.omega_min, middle, a.omega_max),
            clipped(action[2], -1.0, 1.0) * a.delta_max,
            clipped(action[3], -1.0, 1.0) * a.delta_max,
        )
    if kind == AS_VIRTUAL:
        T1, T2 = share(action[0], 0.0, hovering, most), share(action[1], 0.0, hovering, most)
        size = a.delta_max * hovering
        u = Virtual(T1, T2, clipped(action[2], -1.0, 1.0) * size, clipped(action[3], -1.0, 1.0) * size)
    else:
        u = _turning(action, estimate, design, a)
    command, _ = allocate(u, a, air_ahead(estimate))
    return command


@kernel
def _turning(action: Array, estimate: Estimate, design: Design, a: Airframe) -> Virtual:
    """Virtual commands that make the body rates follow, damped as in the zero-moment law's attitude loop."""
    gains, w = value_of(design.gains.zero_moment), estimate.rates
    k = 2.0 * gains.zeta * gains.lam
    spin = cross(w, Vector(a.J1 * w.x, a.J2 * w.y, a.J3 * w.z))
    torque = Vector(
        a.J1 * k * (LARGEST_RATE * clipped(action[0], -1.0, 1.0) - w.x) + spin.x,
        a.J2 * k * (LARGEST_RATE * clipped(action[1], -1.0, 1.0) - w.y) + spin.y,
        a.J3 * k * (LARGEST_RATE * clipped(action[2], -1.0, 1.0) - w.z) + spin.z,
    )
    return realise(torque, share(action[3], gains.f_min, a.m * a.g, gains.f_max), gains)


@kernel
def shift_reference(reference: Reference, task_reference: Reference, action: Array) -> None:
    """Shift place and heading of a hover's reference, a record, by an action; a path is flown as it is."""
    if reference.forward:
        return
    place = value_of(task_reference.position)
    shifted = Vector(
        place.x + LARGEST_SHIFT * clipped(action[0], -1.0, 1.0),
        place.y + LARGEST_SHIFT * clipped(action[1], -1.0, 1.0),
        place.z + LARGEST_SHIFT * clipped(action[2], -1.0, 1.0),
    )
    put_place(reference, shifted)
    put_heading(reference, task_reference.heading + LARGEST_TURN * clipped(action[3], -1.0, 1.0))
