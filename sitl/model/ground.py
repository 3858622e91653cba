"""The ground, a plane: springs with damping, normal to it, under the tail, the nose and the wing tips.

The four tail contacts grip: friction is a spring to the point where each one touched down, which gives way at the
Coulomb limit. So the vehicle stands without creeping and slides only when it is pushed.
"""

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model.airframe import Airframe
from sitl.model.quaternions import Quaternion, multiply, normalised, rotate, rotate_inverse
from sitl.model.state import Body, Feet, Foot, Plant
from sitl.model.vectors import Vector, add, add_scaled, cross, dot, norm, scaled, subtract

STIFFNESS = 800.0  # of one contact, normal and tangential [N/m]: the vehicle sinks 1.5 mm under its weight
DAMPING = 10.0  # of one contact [N s/m]
FRICTION = 0.6  # Coulomb coefficient [-]
FEET = 4  # contacts that grip; the others only rub
CLEAR = 0.8  # above this the vehicle touches nothing, nor will within a control period [m]

SPIN_LEFT = 0.1  # share of the body rates that is left after a crash [-]

_ALOFT = Foot(False, 0.0, 0.0)


class GroundPlane(NamedTuple):
    """The ground as a plane."""

    height: float  # at the origin of the world [m]
    normal: Vector  # upwards, world NWU, of unit length


LEVEL_GROUND = GroundPlane(0.0, Vector(0.0, 0.0, 1.0))


def ground_plane(height: float, slope: float, rises_to: float) -> GroundPlane:
    """A plane through a height at the origin.

    Args:
        height: [m].
        slope: From the horizontal [rad].
        rises_to: Where it rises, clockwise from north [rad].
    """
    s = math.sin(slope)
    return GroundPlane(height, Vector(-s * math.cos(rises_to), s * math.sin(rises_to), math.cos(slope)))


@kernel
def clearance(ground: GroundPlane, p: Vector) -> float:
    """Distance of a point, world NWU, from the ground; negative below it [m]."""
    return ground.normal.x * p.x + ground.normal.y * p.y + ground.normal.z * (p.z - ground.height)


@kernel
def height_over(ground: GroundPlane, p: Vector) -> float:
    """Height of a point, world NWU, straight above the ground [m]."""
    return clearance(ground, p) / ground.normal.z


def leaning(ground: GroundPlane, upright: Quaternion) -> Quaternion:
    """The attitude of a vehicle that stands on the ground, where it would be ``upright`` on level ground."""
    n = ground.normal
    return multiply(normalised(Quaternion(1.0 + n.z, -n.y, n.x, 0.0)), upright)


class Crash(NamedTuple):
    """The contact that broke something."""

    speed: float  # towards the ground; 0: there was none [m/s]
    place: Vector  # where the centre of mass was, world NWU [m]


@kernel
def is_clear(body: Body, ground: GroundPlane) -> bool:
    """Whether the ground is out of reach."""
    return clearance(ground, body.position) > CLEAR


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


@kernel
def _along(ground: GroundPlane, v: Vector) -> Vector:
    """The part of a vector that lies in the plane."""
    return add_scaled(v, ground.normal, -dot(ground.normal, v))


@kernel
def _foothold(ground: GroundPlane, grip: Foot) -> Vector:
    """Point of the plane that a foot sticks to [m]."""
    n = ground.normal
    return Vector(grip.north, grip.west, ground.height - (n.x * grip.north + n.y * grip.west) / n.z)


@kernel
def _load(ground: GroundPlane, depth: float, u: Vector) -> float:
    """Force of a contact normal to the ground, which pushes only [N]; ``depth`` is its clearance [m]."""
    return max(0.0, -STIFFNESS * depth - DAMPING * dot(ground.normal, u))


@subroutine
def _press(body: Body, at: Vector, grip: Foot, ground: GroundPlane) -> tuple[Vector, Vector]:
    """Force, world [N], and moment, body [N m], of one contact."""
    p, u = point_motion(body, at)
    depth = clearance(ground, p)
    if depth >= 0.0:
        return Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
    load = _load(ground, depth, u)
    pull = scaled(_along(ground, u), -DAMPING)
    if grip.grips:
        pull = add_scaled(pull, _along(ground, subtract(p, _foothold(ground, grip))), -STIFFNESS)
    rub = norm(pull)
    if rub > FRICTION * load:
        pull = Vector(pull.x * FRICTION * load / rub, pull.y * FRICTION * load / rub, pull.z * FRICTION * load / rub)
    force = add_scaled(pull, ground.normal, load)
    return force, cross(at, rotate_inverse(body.attitude, force))


@kernel
def contact(body: Body, feet: Feet, ground: GroundPlane, a: Airframe) -> tuple[Vector, Vector]:
    """Force in the world frame [N] and moment in the body frame [N m] of all contacts."""
    f0, m0 = _press(body, foot(1.0, 1.0, a), feet.left_upper, ground)
    f1, m1 = _press(body, foot(1.0, -1.0, a), feet.left_lower, ground)
    f2, m2 = _press(body, foot(-1.0, 1.0, a), feet.right_upper, ground)
    f3, m3 = _press(body, foot(-1.0, -1.0, a), feet.right_lower, ground)
    f4, m4 = _press(body, nose(a), _ALOFT, ground)
    f5, m5 = _press(body, wing_tip(1.0, a), _ALOFT, ground)
    f6, m6 = _press(body, wing_tip(-1.0, a), _ALOFT, ground)
    force = add(add(add(f0, f1), add(f2, f3)), add(f4, add(f5, f6)))
    return force, add(add(add(m0, m1), add(m2, m3)), add(m4, add(m5, m6)))


@subroutine
def _stepped(body: Body, at: Vector, grip: Foot, ground: GroundPlane) -> Foot:
    """A foot after a step: it grips where it touched down, lets go in the air, is dragged when it slides."""
    p, u = point_motion(body, at)
    depth = clearance(ground, p)
    if depth >= 0.0:
        return _ALOFT
    over = add_scaled(p, ground.normal, -depth)  # on the plane
    north, west = (grip.north, grip.west) if grip.grips else (over.x, over.y)
    stretched = subtract(over, _foothold(ground, Foot(True, north, west)))
    stretch = norm(stretched)
    reach = FRICTION * _load(ground, depth, u) / STIFFNESS
    if stretch > reach:
        north, west = over.x - stretched.x * reach / stretch, over.y - stretched.y * reach / stretch
    return Foot(True, north, west)


@kernel
def feet_after(body: Body, feet: Feet, ground: GroundPlane, a: Airframe) -> Feet:
    """The tail contacts after a step of the body."""
    return Feet(
        _stepped(body, foot(1.0, 1.0, a), feet.left_upper, ground),
        _stepped(body, foot(1.0, -1.0, a), feet.left_lower, ground),
        _stepped(body, foot(-1.0, 1.0, a), feet.right_upper, ground),
        _stepped(body, foot(-1.0, -1.0, a), feet.right_lower, ground),
    )


@kernel
def feet_aloft() -> Feet:
    """The tail contacts of a vehicle in the air."""
    return Feet(_ALOFT, _ALOFT, _ALOFT, _ALOFT)


@kernel
def _depth(body: Body, at: Vector, ground: GroundPlane) -> float:
    return clearance(ground, add(body.position, rotate(body.attitude, at)))


@kernel
def is_touching(plant: Plant, ground: GroundPlane, a: Airframe) -> bool:
    """Whether any contact is loaded."""
    return _lowest(plant.body, ground, a) < 0.0


@kernel
def no_crash() -> Crash:
    """Nothing is broken."""
    return Crash(0.0, Vector(0.0, 0.0, 0.0))


@subroutine
def impact_speed(before: Body, after: Body, ground: GroundPlane, a: Airframe) -> float:
    """Greatest speed towards the ground at which a contact has come to it, or goes on into it, in a step [m/s].

    Args:
        before: The body before the step.
        after: And after it.
        ground: Where the ground is.
        a: The airframe.
    """
    left = max(_hit(before, after, foot(1.0, 1.0, a), ground), _hit(before, after, foot(1.0, -1.0, a), ground))
    right = max(_hit(before, after, foot(-1.0, 1.0, a), ground), _hit(before, after, foot(-1.0, -1.0, a), ground))
    tips = max(_hit(before, after, wing_tip(1.0, a), ground), _hit(before, after, wing_tip(-1.0, a), ground))
    return max(left, right, tips, _hit(before, after, nose(a), ground))


@subroutine
def _hit(before: Body, after: Body, at: Vector, ground: GroundPlane) -> float:
    _, u = point_motion(before, at)
    return -dot(ground.normal, u) if _depth(after, at, ground) < 0.0 else 0.0


@subroutine
def crashed(plant: Plant, ground: GroundPlane, a: Airframe) -> Plant:
    """The plant after a crash: what moved it has gone into the airframe, and it lies where it hit the ground."""
    body = plant.body
    still = Vector(0.0, 0.0, 0.0)
    on_top = add_scaled(body.position, ground.normal, -min(_lowest(body, ground, a), 0.0))
    stopped = Body(on_top, still, body.attitude, scaled(body.rates, SPIN_LEFT))
    return Plant(stopped, plant.actuators, feet_aloft())


@subroutine
def _lowest(body: Body, ground: GroundPlane, a: Airframe) -> float:
    """Clearance of the lowest contact [m]."""
    left = min(_depth(body, foot(1.0, 1.0, a), ground), _depth(body, foot(1.0, -1.0, a), ground))
    right = min(_depth(body, foot(-1.0, 1.0, a), ground), _depth(body, foot(-1.0, -1.0, a), ground))
    tips = min(_depth(body, wing_tip(1.0, a), ground), _depth(body, wing_tip(-1.0, a), ground))
    return min(left, right, tips, _depth(body, nose(a), ground))
