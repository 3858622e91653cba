r"""Universal transverse Mercator, from metres to degrees: fixed wings of Paparazzi tell their places in it.

Krueger's series in the third flattening n, to its third order (0.1 mm within a zone):

.. math::
    \xi' + i \eta' = \zeta - \sum_j \beta_j \sin 2 j \zeta, \quad \zeta = (N + i E) / (k_0 A), \quad
    \sin \chi = \sin \xi' / \cosh \eta', \quad \tan \lambda = \sinh \eta' / \cos \xi', \quad
    \phi = \chi + \sum_j \delta_j \sin 2 j \chi

C. F. F. Karney, Transverse Mercator with an accuracy of a few nanometers, J. Geodesy 85, 2011.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SEMI_MAJOR, FLATTENING = 6_378_137.0, 1.0 / 298.257223563  # of WGS84 [m], [-]
CENTRAL_SCALE, FALSE_EASTING = 0.9996, 500_000.0  # on the zone's meridian [-], [m]
ZONE_WIDTH = 6.0  # zone 1 begins at 180 deg west [deg]
_N = FLATTENING / (2.0 - FLATTENING)
_RADIUS = SEMI_MAJOR / (1.0 + _N) * (1.0 + _N**2 / 4.0 + _N**4 / 64.0)  # of the rectified sphere [m]
_BETA = (
    _N / 2.0 - 2.0 * _N**2 / 3.0 + 37.0 * _N**3 / 96.0,
    _N**2 / 48.0 + _N**3 / 15.0,
    17.0 * _N**3 / 480.0,
)
_DELTA = (
    2.0 * _N - 2.0 * _N**2 / 3.0 - 2.0 * _N**3,
    7.0 * _N**2 / 3.0 - 8.0 * _N**3 / 5.0,
    56.0 * _N**3 / 15.0,
)


def from_utm(east: Floats, north: Floats, zone: Floats) -> tuple[Floats, Floats]:
    """Latitude and longitude [deg], (n,) each.

    Args:
        east: Easting, (n,) [m].
        north: Northing from the equator, negative south of it, (n,) [m].
        zone: Number of the zone, 1 to 60, (n,).
    """
    plane = (north + 1j * (east - FALSE_EASTING)) / (CENTRAL_SCALE * _RADIUS)
    with np.errstate(over="ignore", invalid="ignore"):
        sphere = plane - sum(beta * np.sin(2 * j * plane) for j, beta in enumerate(_BETA, 1))
        chi = np.arcsin(np.sin(sphere.real) / np.cosh(sphere.imag))
        lon = np.arctan2(np.sinh(sphere.imag), np.cos(sphere.real))
    lat = chi + sum(delta * np.sin(2 * j * chi) for j, delta in enumerate(_DELTA, 1))
    return np.degrees(lat), np.degrees(lon) + ZONE_WIDTH * (zone - 0.5) - 180.0
