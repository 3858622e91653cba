"""Rotations by the row: arrays of quaternions (n, 4), rotation vectors (n, 3) [rad] and matrices (n, 3, 3)."""

from __future__ import annotations

import numpy as np

from sitl import Array


def product(p: Array, q: Array) -> Array:
    """Hamilton products p q."""
    pw, px, py, pz = p.T
    qw, qx, qy, qz = q.T
    return np.stack(
        [
            pw * qw - px * qx - py * qy - pz * qz,
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
        ],
        axis=1,
    )


def inverse(q: Array) -> Array:
    """Inverses of unit quaternions."""
    return np.asarray(q * np.array([1.0, -1.0, -1.0, -1.0]))


def unit(q: Array) -> Array:
    """Quaternions of norm one."""
    return np.asarray(q / np.linalg.norm(q, axis=1)[:, None])


def of_vector(phi: Array) -> Array:
    """Quaternions of rotation vectors."""
    half = 0.5 * np.linalg.norm(phi, axis=1)
    return np.column_stack([np.cos(half), 0.5 * np.sinc(half / np.pi)[:, None] * phi])


def vector_of(q: Array) -> Array:
    """Rotation vectors of unit quaternions, the shorter way round."""
    q = q * np.where(q[:, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(q[:, 1:], axis=1)
    angle = 2.0 * np.arctan2(sine, q[:, 0])
    return np.asarray(q[:, 1:] * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)[:, None])


def matrices(q: Array) -> Array:
    """Rotation matrices."""
    w, x, y, z = q.T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def interpolated(time: Array, at: Array, q: Array) -> Array:
    """Quaternions at other times, by chords: what lies between two close ones.

    Args:
        time: Where they are wanted, (n,).
        at: Where they are known, (k,).
        q: The known ones, (k, 4).
    """
    turns = np.where(np.einsum("ij,ij->i", q[1:], q[:-1]) < 0.0, -1.0, 1.0)
    same_side = q * np.concatenate(([1.0], np.cumprod(turns)))[:, None]
    return unit(np.stack([np.interp(time, at, column) for column in same_side.T], axis=1))


def to_flying_frame(vectors: Array) -> Array:
    """Vectors of the hover frame in that of forward flight, FLU; rows hold any number of them, (n, 3 k)."""
    turned = vectors.reshape(len(vectors), -1, 3)
    return np.stack([turned[:, :, 2], turned[:, :, 1], -turned[:, :, 0]], axis=2).reshape(vectors.shape)


def to_hover_frame(vectors: Array) -> Array:
    """The other way round."""
    turned = vectors.reshape(len(vectors), -1, 3)
    return np.stack([-turned[:, :, 2], turned[:, :, 1], turned[:, :, 0]], axis=2).reshape(vectors.shape)


def flying_attitudes(q: Array) -> Array:
    """Attitudes of the forward-flight frame from those of the hover frame, FLU to NWU."""
    return product(q, np.tile(_NOSE_UP, (len(q), 1)))


def hover_attitudes(q: Array) -> Array:
    """The other way round."""
    return product(q, inverse(np.tile(_NOSE_UP, (len(q), 1))))


_NOSE_UP = np.array([np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0])  # the forward-flight frame seen from the hover frame
