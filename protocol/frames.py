"""Coordinate frames: those the vehicle computes in, those on the wire, and the conversions.

- World: NWU inside (x north, y west, z up), NED on the wire (north, east, down). Body: FLU inside (x along
  the nose, y left, z up), FRD on the wire. Each pair differs by half a turn about x, so one function converts in
  both directions.
- Quaternions are (w, x, y, z), of unit length, and rotate body vectors into the world: v_W = R(q) v_B.
- Tail-sitter: two body frames. In that of forward flight, which everything inside uses, x is along the nose: level
  flight has pitch 0, a nose-up hover pitch +90 deg. The hover frame, which goes over the wire as PX4's does, is pitched
  down from it by 90 deg: x is along the belly, the nose is at -z, a nose-up hover is level.
- ``repr_offset_q`` of ATTITUDE_QUATERNION only tells how to *show* the attitude: shown = q * repr_offset_q.
  With SHOW_AS_TOLD a display shows q itself, with SHOW_PITCHED_UP the frame of forward flight instead of the hover
  frame, with SHOW_PITCHED_DOWN the hover frame instead of that of forward flight.
- Geodetic: WGS84, latitude and longitude in degrees, altitude in metres above mean sea level.

Which MAV_FRAME means what is in ``protocol.names``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from protocol.errors import LocalProtocolError

COVARIANCE_SIZE = 21
"""Numbers of the triangle."""

COVARIANCE_DIAGONAL = (0, 6, 11, 15, 18, 20)
"""Where the triangle holds the variances."""

POSITION_VARIANCES, ATTITUDE_VARIANCES = COVARIANCE_DIAGONAL[:3], COVARIANCE_DIAGONAL[3:]
"""The first three, of a position or a velocity, and the last three, of angles or rates."""


Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Array = Sequence[float] | NDArray[np.float64]

_HALF = math.sqrt(0.5)
SHOW_AS_TOLD: Quaternion = (1.0, 0.0, 0.0, 0.0)
SHOW_PITCHED_UP: Quaternion = (_HALF, 0.0, _HALF, 0.0)
SHOW_PITCHED_DOWN: Quaternion = (_HALF, 0.0, -_HALF, 0.0)

_A = 6378137.0  # WGS84 semi-major axis [m]
_E2 = 6.69437999014e-3  # WGS84 first eccentricity squared [-]
_MAX_LATITUDE = 89.9  # [deg] beyond it, meridians are too close for a tangent plane


def flip(v: Array) -> Vector:
    """NWU <-> NED for world vectors, FLU <-> FRD for body vectors (also rates and moments)."""
    return float(v[0]), -float(v[1]), -float(v[2])


def flip_quaternion(q: Array) -> Quaternion:
    """Attitude FLU -> NWU <-> attitude FRD -> NED."""
    return float(q[0]), float(q[1]), -float(q[2]), -float(q[3])


def multiply(p: Array, q: Array) -> Quaternion:
    """Hamilton product p q: the rotation q, then p."""
    pw, px, py, pz = (float(c) for c in p)
    qw, qx, qy, qz = (float(c) for c in q)
    return (
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


def rotate(q: Array, v: Array) -> Vector:
    """R(q) v: a body vector seen from the world."""
    conjugate = (float(q[0]), -float(q[1]), -float(q[2]), -float(q[3]))
    _, x, y, z = multiply(multiply(q, (0.0, float(v[0]), float(v[1]), float(v[2]))), conjugate)
    return x, y, z


def hover_attitude(q: Array) -> Quaternion:
    """The attitude of the hover frame, from that of the frame of forward flight; both FRD -> NED."""
    return multiply(q, SHOW_PITCHED_DOWN)


def flying_attitude(q: Array) -> Quaternion:
    """The attitude of the frame of forward flight, from that of the hover frame; both FRD -> NED."""
    return multiply(q, SHOW_PITCHED_UP)


def flying_attitudes(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Many attitudes at once, shape (n, 4), as :func:`flying_attitude` turns one."""
    w, x, y, z = q.T * _HALF
    return np.stack((w - y, x - z, w + y, x + z), axis=1)


def hover_axes(v: Array) -> Vector:
    """A body vector in the hover frame, from the frame of forward flight; both FRD."""
    return float(v[2]), float(v[1]), -float(v[0])


def flying_axes(v: Array) -> Vector:
    """A body vector in the frame of forward flight, from the hover frame; both FRD."""
    return -float(v[2]), float(v[1]), float(v[0])


def euler_from_quaternion(q: Array) -> Vector:
    """Roll, pitch, yaw [rad] (ZYX) of an attitude FRD -> NED; yaw in (-pi, pi].

    At pitch +-90 deg only yaw -+ roll is defined: roll is then 0 and yaw has the whole angle.
    """
    w, x, y, z = (float(c) for c in q)
    sine = 2.0 * (w * y - z * x)
    if abs(sine) > 1.0 - 1e-12:
        turn = 2.0 * math.atan2(-x if sine > 0.0 else x, w)
        return 0.0, math.copysign(math.pi / 2, sine), math.remainder(turn, 2.0 * math.pi)
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, math.asin(sine), yaw


def quaternion_from_euler(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Attitude FRD -> NED of roll, pitch, yaw [rad] (ZYX)."""
    about_x = (math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0)
    about_y = (math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0)
    about_z = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    return multiply(about_z, multiply(about_y, about_x))


def displayed(q: Array, repr_offset_q: Array) -> Quaternion:
    """The attitude to show: q * repr_offset_q; an offset of zeros means no offset."""
    return multiply(q, repr_offset_q if any(repr_offset_q) else SHOW_AS_TOLD)


def heading(q: Array) -> float:
    """Heading [rad] in [0, 2 pi), clockwise from north, of an attitude FRD -> NED.

    In forward flight it is the azimuth of the nose. Nose-up, the nose has no azimuth: then it is the azimuth of the
    belly, which is where the nose pointed before it was pulled up. Nose-down it is the azimuth of the back.
    """
    nose = rotate(q, (1.0, 0.0, 0.0))
    level = math.hypot(nose[0], nose[1]) >= abs(nose[2])
    north, east, _ = nose if level else rotate(q, (0.0, 0.0, math.copysign(1.0, -nose[2])))
    return math.atan2(east, north) % (2.0 * math.pi)


@dataclass(frozen=True, slots=True)
class Geodetic:
    """A point on WGS84."""

    lat_deg: float
    lon_deg: float
    alt: float  # [m] above mean sea level


class LocalFrame:
    """Tangent plane at ``origin``, its axes scaled by the ellipsoid's two radii of curvature there.

    It is linear in latitude and longitude, so a round trip only loses rounding. Compared with the true tangent plane,
    the horizontal error grows with the square of the distance: a few decimetres at 2 km.

    Raises:
        LocalProtocolError: The origin is not on the globe, or too near a pole.
    """

    def __init__(self, origin: Geodetic) -> None:
        if not (abs(origin.lat_deg) <= _MAX_LATITUDE and abs(origin.lon_deg) <= 180.0 and math.isfinite(origin.alt)):
            raise LocalProtocolError(f"there is no local frame at {origin}")
        self.origin = origin
        lat = math.radians(origin.lat_deg)
        w2 = 1.0 - _E2 * math.sin(lat) ** 2
        meridian = _A * (1.0 - _E2) / w2**1.5
        prime_vertical = _A / math.sqrt(w2)
        self._north_per_deg = math.radians(meridian + origin.alt)
        self._east_per_deg = math.radians((prime_vertical + origin.alt) * math.cos(lat))

    def to_ned(self, point: Geodetic) -> Vector:
        """North, east, down [m] of a point."""
        turn = math.remainder(point.lon_deg - self.origin.lon_deg, 360.0)
        north = (point.lat_deg - self.origin.lat_deg) * self._north_per_deg
        return north, turn * self._east_per_deg, self.origin.alt - point.alt

    def to_geodetic(self, ned: Array) -> Geodetic:
        """The point at north, east, down [m]."""
        lon = self.origin.lon_deg + float(ned[1]) / self._east_per_deg
        return Geodetic(
            lat_deg=self.origin.lat_deg + float(ned[0]) / self._north_per_deg,
            lon_deg=math.remainder(lon, 360.0),
            alt=self.origin.alt - float(ned[2]),
        )
