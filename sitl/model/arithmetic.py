"""Elementary functions from additions, multiplications, divisions and square roots alone.

Those four are rounded the same way by every processor; the C library's sine is not, nor does it compile to vector
instructions. So one seed is one flight on every machine, and a batch flies it to the bit.
"""

import math

from sitl.compiled import kernel

_ROUND = 6755399441055744.0  # 1.5 * 2**52: adding and subtracting it rounds to a whole number
_TURN = 6.283185307179586
# pi / 2 in three parts, the first two short enough for exact products with whole numbers below 2**20.
_QUARTER_1, _QUARTER_2, _QUARTER_3 = 1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21
_TAN_PI_8 = 0.41421356237309503


@kernel
def clipped(x: float, low: float, high: float) -> float:
    """X limited to [low, high]; of a NaN, ``low``."""
    return min(max(x, low), high)


@kernel
def rounded(x: float) -> float:
    """The nearest whole number, for abs(x) < 2**51."""
    return (x + _ROUND) - _ROUND


@kernel
def wrapped(angle: float) -> float:
    """The angle less whole turns, within [-pi, pi] [rad]."""
    return angle - _TURN * rounded(angle / _TURN)


@kernel
def sine_cosine(x: float) -> tuple[float, float]:
    """Sine and cosine, each within 1.5e-16 of the true value for abs(x) < 1e6 [rad]."""
    quarter = rounded(x * (2.0 / math.pi))
    r = ((x - quarter * _QUARTER_1) - quarter * _QUARTER_2) - quarter * _QUARTER_3
    z = r * r
    # Minimax polynomials on [-pi/4, pi/4] (those of fdlibm).
    s = 2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
    s = -1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * s))
    s = r + r * z * s
    c = 2.48015872894767294178e-05 + z * (
        -2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11)
    )
    c = 4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * c)
    c = 1.0 - (0.5 * z - z * z * c)
    turned = quarter - 4.0 * rounded(0.25 * quarter)  # -2 .. 2
    odd = abs(turned) == 1.0
    sine, cosine = (c if odd else s), (s if odd else c)
    back = abs(turned) == 2.0
    sine = -sine if back or turned == -1.0 else sine
    cosine = -cosine if back or turned == 1.0 else cosine
    return sine, cosine


@kernel
def arctangent(y: float, x: float) -> float:
    """Angle of the point (x, y) from the x axis, in [-pi, pi] [rad]; 0 at the origin; within 2 ulp."""
    high, low = max(abs(x), abs(y)), min(abs(x), abs(y))
    t = low / high if high > 0.0 else 0.0
    steep = t > _TAN_PI_8
    t = (t - 1.0) / (t + 1.0) if steep else t
    z = t * t
    # Rational approximation on [-tan(pi/8), tan(pi/8)] (that of Cephes).
    p = -7.500855792314704667340e1 + z * (-1.615753718733365076637e1 - z * 8.750608600031904122785e-1)
    p = -6.485021904942025371773e1 + z * (-1.228866684490136173410e2 + z * p)
    q = 4.328810604912902668951e2 + z * (1.650270098316988542046e2 + z * (2.485846490142306297962e1 + z))
    q = 1.945506571482613964425e2 + z * (4.853903996359136964868e2 + z * q)
    angle = t + t * z * (p / q)
    angle = angle + 0.25 * math.pi if steep else angle
    angle = 0.5 * math.pi - angle if abs(y) > abs(x) else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@kernel
def exponential(x: float) -> float:
    """E to the power of x, within 1e-12 of its value, for x between -100 and 100."""
    r = x * (1.0 / 1024.0)
    value = 1.0 / 720.0 + r * (1.0 / 5040.0 + r * (1.0 / 40320.0 + r / 362880.0))
    value = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * value)))))
    for _ in range(10):
        value = value * value
    return value


@kernel
def decay(x: float) -> float:
    """E to the power of -x for steps much shorter than a time constant: within x**5 / 720 of its value, x >= 0."""
    even, odd = 1.0 + x * x * (1.0 / 12.0), 0.5 * x
    return (even - odd) / (even + odd)


@kernel
def heading_trigonometry(heading: float) -> tuple[float, float, float, float]:
    """Sine and cosine of half the angle, then of the whole."""
    sh, ch = sine_cosine(0.5 * heading)
    return sh, ch, 2.0 * sh * ch, ch * ch - sh * sh
