r"""Dryden's continuous turbulence, with all six components, by the forms of MIL-F-8785C (3.7.2).

.. math::
    \Phi_u = \sigma_u^2 \frac{2 L_u}{\pi V} \frac{1}{1 + (L_u \omega / V)^2}, \quad
    \Phi_{v,w} = \sigma^2 \frac{L}{\pi V} \frac{1 + 3 (L \omega / V)^2}{[1 + (L \omega / V)^2]^2}

.. math::
    \Phi_p = \frac{\sigma_w^2}{V L_w} \frac{0.8\, (\pi L_w / 4 b)^{1/3}}{1 + (4 b \omega / \pi V)^2}, \quad
    \Phi_q = \frac{(\omega / V)^2}{1 + (4 b \omega / \pi V)^2} \Phi_w, \quad
    \Phi_r = \frac{(\omega / V)^2}{1 + (3 b \omega / \pi V)^2} \Phi_v

The axes are those of the mean wind, as the specification has them at low altitude: u along it, w upwards. The states
are of unit variance, so that intensity and length may change with the place. p, q and r are the rotation of the air
as the span b feels it, about those axes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model.arithmetic import clipped, decay
from sitl.model.vectors import Vector

FOOT = 0.3048  # [m]
MIN_FEET, MAX_FEET = 10.0, 1000.0  # of the low-altitude model [ft]
ROOT_3 = math.sqrt(3.0)
MAX_STEP = 0.5  # of a filter, in its time constants


class Eddies(NamedTuple):
    """States of the forming filters, of unit variance."""

    along: float
    across: float
    across_slow: float
    up: float
    up_slow: float
    roll: float
    across_smooth: float  # the lateral gust as the span averages it
    up_smooth: float


class Scales(NamedTuple):
    """Deviations [m/s] and lengths [m] of the three components."""

    along: float
    across: float
    up: float
    length_along: float
    length_across: float
    length_up: float


class Stirred(NamedTuple):
    """Turbulence at one place and time, in the axes of the mean wind (along, left, up)."""

    velocity: Vector  # [m/s]
    rotation: Vector  # [rad/s]


@subroutine
def root(x: float, degree: int) -> float:
    """The root of a positive number by Newton's steps: additions, multiplications and divisions alone."""
    y = 1.0 + (x - 1.0) / degree if x >= 1.0 else 1.0
    for _ in range(60):
        power = 1.0
        for _ in range(degree - 1):
            power *= y
        y += (x / power - y) / degree
    return y


@kernel
def low_altitude(height: float, wind_at_6_m: float) -> Scales:
    """Scales of the specification's low-altitude model (below 1000 ft).

    Args:
        height: Above the ground [m].
        wind_at_6_m: Steady wind 20 ft above the ground [m/s].
    """
    h = clipped(height / FOOT, MIN_FEET, MAX_FEET)
    base = root(0.177 + 0.000823 * h, 5)
    fold = base * base  # to the power of 0.4
    up, length = 0.1 * wind_at_6_m, FOOT * h / (fold * fold * fold)
    return Scales(
        along=up / fold, across=up / fold, up=up, length_along=length, length_across=length, length_up=FOOT * h
    )


@kernel
def _first_order(x: float, noise: float, step: float) -> float:
    keep = decay(step)
    return keep * x + math.sqrt(1.0 - keep * keep) * noise


@kernel
def _followed(slow: float, x: float, after: float, step: float) -> float:
    """A filter of one time constant behind ``x``, which went to ``after``."""
    keep = decay(step)
    return keep * slow + (1.0 - keep) * 0.5 * (x + after)


@kernel
def _transverse(fast: float, slow: float) -> float:
    return (ROOT_3 * fast + (1.0 - ROOT_3) * slow) * math.sqrt(0.5)


@kernel
def stirred(
    eddies: Eddies, noise: tuple[float, float, float, float], scales: Scales, airspeed: float, span: float, dt: float
) -> Eddies:
    """The filters a step later.

    Args:
        eddies: As they are.
        noise: Independent unit normals: of u, v, w and p.
        scales: At the vehicle's place.
        airspeed: Through the air on the mean, above 0 [m/s].
        span: Of the wing [m].
        dt: Step [s].
    """
    run = airspeed * dt
    step_across, step_up = min(run / scales.length_across, MAX_STEP), min(run / scales.length_up, MAX_STEP)
    across, up = _first_order(eddies.across, noise[1], step_across), _first_order(eddies.up, noise[2], step_up)
    across_slow = _followed(eddies.across_slow, eddies.across, across, step_across)
    up_slow = _followed(eddies.up_slow, eddies.up, up, step_up)
    passing_q, passing_r = min(run * math.pi / (4.0 * span), MAX_STEP), min(run * math.pi / (3.0 * span), MAX_STEP)
    before_v, before_w = _transverse(eddies.across, eddies.across_slow), _transverse(eddies.up, eddies.up_slow)
    return Eddies(
        along=_first_order(eddies.along, noise[0], min(run / scales.length_along, MAX_STEP)),
        across=across,
        across_slow=across_slow,
        up=up,
        up_slow=up_slow,
        roll=_first_order(eddies.roll, noise[3], passing_q),
        across_smooth=_followed(eddies.across_smooth, before_v, _transverse(across, across_slow), passing_r),
        up_smooth=_followed(eddies.up_smooth, before_w, _transverse(up, up_slow), passing_q),
    )


@kernel
def turbulence(eddies: Eddies, scales: Scales, span: float) -> Stirred:
    """Velocity and rotation of the air.

    A filter s / (1 + T s) is the difference of what goes in and what T smooths of it, over T; so the airspeed cancels.
    """
    v, w = _transverse(eddies.across, eddies.across_slow), _transverse(eddies.up, eddies.up_slow)
    length = scales.length_up
    share = root(math.pi * length / (4.0 * span), 6)
    roll = scales.up * share * math.sqrt(0.8 * math.pi * math.pi / (8.0 * span * length))
    pitch = scales.up * (w - eddies.up_smooth) * math.pi / (4.0 * span)
    yaw = scales.across * (v - eddies.across_smooth) * math.pi / (3.0 * span)
    return Stirred(
        Vector(scales.along * eddies.along, scales.across * v, scales.up * w),
        Vector(roll * eddies.roll, pitch, -yaw),
    )
