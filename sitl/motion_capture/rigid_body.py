"""The rigid body that Motive tracks: its markers, and the pose that fits them best."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from protocol.tools.files import decode_text
from sitl.errors import SitlError
from sitl.model.airframe import Array

MIN_MARKERS, MAX_MARKERS = 3, 8
MIN_MARKER_AREA = 1e-4  # that three markers span at least, so that they tell an attitude [m2]
MAX_MARKER_DISTANCE = 5.0  # of a marker [m]
MAX_NAME = 63  # bytes
MAX_NUMBER = 0x7FFF


class RigidBodyError(SitlError):
    """A rigid body cannot be used; the message names file and key."""


class MarkerPose(NamedTuple):
    """The pose that fits labelled markers best, in the least squares."""

    position: Array  # of the body's reference point [m]
    attitude: Rotation
    marker_error: float  # mean distance of the markers from where the pose puts them [m]


class RigidBody(NamedTuple):
    """Markers on a vehicle."""

    name: str
    number: int
    marker_names: tuple[str, ...]
    markers: Array  # body FLU, (n, 3) [m]
    streamed_markers: tuple[tuple[float, float, float], ...] = ()  # in the stream's axes, as the body was made [m]

    def made(self, attitude: Rotation) -> RigidBody:
        """The body as Motive stores it.

        Args:
            attitude: Body FLU to the stream's axes when it was made: then its quaternion is one.
        """
        return self._replace(streamed_markers=tuple(map(tuple, attitude.apply(self.markers).tolist())))

    def swapped(self) -> tuple[int, ...]:
        """The order of the markers that is most easily taken for the true one."""
        orders = list(itertools.permutations(range(len(self.markers))))[1:]
        return min(orders, key=lambda order: pose_by_markers(self.markers[list(order)], self.markers).marker_error)

    def attitude_spread(self, noise: float) -> Array:
        """Standard deviation of the attitude about each body axis for a noise of each marker [m]: [rad]."""
        r = self.markers - self.markers.mean(axis=0)
        spread: Array = noise / np.sqrt((r**2).sum() - (r**2).sum(axis=0))
        return spread


def pose_by_markers(seen: Array, made: Array) -> MarkerPose:
    """The rotation and translation that bring markers as they were made to where they are seen (Kabsch).

    Args:
        seen: Positions, (n, 3) [m].
        made: The same markers in the body, (n, 3) [m].
    """
    seen_middle, made_middle = seen.mean(axis=0), made.mean(axis=0)
    attitude, _ = Rotation.align_vectors(seen - seen_middle, made - made_middle)
    position = seen_middle - attitude.apply(made_middle)
    off = seen - position - attitude.apply(made)
    return MarkerPose(position, attitude, float(np.linalg.norm(off, axis=1).mean()))


def load_rigid_body(path: str | None = None) -> RigidBody:
    """The rigid body that is shipped, or that of a TOML file.

    Raises:
        RigidBodyError: The file is not valid; the message names file and key.
    """
    source = path or str(files("sitl.motion_capture.rigid_bodies").joinpath("darko_markers.toml"))
    try:
        raw = tomllib.loads(decode_text(Path(source).read_bytes()))
    except OSError as error:
        raise RigidBodyError(f"{source}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeError) as error:
        raise RigidBodyError(f"{source}: not a TOML file: {error}") from error
    return _checked(source, raw)


def _checked(source: str, raw: dict[str, Any]) -> RigidBody:
    head, markers = raw.get("body"), raw.get("markers")
    if raw.keys() != {"body", "markers"} or not isinstance(head, dict) or not isinstance(markers, dict):
        raise RigidBodyError(f"{source}: must have the tables [body] and [markers.NAME], and no others")
    name, number = head.get("name"), head.get("number")
    if head.keys() != {"name", "number"} or not isinstance(name, str) or not 0 < len(name.encode()) <= MAX_NAME:
        raise RigidBodyError(f"{source}: [body] must have name (at most {MAX_NAME} bytes) and number")
    if isinstance(number, bool) or not isinstance(number, int) or not 0 < number <= MAX_NUMBER:
        raise RigidBodyError(f"{source}: body.number = {number!r} is not from 1 to {MAX_NUMBER}")
    if not MIN_MARKERS <= len(markers) <= MAX_MARKERS:
        raise RigidBodyError(f"{source}: {len(markers)} markers; from {MIN_MARKERS} to {MAX_MARKERS} are needed")
    places = np.array([_place(f"{source}: markers.{key}", entry) for key, entry in markers.items()])
    if _greatest_area(places) < MIN_MARKER_AREA:
        raise RigidBodyError(f"{source}: the markers lie on a line: they tell no attitude")
    return RigidBody(name, number, tuple(markers), places)


def _place(where: str, entry: object) -> tuple[float, ...]:
    if not isinstance(entry, dict) or entry.keys() != {"value", "unit", "source"}:
        raise RigidBodyError(f'{where} must be {{ value = [x, y, z], unit = "m", source = ... }}')
    value, unit = entry["value"], entry["unit"]
    if unit != "m":
        raise RigidBodyError(f"{where} is in {unit!r}, must be in 'm'")
    if not isinstance(entry["source"], str) or not entry["source"]:
        raise RigidBodyError(f"{where} names no source")
    if not isinstance(value, list) or len(value) != 3 or not all(map(_is_length, value)):
        raise RigidBodyError(f"{where} = {value!r} is not three numbers within {MAX_MARKER_DISTANCE:g} m")
    return tuple(map(float, value))


def _is_length(number: object) -> bool:
    return isinstance(number, int | float) and not isinstance(number, bool) and abs(number) <= MAX_MARKER_DISTANCE


def _greatest_area(places: Sequence[Array] | Array) -> float:
    corners = itertools.combinations(places, 3)
    return max(float(np.linalg.norm(np.cross(b - a, c - a))) / 2.0 for a, b, c in corners)
