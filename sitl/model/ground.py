"""The ground, z <= 0 in the world NWU: springs with damping under the tail, the nose and the wing tips.

The four tail contacts grip: friction is a spring to the point where each one touched down, which gives way at the
Coulomb limit. So the vehicle stands without creeping and slides only when it is pushed.
"""

from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model.airframe import Airframe
from sitl.model.quaternions import rotate, rotate_inverse
from sitl.model.state import Body, Feet, Foot, Plant
from sitl.model.vectors import Vector, add, cross, level_norm, scaled

STIFFNESS = 800.0  # of one contact, normal and tangential [N/m]: the vehicle sinks 1.5 mm under its weight
DAMPING = 10.0  # of one contact [N s/m]
FRICTION = 0.6  # Coulomb coefficient [-]
FEET = 4  # contacts that grip; the others only rub
CLEAR = 0.8  # above this the vehicle touches nothing, nor will within a control period [m]

SPIN_LEFT = 0.1  # share of the body rates that is left after a crash [-]

_ALOFT = Foot(False, 0.0, 0.0)


class Crash(NamedTuple):
    """The contact that broke something."""

    speed: float  # towards the ground; 0: there was none [m/s]
    place: Vector  # where the centre of mass was, world NWU [m]


@kernel
def is_clear(body: Body) -> bool:
    """Whether the ground is out of reach."""
    return body.position.z > CLEAR


@kernel
def nose(a: Airframe) -> Vector:
    """The contact at the nose, body frame FLU [m]."""
    return Vector(a.p_x, 0.0, 0.0)


@kernel
def wing_tip(side: float, a: Airframe) -> Vector:
    """The contact at a wing tip, body frame FLU [m]; ``side`` is 1 on the left, -1 on the right."""
    return Vector(0.0, 0.5 * side * a.b, 0.0)


@kernel
def foot(side: float, upper: float, a: Airframe) -> Vector:
    """A contact of the tail, body frame FLU [m]; ``upper`` is 1 towards +z_b, -1 away from it."""
    return Vector(-a.foot_x, side * a.foot_y, upper * a.foot_z)


@kernel
def point_motion(body: Body, at: Vector) -> tuple[Vector, Vector]:
    """Position [m] and velocity [m/s] of a point of the body in the world frame."""
    return (
        add(body.position, rotate(body.attitude, at)),
        add(body.velocity, rotate(body.attitude, cross(body.rates, at))),
    )


@subroutine
def _press(body: Body, at: Vector, grip: Foot) -> tuple[Vector, Vector]:
    """Force, world [N], and moment, body [N m], of one contact."""
    p, u = point_motion(body, at)
    if p.z >= 0.0:
        return Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
    normal = max(0.0, -STIFFNESS * p.z - DAMPING * u.z)
    tx, ty = -DAMPING * u.x, -DAMPING * u.y
    if grip.grips:
        tx -= STIFFNESS * (p.x - grip.north)
        ty -= STIFFNESS * (p.y - grip.west)
    pull = level_norm(tx, ty)
    if pull > FRICTION * normal:
        tx, ty = tx * FRICTION * normal / pull, ty * FRICTION * normal / pull
    force = Vector(tx, ty, normal)
    return force, cross(at, rotate_inverse(body.attitude, force))


@kernel
def contact(body: Body, feet: Feet, a: Airframe) -> tuple[Vector, Vector]:
    """Force in the world frame [N] and moment in the body frame [N m] of all contacts."""
    f0, m0 = _press(body, foot(1.0, 1.0, a), feet.left_upper)
    f1, m1 = _press(body, foot(1.0, -1.0, a), feet.left_lower)
    f2, m2 = _press(body, foot(-1.0, 1.0, a), feet.right_upper)
    f3, m3 = _press(body, foot(-1.0, -1.0, a), feet.right_lower)
    f4, m4 = _press(body, nose(a), _ALOFT)
    f5, m5 = _press(body, wing_tip(1.0, a), _ALOFT)
    f6, m6 = _press(body, wing_tip(-1.0, a), _ALOFT)
    force = add(add(add(f0, f1), add(f2, f3)), add(f4, add(f5, f6)))
    return force, add(add(add(m0, m1), add(m2, m3)), add(m4, add(m5, m6)))


@subroutine
def _stepped(body: Body, at: Vector, grip: Foot) -> Foot:
    """A foot after a step: it grips where it touched down, lets go in the air, is dragged when it slides."""
    p, u = point_motion(body, at)
    if p.z >= 0.0:
        return _ALOFT
    north, west = (grip.north, grip.west) if grip.grips else (p.x, p.y)
    sx, sy = p.x - north, p.y - west
    stretch = level_norm(sx, sy)
    reach = FRICTION * max(0.0, -STIFFNESS * p.z - DAMPING * u.z) / STIFFNESS
    if stretch > reach:
        north, west = p.x - sx * reach / stretch, p.y - sy * reach / stretch
    return Foot(True, north, west)


@kernel
def feet_after(body: Body, feet: Feet, a: Airframe) -> Feet:
    """The tail contacts after a step of the body."""
    return Feet(
        _stepped(body, foot(1.0, 1.0, a), feet.left_upper),
        _stepped(body, foot(1.0, -1.0, a), feet.left_lower),
        _stepped(body, foot(-1.0, 1.0, a), feet.right_upper),
        _stepped(body, foot(-1.0, -1.0, a), feet.right_lower),
    )


@kernel
def feet_aloft() -> Feet:
    """The tail contacts of a vehicle in the air."""
    return Feet(_ALOFT, _ALOFT, _ALOFT, _ALOFT)


@kernel
def _depth(body: Body, at: Vector) -> float:
    return body.position.z + rotate(body.attitude, at).z


@kernel
def is_touching(plant: Plant, a: Airframe) -> bool:
    """Whether any contact is loaded."""
    return _lowest(plant.body, a) < 0.0


@kernel
def no_crash() -> Crash:
    """Nothing is broken."""
    return Crash(0.0, Vector(0.0, 0.0, 0.0))


@subroutine
def impact_speed(before: Body, after: Body, a: Airframe) -> float:
    """Greatest speed towards the ground at which a contact has come to it, or goes on into it, in a step [m/s].

    Args:
        before: The body before the step.
        after: And after it.
        a: The airframe.
    """
    left = max(_hit(before, after, foot(1.0, 1.0, a)), _hit(before, after, foot(1.0, -1.0, a)))
    right = max(_hit(before, after, foot(-1.0, 1.0, a)), _hit(before, after, foot(-1.0, -1.0, a)))
    tips = max(_hit(before, after, wing_tip(1.0, a)), _hit(before, after, wing_tip(-1.0, a)))
    return max(left, right, tips, _hit(before, after, nose(a)))


@subroutine
def _hit(before: Body, after: Body, at: Vector) -> float:
    _, u = point_motion(before, at)
    return -u.z if _depth(after, at) < 0.0 else 0.0


@subroutine
def crashed(plant: Plant, a: Airframe) -> Plant:
    """The plant after a crash: what moved it has gone into the airframe, and it lies where it hit the ground."""
    body = plant.body
    p, still = body.position, Vector(0.0, 0.0, 0.0)
    on_top = Vector(p.x, p.y, p.z - min(_lowest(body, a), 0.0))
    stopped = Body(on_top, still, body.attitude, scaled(body.rates, SPIN_LEFT))
    return Plant(stopped, plant.actuators, feet_aloft())


@subroutine
def _lowest(body: Body, a: Airframe) -> float:
    """Height of the lowest contact [m]."""
    left = min(_depth(body, foot(1.0, 1.0, a)), _depth(body, foot(1.0, -1.0, a)))
    right = min(_depth(body, foot(-1.0, 1.0, a)), _depth(body, foot(-1.0, -1.0, a)))
    tips = min(_depth(body, wing_tip(1.0, a)), _depth(body, wing_tip(-1.0, a)))
    return min(left, right, tips, _depth(body, nose(a)))
