"""Vectors of three named components."""

import math
from typing import NamedTuple

from sitl.compiled import kernel


class Vector(NamedTuple):
    """Three components along a frame's axes; being a tuple, it adds by :func:`add` and not by ``+``."""

    x: float
    y: float
    z: float


@kernel
def add(a: Vector, b: Vector) -> Vector:
    """The sum a + b."""
    return Vector(a.x + b.x, a.y + b.y, a.z + b.z)


@kernel
def subtract(a: Vector, b: Vector) -> Vector:
    """The difference a - b."""
    return Vector(a.x - b.x, a.y - b.y, a.z - b.z)


@kernel
def scaled(a: Vector, k: float) -> Vector:
    """The product k a."""
    return Vector(k * a.x, k * a.y, k * a.z)


@kernel
def add_scaled(a: Vector, b: Vector, k: float) -> Vector:
    """The sum a + k b."""
    return Vector(a.x + k * b.x, a.y + k * b.y, a.z + k * b.z)


@kernel
def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    """The vector product a × b."""
    return Vector(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@kernel
def norm(a: Vector) -> float:
    """The length."""
    return math.sqrt(a.x * a.x + a.y * a.y + a.z * a.z)


@kernel
def level_norm(x: float, y: float) -> float:
    """Length of a vector of two components."""
    return math.sqrt(x * x + y * y)


@kernel
def shortened(a: Vector, limit: float) -> Vector:
    """The vector, no longer than ``limit``."""
    return scaled(a, min(1.0, limit / max(norm(a), 1e-12)))
