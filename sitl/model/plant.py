"""Six degrees of freedom, and one step of them: actuators exactly, the body by Runge-Kutta 4, its quaternion kept unit.

The actuators do not feel the body, so where they are within the step is known first, and the step takes from it what
three looks at it would miss. In the air nothing of the ground is computed; the two forms of the step differ in nothing
else.
"""

import math

from sitl.compiled import kernel, subroutine
from sitl.model.actuators import limited, moved, nodes
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Airframe
from sitl.model.ground import LEVEL_GROUND, GroundPlane, contact, feet_after, feet_aloft, is_clear
from sitl.model.quaternions import Quaternion, normalised, rotate, rotate_inverse, x_axis
from sitl.model.state import Actuators, Body, Feet, Plant
from sitl.model.vectors import Vector, add_scaled, dot, subtract


@kernel
def derivative(body: Body, actuators: Actuators, wind: Vector, force: Vector, moment: Vector, a: Airframe) -> Body:
    r"""Rates of change of the body (report's equations of motion).

    .. math::
        \dot p = v, \quad m \dot v = R(q) F + m g, \quad \dot q = \tfrac12 q \otimes \omega, \quad
        J \dot\omega = M - \omega \times J \omega

    Args:
        body: Position, velocity, attitude and body rates.
        actuators: Motor speeds [rad/s] and deflections [rad].
        wind: Velocity of the air, world NWU [m/s].
        force: Of the ground, world [N].
        moment: Of the ground, body [N m].
        a: The airframe.
    """
    qw, qx, qy, qz = body.attitude
    p, q, r = body.rates
    r00, r01, r02 = 1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qx * qy - qw * qz), 2.0 * (qx * qz + qw * qy)
    r10, r11, r12 = 2.0 * (qx * qy + qw * qz), 1.0 - 2.0 * (qx * qx + qz * qz), 2.0 * (qy * qz - qw * qx)
    r20, r21, r22 = 2.0 * (qx * qz - qw * qy), 2.0 * (qy * qz + qw * qx), 1.0 - 2.0 * (qx * qx + qy * qy)
    ux, uy, uz = body.velocity.x - wind.x, body.velocity.y - wind.y, body.velocity.z - wind.z
    v_b = Vector(r00 * ux + r10 * uy + r20 * uz, r01 * ux + r11 * uy + r21 * uz, r02 * ux + r12 * uy + r22 * uz)
    F, M = wrench(v_b, body.rates, actuators, a)
    lightness = 1.0 / a.m
    return Body(
        body.velocity,
        Vector(
            lightness * (r00 * F.x + r01 * F.y + r02 * F.z + force.x),
            lightness * (r10 * F.x + r11 * F.y + r12 * F.z + force.y),
            lightness * (r20 * F.x + r21 * F.y + r22 * F.z + force.z) - a.g,
        ),
        Quaternion(
            0.5 * (-qx * p - qy * q - qz * r),
            0.5 * (qw * p + qy * r - qz * q),
            0.5 * (qw * q + qz * p - qx * r),
            0.5 * (qw * r + qx * q - qy * p),
        ),
        Vector(
            (M.x + moment.x - (a.J3 - a.J2) * q * r) * (1.0 / a.J1),
            (M.y + moment.y - (a.J1 - a.J3) * p * r) * (1.0 / a.J2),
            (M.z + moment.z - (a.J2 - a.J1) * p * q) * (1.0 / a.J3),
        ),
    )


@kernel
def advanced(body: Body, rate: Body, dt: float) -> Body:
    """``body + dt rate``."""
    q, k = body.attitude, rate.attitude
    return Body(
        add_scaled(body.position, rate.position, dt),
        add_scaled(body.velocity, rate.velocity, dt),
        Quaternion(q.w + dt * k.w, q.x + dt * k.x, q.y + dt * k.y, q.z + dt * k.z),
        add_scaled(body.rates, rate.rates, dt),
    )


@kernel
def _combined(body: Body, k1: Body, k2: Body, k3: Body, k4: Body, dt: float) -> Body:
    """Runge-Kutta's ``body + dt (k1 + 2 k2 + 2 k3 + k4) / 6``, the quaternion of unit norm."""
    third, sixth = dt * (1.0 / 3.0), dt * (1.0 / 6.0)
    after = advanced(advanced(advanced(advanced(body, k1, sixth), k2, third), k3, third), k4, sixth)
    return Body(after.position, after.velocity, normalised(after.attitude), after.rates)


@kernel
def step_in_air(plant: Plant, wanted: Actuators, wind: Vector, a: Airframe, dt: float) -> Plant:
    """One step out of the ground's reach; arguments as for :func:`step`, commands within their limits."""
    body, free = plant.body, Vector(0.0, 0.0, 0.0)
    beginning, middle, end = nodes(plant.actuators, wanted, dt, a)
    k1 = derivative(body, beginning, wind, free, free, a)
    k2 = derivative(advanced(body, k1, 0.5 * dt), middle, wind, free, free, a)
    k3 = derivative(advanced(body, k2, 0.5 * dt), middle, wind, free, free, a)
    k4 = derivative(advanced(body, k3, dt), end, wind, free, free, a)
    return Plant(_combined(body, k1, k2, k3, k4, dt), moved(plant.actuators, wanted, dt, a), feet_aloft())


@subroutine
def step_in_swirl(plant: Plant, wanted: Actuators, wind: Vector, rotation: Vector, a: Airframe, dt: float) -> Plant:
    """The same where the air also turns, by ``rotation``, world [rad/s]: what that adds is held over the step."""
    body = plant.body
    through = rotate_inverse(body.attitude, subtract(body.velocity, wind))
    slower = subtract(body.rates, rotate_inverse(body.attitude, rotation))
    F, M = wrench(through, body.rates, plant.actuators, a)
    turned, tilted = wrench(through, slower, plant.actuators, a)
    force, moment = rotate(body.attitude, subtract(turned, F)), subtract(tilted, M)
    beginning, middle, end = nodes(plant.actuators, wanted, dt, a)
    k1 = derivative(body, beginning, wind, force, moment, a)
    k2 = derivative(advanced(body, k1, 0.5 * dt), middle, wind, force, moment, a)
    k3 = derivative(advanced(body, k2, 0.5 * dt), middle, wind, force, moment, a)
    k4 = derivative(advanced(body, k3, dt), end, wind, force, moment, a)
    return Plant(_combined(body, k1, k2, k3, k4, dt), moved(plant.actuators, wanted, dt, a), feet_aloft())


@subroutine
def _pressed(body: Body, actuators: Actuators, feet: Feet, wind: Vector, ground: GroundPlane, a: Airframe) -> Body:
    force, moment = contact(body, feet, ground, a)
    return derivative(body, actuators, wind, force, moment, a)


@subroutine
def step_near_ground(
    plant: Plant, wanted: Actuators, wind: Vector, ground: GroundPlane, a: Airframe, dt: float
) -> Plant:
    """One step where the ground may press; the feet stick where they were, and are moved after the step."""
    body, feet = plant.body, plant.feet
    beginning, middle, end = nodes(plant.actuators, wanted, dt, a)
    k1 = _pressed(body, beginning, feet, wind, ground, a)
    k2 = _pressed(advanced(body, k1, 0.5 * dt), middle, feet, wind, ground, a)
    k3 = _pressed(advanced(body, k2, 0.5 * dt), middle, feet, wind, ground, a)
    k4 = _pressed(advanced(body, k3, dt), end, feet, wind, ground, a)
    after = _combined(body, k1, k2, k3, k4, dt)
    return Plant(after, moved(plant.actuators, wanted, dt, a), feet_after(after, feet, ground, a))


@kernel
def step(plant: Plant, command: Actuators, wind: Vector, armed: bool, a: Airframe, dt: float) -> Plant:
    """The plant ``dt`` later, over level ground at height 0.

    Args:
        plant: As it is.
        command: Motor speeds [rad/s] and deflections [rad]; beyond a limit they stop at the limit.
        wind: Velocity of the air over the step, world NWU [m/s].
        armed: Whether the motors may turn.
        a: The airframe.
        dt: Step [s]; 1 ms is the product's, stable against the ground's springs.
    """
    wanted = limited(command, armed, a)
    if is_clear(plant.body, LEVEL_GROUND):
        return step_in_air(plant, wanted, wind, a, dt)
    return step_near_ground(plant, wanted, wind, LEVEL_GROUND, a, dt)


@kernel
def inflow(body: Body, wind: Vector) -> float:
    """Speed of the air along the propellers' axis, from ahead [m/s]."""
    return dot(x_axis(body.attitude), subtract(body.velocity, wind))


@kernel
def is_finite(plant: Plant) -> bool:
    """Whether every number of the state is one."""
    body, act = plant.body, plant.actuators
    total = body.position.x + body.position.y + body.position.z + body.velocity.x + body.velocity.y + body.velocity.z
    total += body.attitude.w + body.attitude.x + body.attitude.y + body.attitude.z
    total += body.rates.x + body.rates.y + body.rates.z
    total += act.left_motor + act.right_motor + act.left_elevon + act.right_elevon
    return math.isfinite(total)
