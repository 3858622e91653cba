"""Unit quaternions (w, x, y, z) as flat arrays; R(q) maps body to world (report, eq. of R(q))."""

import math

import numpy as np
from numba import njit

from sitl.model.airframe import Array


@njit(cache=True)
def multiply(a: Array, b: Array) -> Array:
    """Hamilton product a ⊗ b, shape (4,)."""
    return np.array(
        (
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        )
    )


@njit(cache=True)
def conjugate(q: Array) -> Array:
    """Inverse of a unit quaternion, shape (4,)."""
    return np.array((q[0], -q[1], -q[2], -q[3]))


@njit(cache=True)
def normalised(q: Array) -> Array:
    """The quaternion scaled to unit norm, shape (4,)."""
    n = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return np.array((q[0] / n, q[1] / n, q[2] / n, q[3] / n))


@njit(cache=True)
def rotate(q: Array, v: Array) -> Array:
    """R(q) v: a body vector in the world frame, shape (3,)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    # t = 2 eps × v;  R v = v + w t + eps × t
    tx = 2.0 * (y * v[2] - z * v[1])
    ty = 2.0 * (z * v[0] - x * v[2])
    tz = 2.0 * (x * v[1] - y * v[0])
    return np.array(
        (
            v[0] + w * tx + y * tz - z * ty,
            v[1] + w * ty + z * tx - x * tz,
            v[2] + w * tz + x * ty - y * tx,
        )
    )


@njit(cache=True)
def rotate_inverse(q: Array, v: Array) -> Array:
    """R(q)^T v: a world vector in the body frame, shape (3,)."""
    return rotate(conjugate(q), v)


@njit(cache=True)
def from_rotation_vector(phi: Array) -> Array:
    """Exponential map: the quaternion of a rotation by ``|phi|`` rad about ``phi``, shape (4,)."""
    angle = math.sqrt(phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2])
    # sin(a/2)/a by its series near zero keeps the map smooth at phi = 0
    scale = 0.5 - angle * angle / 48.0 if angle < 1e-4 else math.sin(0.5 * angle) / angle
    return np.array((math.cos(0.5 * angle), scale * phi[0], scale * phi[1], scale * phi[2]))


@njit(cache=True)
def from_euler(roll: float, pitch: float, yaw: float) -> Array:
    """The ZYX sequence q_z(yaw) q_y(pitch) q_x(roll), shape (4,).

    In the report's frames nose-up is a negative pitch: hover is pitch = -pi/2.
    """
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    return np.array(
        (
            cy * cp * cr + sy * sp * sr,
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
        )
    )


@njit(cache=True)
def hover(heading: float) -> Array:
    """Nose-up attitude whose belly normal -z_b points to ``heading``, shape (4,).

    Args:
        heading: Angle about world z (up), from north towards west [rad].
    """
    return from_euler(0.0, -0.5 * math.pi, heading)
