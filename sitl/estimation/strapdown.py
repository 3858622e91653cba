"""Inertial navigation by increments: what the inertial readings of some time add up to, whatever it began with.

An increment takes a state (p, v, q) to the one ``time`` later,

    q' = q ⊗ rotation,  v' = v + g t + R(q) velocity,  p' = p + v t + g t² / 2 + R(q) position.

Increments form a group: they are joined, and the oldest part of one can be taken off again.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.quaternions import Quaternion, conjugate, multiply, normalised, rotate, rotate_inverse, small_rotation
from sitl.model.vectors import Vector, add, add_scaled, scaled, subtract


class Increment(NamedTuple):
    """Motion from inertial readings alone, in the body frame at its beginning."""

    rotation: Quaternion
    velocity: Vector  # [m/s]
    position: Vector  # [m]
    time: float  # [s]


@kernel
def no_increment() -> Increment:
    """Nothing, in no time."""
    zero = Vector(0.0, 0.0, 0.0)
    return Increment(Quaternion(1.0, 0.0, 0.0, 0.0), zero, zero, 0.0)


@kernel
def increment_of(rates: Vector, force: Vector, dt: float) -> Increment:
    """Of one reading: mean body rates [rad/s] and specific force [m/s2] of ``dt`` seconds."""
    gained = scaled(rotate(small_rotation(scaled(rates, 0.5 * dt)), force), dt)
    return Increment(small_rotation(scaled(rates, dt)), gained, scaled(gained, 0.5 * dt), dt)


@kernel
def joined(first: Increment, then: Increment) -> Increment:
    """One increment after another."""
    return Increment(
        normalised(multiply(first.rotation, then.rotation)),
        add(first.velocity, rotate(first.rotation, then.velocity)),
        add(add_scaled(first.position, first.velocity, then.time), rotate(first.rotation, then.position)),
        first.time + then.time,
    )


@kernel
def without(first: Increment, whole: Increment) -> Increment:
    """Increment that is left of a whole when its first part is taken off."""
    time = whole.time - first.time
    position = subtract(subtract(whole.position, first.position), scaled(first.velocity, time))
    return Increment(
        normalised(multiply(conjugate(first.rotation), whole.rotation)),
        rotate_inverse(first.rotation, subtract(whole.velocity, first.velocity)),
        rotate_inverse(first.rotation, position),
        time,
    )


@kernel
def rebiased(i: Increment, gyro: Vector, accel: Vector) -> Increment:
    """The increment as if the biases taken off its readings had been larger by so much, to first order."""
    t = i.time
    force = scaled(rotate(i.rotation, accel), 0.5)
    mean = add_scaled(force, accel, 0.5)
    return Increment(
        multiply(i.rotation, small_rotation(scaled(gyro, -t))),
        add_scaled(i.velocity, mean, -t),
        add_scaled(i.position, mean, -0.5 * t * t),
        t,
    )


@kernel
def moved_by(i: Increment, p: Vector, v: Vector, q: Quaternion, g: float) -> tuple[Vector, Vector, Quaternion]:
    """Position, velocity and attitude after an increment."""
    t = i.time
    at, speed = rotate(q, i.position), rotate(q, i.velocity)
    position = add(add_scaled(p, v, t), Vector(at.x, at.y, at.z - 0.5 * g * t * t))
    return (
        position,
        add(v, Vector(speed.x, speed.y, speed.z - g * t)),
        normalised(multiply(q, i.rotation)),
    )
