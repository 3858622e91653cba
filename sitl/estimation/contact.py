"""Whether the vehicle stands on something: what it is told of the ground, having no switch there.

On the ground something else than air and propellers holds the vehicle up. That is the difference between what the
accelerometer feels and what the model makes of air and propellers. An unknown wind may push as well: contact is
believed only beyond what the filter itself doubts of the air, so a gust is no ground. While the nose is up the ground
may be at any height; near that where flights begin less support is enough, and less still that comes suddenly to a
vehicle that wants to land, faster than a gust from below. With the nose low a strong wind carries the vehicle as a
wing, and its unknown part may be large: there the ground has to carry most of the weight, and the vehicle has to be
low.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import decay
from sitl.model.quaternions import Quaternion, rotate, rotate_inverse
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add_scaled, norm

SMOOTHED, OF_LATE = 0.1, 0.03  # time constants of the support, and of its second smoothing [s]
# A wanted touch exceeds that by so much of the weight and one deviation of the air [-], below this speed [m/s].
# Gusts of 1 m/s rms exceeded it by half as much, in 140 descents.
SUDDEN, SLOW_TOUCH = 0.08, 1.0
TOUCH_SHARE, LEAVE_SHARE = 0.35, 0.15  # of the weight that the ground carries: landed from the one on, until the other
LOW_TOUCH_SHARE, LOW = 0.3, 0.45  # the first where ground is expected, below this height [-], [m]
LIES = 0.7  # support on the ground of a vehicle whose nose is low: no thrust carries it [-]
LOW_NOSE = 0.5  # upward part of its nose, 30 deg above level [-]
MAX_LYING_HEIGHT = 1.0  # so high it may lie, beyond what its height is doubted [m]
MAX_FALLEN_HEIGHT = 4.0  # likewise, where it wants to land [m]
SURE = 2.0  # how many of its deviations the air is not believed to push beyond
MAX_CONTACT_SPEED = 2.0  # nothing that moves faster is said to stand [m/s]


class Support(NamedTuple):
    """Upward acceleration that neither air nor propellers make [m/s2]."""

    now: float
    of_late: float  # smoothed once more, so that a rise shows as a difference
    doubt: float  # deviation of what the air is believed to push upwards


class Posture(NamedTuple):
    """Attitude, height and motion of a vehicle that may stand, and what it wants."""

    nose_up: float  # upward part of the nose's direction [-]
    height: float  # above where its flights begin [m]
    least_height: float  # the least of it that is believed [m]
    velocity: Vector  # world NWU [m/s]
    stood: bool  # before
    lands: bool  # it wants to touch the ground


@kernel
def support_of(force: Vector, v: Vector, rates: Vector, q: Quaternion, actuators: Actuators, a: Airframe) -> float:
    """Upward acceleration that neither air nor propellers make [m/s2].

    Args:
        force: Specific force felt, body frame FLU [m/s2].
        v: Velocity through the air, world NWU [m/s].
        rates: Body rates [rad/s].
        q: Attitude.
        actuators: Where they are believed to be.
        a: The airframe as the vehicle knows it.
    """
    F, _ = wrench(rotate_inverse(q, v), rates, actuators, a)
    return rotate(q, add_scaled(force, F, -1.0 / a.m)).z


@kernel
def smoothed(value: float, before: float, dt: float, time: float) -> float:
    """The support, smoothed with a time constant [s]."""
    return before + (1.0 - decay(dt / time)) * (value - before)


@kernel
def stands(support: Support, g: float, posture: Posture) -> bool:
    """Whether a vehicle stands on the ground, with hysteresis.

    Args:
        support: By something else than air and propellers.
        g: Gravity [m/s2].
        posture: Of the vehicle.
    """
    touches = LOW_TOUCH_SHARE if posture.height < LOW else TOUCH_SHARE
    speed, rise = norm(posture.velocity), support.now - support.of_late
    touched = posture.stood or (posture.lands and rise > SUDDEN * g + support.doubt and speed < SLOW_TOUCH)
    least = (LEAVE_SHARE if touched else touches) * g + SURE * support.doubt
    if posture.nose_up < LOW_NOSE:
        least = max(least, LIES * g)
        if posture.least_height > (MAX_FALLEN_HEIGHT if posture.lands else MAX_LYING_HEIGHT):
            return False
    return support.now > least and speed < MAX_CONTACT_SPEED
