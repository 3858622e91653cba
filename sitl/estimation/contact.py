"""Whether the vehicle stands on something: what it is told of the ground, having no switch there.

On the ground something else than air and propellers holds the vehicle up. That is the difference between what
the accelerometer feels and what the model makes of air and propellers. An unknown wind may push as well: contact is
believed only beyond what the filter itself doubts of the air, so a gust is no ground. While the nose is up the ground
may be at any height; near that where flights begin, less support is enough. With the nose low a strong wind carries the
vehicle as a wing, and its unknown part may be large: there the ground has to carry most of the weight, and the vehicle
has to be low.
"""

from __future__ import annotations

from sitl.compiled import kernel
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import decay
from sitl.model.quaternions import Quaternion, rotate, rotate_inverse
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add_scaled, norm

SMOOTHED = 0.1  # time constant of the support [s]
TOUCHES, LEAVES = 0.35, 0.15  # support on the ground and off it, as shares of the weight
LOW_TOUCHES, LOW = 0.2, 0.6  # support on the ground where it is expected, below this height [-], [m]
LIES = 0.7  # support on the ground of a vehicle whose nose is low: no thrust carries it [-]
LOW_NOSE = 0.5  # upward part of its nose, 30 deg above level [-]
MAX_LYING_HEIGHT = 1.0  # so high it may lie, beyond what its height is doubted [m]
SURE = 2.0  # how many of its deviations the air is not believed to push beyond
MAX_CONTACT_SPEED = 2.0  # nothing that moves faster is said to stand [m/s]


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
def smoothed(value: float, before: float, dt: float) -> float:
    """The support, smoothed."""
    return before + (1.0 - decay(dt / SMOOTHED)) * (value - before)


@kernel
def stands(
    support: float,
    doubt: float,
    nose_up: float,
    stood: bool,
    height: float,
    least_height: float,
    velocity: Vector,
    g: float,
) -> bool:
    """Whether a vehicle stands on the ground, with hysteresis.

    Args:
        support: Upward acceleration that neither air nor propellers make [m/s2].
        doubt: Deviation of what the air is believed to push upwards [m/s2].
        nose_up: Upward part of the nose's direction [-].
        stood: Whether it stood before.
        height: Above where its flights begin [m].
        least_height: The least of it that is believed [m].
        velocity: World NWU [m/s].
        g: Gravity [m/s2].
    """
    touches = LOW_TOUCHES if height < LOW else TOUCHES
    least = (LEAVES if stood else touches) * g + SURE * doubt
    if nose_up < LOW_NOSE:
        least = max(least, LIES * g)
        if least_height > MAX_LYING_HEIGHT:
            return False
    return support > least and norm(velocity) < MAX_CONTACT_SPEED
