r"""The level of the gusts, as the force across the wing tells it.

Dryden's turbulence of deviation :math:`\sigma` drives the wind by :math:`2 \sigma^2 / \tau` a second on each axis, and
the force that the believed wind does not explain by as much times the square of its slope. A scalar filter follows that
force :math:`r`; its innovations :math:`\nu` are white, of variance :math:`S`, if :math:`\sigma` is right. By the
derivative of their likelihood, with :math:`l = \ln \sigma^2` of variance :math:`V`,

.. math::
    l \leftarrow l + \tfrac{1}{2} V h (\nu^2 / S - 1), \quad h = S^{-1}\, dS / dl, \quad
    V^{-1} \leftarrow V^{-1} + \tfrac{1}{2} h^2.

What lasts, an unknown wind along the span or what the model lacks, is followed too and tells nothing of gusts.

How much the model of the force lacks is told likewise by the innovations of the wind's own filter, which go together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.arithmetic import clipped
from sitl.model.vectors import Vector, dot, subtract
from sitl.storage import replacing

FIXED_LEVEL = 0.5  # of a filter that does not meter the gusts, rms per axis [m/s]
FIRST_LEVEL = 0.2  # of one that does, before anything is known of them [m/s]
LEAST_LEVEL, MOST_LEVEL = 0.05, 2.5  # that are believed [m/s]
FIRST_DOUBT = 4.0  # variance of the logarithm of its square before anything is known
CHANGES = 0.002  # which that gains, as the weather changes [1/s]
MOST_CHANGE = 0.2  # of that logarithm, by one reading
LACKS = 0.1  # of the force that the believed wind makes, as it changes: variance by m/s2, rooted
BENDS = 0.1  # of the change of what no slope tells, likewise [-]
LEAST_STEEP = 0.2  # of the slope's square, where what is felt tells of less [-]
BLURRED = 1.0 / 6.0  # of what gusts drive in a step, by which means differ the less
FIRST_RESIDUAL = 1.0  # deviation of the force that is not explained, when the air is felt anew [m/s2]
# What the model of the wing's force lacks, as a share: two constants that are a tenth off make it 0.14.
FIRST_SHARE, LEAST_SHARE, MOST_SHARE = 0.07, 0.005, 0.15  # deviation at first, and least and greatest [-]
FIRST_SHARE_DOUBT = 4.0  # variance of the logarithm of its square
ALIKE = 100.0  # innovations that go together, as what a model lacks lasts


class LackingModel(NamedTuple):
    """Belief about the model of the wing's force."""

    share: float  # deviation of what it lacks [-]
    doubt: float  # variance of the logarithm of its square


@kernel
def lacking_after(m: LackingModel, innovation: float, lacks: float, variance: float) -> LackingModel:
    """The belief after an innovation of the force, by the derivative of its likelihood as for the gusts.

    Args:
        m: Before.
        innovation: Of the force [m/s2].
        lacks: Part of its variance by what the model lacks and the believed wind does not explain [m2/s4].
        variance: Of the innovation [m2/s4].
    """
    told = lacks / variance
    doubt = m.doubt / (1.0 + m.doubt * told * told * (0.5 / ALIKE))
    change = clipped(doubt * told * (innovation * innovation / variance - 1.0) * (0.5 / ALIKE), -0.1, 0.1)
    share = m.share * math.sqrt((1.0 + 0.5 * change) / (1.0 - 0.5 * change))
    return LackingModel(clipped(share, LEAST_SHARE, MOST_SHARE), doubt)


class GustMeter(NamedTuple):
    """Belief about the gusts' level, and the scalar filter that tells it."""

    level: float  # deviation per axis [m/s]
    doubt: float  # variance of the logarithm of its square
    residual: float  # force across the wing that the believed wind does not explain [m/s2]
    variance: float  # of that, lessened by the means that are read [m2/s4]
    sensitivity: float  # derivative of that variance by the logarithm [m2/s4]
    made: float  # force that the believed wind made at the last reading [m/s2]
    bend: float  # variance of that by what no slope tells [m2/s4]
    through: Vector  # airspeed that was believed at the last reading, body FLU [m/s]
    corrected: Vector  # by what it was corrected since, body FLU [m/s]
    growth: float  # of the level by the last reading, as a factor


with_corrected = replacing(GustMeter, "corrected")


class Felt(NamedTuple):
    """A reading of the force across the wing."""

    innovation: float  # beside what the believed wind makes of it [m/s2]
    made: float  # what the believed wind makes of it [m/s2]
    slope: Vector  # derivative of that by the velocity through the air, body FLU [1/s]
    steep: float  # mean square of the slope's parts along nose and span [1/s2]
    curve: float  # derivative of the slope across the wing by the speed across it [1/m]
    raised: float  # by how much the wind's uncertainty across the wing raises what it makes [m/s2]
    bend: float  # variance by what no slope tells [m2/s4]
    noise: float  # variance of the reading [m2/s4]
    step: float  # since the last one over the duration of a gust [-]


@kernel
def unknown_gusts(level: float) -> GustMeter:
    """Before anything is felt of them; ``level`` is expected [m/s]."""
    still = Vector(0.0, 0.0, 0.0)
    return GustMeter(
        level=level,
        doubt=FIRST_DOUBT,
        residual=0.0,
        variance=FIRST_RESIDUAL * FIRST_RESIDUAL,
        sensitivity=0.0,
        made=0.0,
        bend=0.0,
        through=still,
        corrected=still,
        growth=1.0,
    )


@kernel
def felt_anew(m: GustMeter) -> GustMeter:
    """The level as it is believed, with nothing known of the force: what is felt is not the air alone."""
    unknown = FIRST_RESIDUAL * FIRST_RESIDUAL
    return GustMeter(
        level=m.level,
        doubt=m.doubt,
        residual=0.0,
        variance=unknown,
        sensitivity=0.0,
        made=m.made,
        bend=m.bend,
        through=m.through,
        corrected=m.corrected,
        growth=1.0,
    )


@kernel
def corrected_by(m: GustMeter, through: Vector) -> GustMeter:
    """The belief once the velocity through the air is believed to be another, body FLU [m/s]."""
    return with_corrected(m, subtract(through, m.through))


@kernel
def metered(m: GustMeter, felt: Felt, through: Vector, dt: float) -> GustMeter:
    """The belief after one more reading.

    Args:
        m: Before.
        felt: The reading.
        through: Velocity through the air that was believed when it was made, body FLU [m/s].
        dt: Since the last one [s].
    """
    residual = m.residual - dot(felt.slope, m.corrected)
    # A parabola's slope squared changes with its height: what is felt tells how steep the force is where the air is.
    steep = felt.slope.z * felt.slope.z + 2.0 * felt.curve * (residual + felt.raised)
    steep = felt.steep + max(steep, LEAST_STEEP * felt.slope.z * felt.slope.z)
    driven = steep * 2.0 * m.level * m.level * felt.step
    variance, sensitivity = m.variance + driven, m.sensitivity + driven
    variance += LACKS * LACKS * abs(felt.made - m.made) + BENDS * abs(felt.bend - m.bend)
    # Means of a wander over steps that follow one another change by less than it does, and alike: as if their noise
    # were less than none by a sixth of what a step adds.
    blurred = BLURRED * driven
    noise = felt.noise - blurred
    whole = variance + noise
    off = felt.innovation - residual
    told = (sensitivity - blurred) / whole
    doubt = m.doubt + CHANGES * dt
    doubt = doubt / (1.0 + 0.5 * doubt * told * told)
    change = clipped(0.5 * doubt * told * (off * off / whole - 1.0), -MOST_CHANGE, MOST_CHANGE)
    level = m.level * math.sqrt((1.0 + 0.5 * change) / (1.0 - 0.5 * change))
    level = clipped(level, LEAST_LEVEL, MOST_LEVEL)
    remaining = noise / whole
    taken = 1.0 - remaining
    return GustMeter(
        level=level,
        doubt=doubt,
        residual=felt.innovation - remaining * off,
        variance=remaining * variance,
        sensitivity=remaining * remaining * sensitivity - taken * taken * blurred,
        made=felt.made,
        bend=felt.bend,
        through=through,
        corrected=Vector(0.0, 0.0, 0.0),
        growth=level / m.level,
    )
