"""Unit quaternions (w, x, y, z); R(q) maps body to world (report, eq. of R(q))."""

import math
from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.arithmetic import sine_cosine
from sitl.model.vectors import Vector


class Quaternion(NamedTuple):
    """Scalar part first; q and -q are the same attitude."""

    w: float
    x: float
    y: float
    z: float


@kernel
def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product a ⊗ b."""
    return Quaternion(
        a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
        a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
        a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
    )


@kernel
def conjugate(q: Quaternion) -> Quaternion:
    """Inverse of a unit quaternion."""
    return Quaternion(q.w, -q.x, -q.y, -q.z)


@kernel
def normalised(q: Quaternion) -> Quaternion:
    """The quaternion scaled to unit norm."""
    k = 1.0 / math.sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z)
    return Quaternion(k * q.w, k * q.x, k * q.y, k * q.z)


@kernel
def rotate(q: Quaternion, v: Vector) -> Vector:
    """R(q) v: a body vector in the world frame."""
    # t = 2 eps × v;  R v = v + w t + eps × t
    tx = 2.0 * (q.y * v.z - q.z * v.y)
    ty = 2.0 * (q.z * v.x - q.x * v.z)
    tz = 2.0 * (q.x * v.y - q.y * v.x)
    return Vector(
        v.x + q.w * tx + q.y * tz - q.z * ty,
        v.y + q.w * ty + q.z * tx - q.x * tz,
        v.z + q.w * tz + q.x * ty - q.y * tx,
    )


@kernel
def rotate_inverse(q: Quaternion, v: Vector) -> Vector:
    """R(q)^T v: a world vector in the body frame."""
    return rotate(conjugate(q), v)


@kernel
def x_axis(q: Quaternion) -> Vector:
    """x_b in the world frame: the nose."""
    return Vector(1.0 - 2.0 * (q.y * q.y + q.z * q.z), 2.0 * (q.x * q.y + q.w * q.z), 2.0 * (q.x * q.z - q.w * q.y))


@kernel
def z_axis(q: Quaternion) -> Vector:
    """z_b in the world frame: away from the belly."""
    return Vector(2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x), 1.0 - 2.0 * (q.x * q.x + q.y * q.y))


@kernel
def small_rotation(phi: Vector) -> Quaternion:
    """Quaternion of a rotation by abs(phi) about phi; to rounding up to 0.3 rad, normalised beyond."""
    s = 0.25 * (phi.x * phi.x + phi.y * phi.y + phi.z * phi.z)
    half = 0.5 * (1.0 - s * (1.0 / 6.0 - s * (1.0 / 120.0 - s * (1.0 / 5040.0 - s / 362880.0))))
    w = 1.0 - s * (0.5 - s * (1.0 / 24.0 - s * (1.0 / 720.0 - s / 40320.0)))
    return normalised(Quaternion(w, half * phi.x, half * phi.y, half * phi.z))


@kernel
def from_euler(roll: float, pitch: float, yaw: float) -> Quaternion:
    """The ZYX sequence q_z(yaw) q_y(pitch) q_x(roll).

    In the report's frames nose-up is a negative pitch: hover is pitch = -pi/2.
    """
    sr, cr = sine_cosine(0.5 * roll)
    sp, cp = sine_cosine(0.5 * pitch)
    sy, cy = sine_cosine(0.5 * yaw)
    return Quaternion(
        cy * cp * cr + sy * sp * sr,
        cy * cp * sr - sy * sp * cr,
        cy * sp * cr + sy * cp * sr,
        sy * cp * cr - cy * sp * sr,
    )


@kernel
def hover(heading: float) -> Quaternion:
    """Nose-up attitude whose belly normal -z_b points to ``heading``, from north towards west [rad]."""
    s, c = sine_cosine(0.5 * heading)
    half = math.sqrt(0.5)
    return Quaternion(half * c, half * s, -half * c, half * s)
