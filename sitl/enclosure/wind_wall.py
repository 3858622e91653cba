r"""The mean speed of the air that a rectangular outlet, such as a wind wall, blows into still air.

Reichardt's turbulent momentum diffusion: across the jet the flux of momentum spreads as heat does, its width growing
with the distance x from the outlet. For an outlet of width 2 b and height 2 h that blows at U_0

.. math::
    \frac{U^2}{U_0^2} = \tfrac14
        \Bigl[\operatorname{erf}\tfrac{y + b}{c x} - \operatorname{erf}\tfrac{y - b}{c x}\Bigr]
        \Bigl[\operatorname{erf}\tfrac{z + h}{c x} - \operatorname{erf}\tfrac{z - h}{c x}\Bigr]

which keeps the momentum, has a core of U_0 and, far away, the decay of a round jet. One constant c makes all of it;
docs/arena.md compares it with measured jets. The floor mirrors the jet. Air that is drawn in from the sides and what
the room sends back are left out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model.vectors import Vector

JET_SPREAD = 0.083  # c: half width of the momentum's profile over the distance [-]
MIN_WIDTH = 0.02  # of the mixing layer, at the outlet itself [m]


class Outlet(NamedTuple):
    """A rectangle that air is blown out of, normal to it."""

    centre: Vector  # world NWU [m]
    along: Vector  # where it blows, level and of unit length
    half_width: float  # [m]
    half_height: float  # [m]


@kernel
def error_function(x: float) -> float:
    """Erf within 3e-7 (Abramowitz and Stegun 7.1.28), of the same bits on every processor."""
    t = abs(x)
    s = 0.0002765672 + t * 0.0000430638
    s = 0.0001520143 + t * s
    s = 0.0092705272 + t * s
    s = 0.0422820123 + t * s
    s = 1.0 + t * (0.0705230784 + t * s)
    s = s * s
    s = s * s
    s = s * s
    s = s * s
    value = 1.0 - 1.0 / s
    return value if x >= 0.0 else -value


@kernel
def _strip(offset: float, half: float, width: float) -> float:
    return 0.5 * (error_function((offset + half) / width) - error_function((offset - half) / width))


@kernel
def downstream(outlet: Outlet, place: Vector) -> float:
    """Distance before the outlet [m]."""
    return (place.x - outlet.centre.x) * outlet.along.x + (place.y - outlet.centre.y) * outlet.along.y


@subroutine
def speed_share(outlet: Outlet, place: Vector) -> float:
    """Mean speed at a place, world NWU [m], over that at the outlet, 0..1."""
    x = downstream(outlet, place)
    y = (place.y - outlet.centre.y) * outlet.along.x - (place.x - outlet.centre.x) * outlet.along.y
    width = MIN_WIDTH + JET_SPREAD * max(x, 0.0)
    level = _strip(y, outlet.half_width, width)
    upright = _strip(place.z - outlet.centre.z, outlet.half_height, width)
    upright += _strip(place.z + outlet.centre.z, outlet.half_height, width)
    square = max(level * upright, 0.0)
    return math.sqrt(min(square, 1.0)) if x > 0.0 else 0.0
