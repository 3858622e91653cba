"""The ground, z <= 0 in the world NWU: springs with damping under the tail, the nose and the wing tips.

The four tail contacts grip: friction is a spring to the point where each one touched down (its anchor), which
gives way at the Coulomb limit. So the vehicle stands without creeping and slides only when it is pushed.
"""

import math

from numba import njit

from sitl.kernels.parameters import Airframe, Array
from sitl.kernels.state import ANCHOR, P, Q, V, W

STIFFNESS = 800.0  # of one contact, normal and tangential [N/m]: the vehicle sinks 1.5 mm under its weight
DAMPING = 10.0  # of one contact [N s/m]
FRICTION = 0.6  # Coulomb coefficient [-]
FEET = 4  # contacts with an anchor; the others only rub
CONTACTS = 7
CLEAR = 0.6  # no contact is farther from the centre of mass than this [m]


@njit(cache=True)
def contact_point(i: int, a: Airframe) -> tuple[float, float, float]:
    """Contact ``i`` in the body frame FLU [m]: four feet, the nose, the wing tips."""
    if i < FEET:
        return -a.foot_x, a.foot_y if i < 2 else -a.foot_y, a.foot_z if i % 2 == 0 else -a.foot_z
    if i == FEET:
        return a.p_x, 0.0, 0.0
    return 0.0, 0.5 * a.b if i == FEET + 1 else -0.5 * a.b, 0.0


@njit(cache=True)
def contact(x: Array, plant: Array, a: Airframe) -> tuple[float, float, float, float, float, float]:
    """Force in the world frame [N] and moment in the body frame [N m] of all contacts.

    Args:
        x: Rigid state (p, v, q, w), (13,).
        plant: Whole plant state; only its anchors are read.
        a: The airframe.
    """
    fx = fy = fz = mx = my = mz = 0.0
    if x[P + 2] > CLEAR:
        return fx, fy, fz, mx, my, mz
    for i in range(CONTACTS):
        px, py, pz, ux, uy, uz = world_motion(x, i, a)
        if pz >= 0.0:
            continue
        normal = max(0.0, -STIFFNESS * pz - DAMPING * uz)
        tx, ty = -DAMPING * ux, -DAMPING * uy
        if i < FEET and not math.isnan(plant[ANCHOR + 2 * i]):
            tx -= STIFFNESS * (px - plant[ANCHOR + 2 * i])
            ty -= STIFFNESS * (py - plant[ANCHOR + 2 * i + 1])
        grip = math.sqrt(tx * tx + ty * ty)
        if grip > FRICTION * normal:
            tx, ty = tx * FRICTION * normal / grip, ty * FRICTION * normal / grip
        fx, fy, fz = fx + tx, fy + ty, fz + normal
        bx, by, bz = to_body(x, tx, ty, normal)
        cx, cy, cz = contact_point(i, a)
        mx, my, mz = mx + cy * bz - cz * by, my + cz * bx - cx * bz, mz + cx * by - cy * bx
    return fx, fy, fz, mx, my, mz


@njit(cache=True)
def move_anchors(plant: Array, a: Airframe) -> None:
    """After a step: drop an anchor where a foot touched down, lift it with the foot, drag it when it slides."""
    for i in range(FEET):
        at = ANCHOR + 2 * i
        px, py, pz, _, _, uz = world_motion(plant, i, a) if plant[P + 2] <= CLEAR else (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        if pz >= 0.0:
            plant[at] = plant[at + 1] = math.nan
            continue
        if math.isnan(plant[at]):
            plant[at], plant[at + 1] = px, py
        sx, sy = px - plant[at], py - plant[at + 1]
        stretch = math.sqrt(sx * sx + sy * sy)
        most = FRICTION * max(0.0, -STIFFNESS * pz - DAMPING * uz) / STIFFNESS
        if stretch > most:
            plant[at], plant[at + 1] = px - sx * most / stretch, py - sy * most / stretch


@njit(cache=True)
def on_ground(plant: Array, a: Airframe) -> bool:
    """Whether any contact is loaded."""
    if plant[P + 2] > CLEAR:
        return False
    for i in range(CONTACTS):
        if world_motion(plant, i, a)[2] < 0.0:
            return True
    return False


@njit(cache=True)
def world_motion(x: Array, i: int, a: Airframe) -> tuple[float, float, float, float, float, float]:
    """Position [m] and velocity [m/s] of contact ``i`` in the world frame."""
    cx, cy, cz = contact_point(i, a)
    p, q, r = x[W], x[W + 1], x[W + 2]
    px, py, pz = to_world(x, cx, cy, cz)
    ux, uy, uz = to_world(x, q * cz - r * cy, r * cx - p * cz, p * cy - q * cx)
    return x[P] + px, x[P + 1] + py, x[P + 2] + pz, x[V] + ux, x[V + 1] + uy, x[V + 2] + uz


@njit(cache=True)
def to_world(x: Array, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    """R(q) b, without an array."""
    w, i, j, k = x[Q], x[Q + 1], x[Q + 2], x[Q + 3]
    tx, ty, tz = 2 * (j * bz - k * by), 2 * (k * bx - i * bz), 2 * (i * by - j * bx)
    return bx + w * tx + j * tz - k * ty, by + w * ty + k * tx - i * tz, bz + w * tz + i * ty - j * tx


@njit(cache=True)
def to_body(x: Array, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """R(q)^T v, without an array."""
    w, i, j, k = x[Q], -x[Q + 1], -x[Q + 2], -x[Q + 3]
    tx, ty, tz = 2 * (j * vz - k * vy), 2 * (k * vx - i * vz), 2 * (i * vy - j * vx)
    return vx + w * tx + j * tz - k * ty, vy + w * ty + k * tx - i * tz, vz + w * tz + i * ty - j * tx
