"""Shapes that the pilot lays over the maps, of a file: GeoJSON (RFC 7946) or KML (OGC 07-147r2)."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from protocol.errors import FileError
from protocol.frames import Geodetic
from protocol.tools.files import JsonTable, decode_text

MAX_OVERLAY = 16 << 20  # of a file
MAX_OVERLAY_POINTS = 50_000  # of all shapes: each is drawn again when the map moves
TOP_PROPERTY = "height"  # of a GeoJSON feature, as in OpenStreetMap: its top [m]
COLLECTION = "FeatureCollection"
PARTS = {"MultiPoint": "Point", "MultiLineString": "LineString", "MultiPolygon": "Polygon"}


class OverlayShape(NamedTuple):
    """A place (one point), a line, or an area."""

    name: str
    points: tuple[Geodetic, ...]
    is_area: bool = False
    top: float | None = None  # height above home of an area that stands in the way [m]; None: nothing stands there


Overlay = tuple[OverlayShape, ...]


def load_overlay(path: Path) -> Overlay:
    """The shapes of a file; KML if its first character is "<", else GeoJSON.

    Raises:
        FileError: It cannot be read, is too large, or is neither; the message names the place in it.
    """
    try:
        with path.open("rb") as opened:
            data = opened.read(MAX_OVERLAY + 1)
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    if len(data) > MAX_OVERLAY:
        raise FileError(f"{path}: longer than {MAX_OVERLAY} bytes")
    try:
        text = decode_text(data).strip()
    except UnicodeError as error:
        raise FileError(f"{path}: {error}") from None
    shapes = tuple(_kml(text, str(path)) if text.startswith("<") else _geojson(text, str(path)))
    if not shapes:
        raise FileError(f"{path}: holds no point, line or polygon")
    if sum(len(shape.points) for shape in shapes) > MAX_OVERLAY_POINTS:
        raise FileError(f"{path}: more than {MAX_OVERLAY_POINTS} points")
    return shapes


def _geojson(text: str, name: str) -> Iterator[OverlayShape]:
    try:
        whole = JsonTable(json.loads(text), name)
    except (ValueError, RecursionError) as error:
        raise FileError(f"{name}: neither GeoJSON nor KML: {error}") from None
    if whole.values.get("type") != COLLECTION:
        yield from _feature(whole)
        return
    for index in range(len(whole.rows("features"))):
        yield from _feature(whole.entry("features", index))


def _feature(table: JsonTable) -> Iterator[OverlayShape]:
    if table.values.get("type") != "Feature":
        yield from _geometry(table, "", None)
        return
    properties = table.table("properties") if table.values.get("properties") else table.made({})
    top = properties.number(TOP_PROPERTY, 0.0) if TOP_PROPERTY in properties.values else None
    if table.values.get("geometry") is not None:
        yield from _geometry(table.table("geometry"), str(properties.values.get("name") or ""), top)


def _geometry(table: JsonTable, name: str, top: float | None) -> Iterator[OverlayShape]:
    kind = str(table.values.get("type"))
    if kind == "GeometryCollection":
        for index in range(len(table.rows("geometries"))):
            yield from _geometry(table.entry("geometries", index), name, top)
    elif kind in PARTS:
        for part in table.rows("coordinates"):
            yield from _geometry(table.made({"type": PARTS[kind], "coordinates": part}), name, top)
    elif kind == "Point":
        yield OverlayShape(name, (_position(table, table.rows("coordinates")),))
    elif kind == "LineString":
        yield OverlayShape(name, tuple(_position(table, point) for point in table.rows("coordinates")))
    elif kind == "Polygon":
        for ring, points in enumerate(table.rows("coordinates")):
            if not isinstance(points, list):
                raise table.error("coordinates", "is not a list of rings")
            corners = tuple(_position(table, point) for point in points)
            yield OverlayShape("" if ring else name, corners, is_area=True, top=None if ring else top)
    else:
        raise table.error("type", f"{kind!r} is no geometry of GeoJSON")


def _position(table: JsonTable, point: object) -> Geodetic:
    if not isinstance(point, list) or len(point) < 2:
        raise table.error("coordinates", "a position is a list of longitude and latitude")
    lon, lat = table.made({"coordinates": point[:2]}).numbers("coordinates", 2)
    if not (abs(lat) <= 90.0 and abs(lon) <= 180.0):
        raise table.error("coordinates", f"{lon:g}, {lat:g} is not on the globe: GeoJSON begins with the longitude")
    return Geodetic(lat, lon, 0.0)


def _kml(text: str, name: str) -> Iterator[OverlayShape]:
    try:
        root: Element = fromstring(text)
    except ParseError as error:
        raise FileError(f"{name}: not KML: {error}") from None
    except DefusedXmlException as error:
        raise FileError(f"{name}: not read: {type(error).__name__}") from None
    if _tag(root) != "kml":
        raise FileError(f"{name}: <{_tag(root)}> where <kml> was expected")
    for mark in (element for element in root.iter() if _tag(element) == "Placemark"):
        title = next((child.text or "" for child in mark if _tag(child) == "name"), "").strip()
        for element in mark.iter():
            kind = _tag(element)
            if kind in {"Point", "LineString", "LinearRing"}:
                yield _placed(element, kind, title, f"{name}: {title or 'Placemark'}")
            elif kind == "Polygon":
                yield from _rings(element, title, f"{name}: {title or 'Placemark'}")


def _rings(polygon: Element, title: str, where: str) -> Iterator[OverlayShape]:
    """The outline of a polygon that stands on the ground, with its height; its rings are found by themselves."""
    is_tall = any(_tag(child) == "extrude" and (child.text or "").strip() in {"1", "true"} for child in polygon)
    heights = [point[2] for ring in polygon.iter() if _tag(ring) == "coordinates" for point in _points(ring, where)]
    if is_tall and heights:
        ring = next(ring for ring in polygon.iter() if _tag(ring) == "coordinates")
        corners = tuple(Geodetic(lat, lon, 0.0) for lon, lat, _ in _points(ring, where))
        yield OverlayShape(title, corners, is_area=True, top=max(heights))


def _placed(element: Element, kind: str, title: str, where: str) -> OverlayShape:
    points = [point for child in element if _tag(child) == "coordinates" for point in _points(child, where)]
    if not points:
        raise FileError(f"{where}: <{kind}> without coordinates")
    places = tuple(Geodetic(lat, lon, 0.0) for lon, lat, _ in points)
    return OverlayShape(title, places[:1] if kind == "Point" else places, is_area=kind == "LinearRing")


def _points(coordinates: Element, where: str) -> list[tuple[float, float, float]]:
    """Longitude, latitude [deg] and altitude [m] of each point."""
    found = []
    for text in (coordinates.text or "").split():
        try:
            lon, lat, *rest = (float(part) for part in text.split(","))
        except ValueError:
            lon = lat = math.nan
            rest = []
        if not (abs(lat) <= 90.0 and abs(lon) <= 180.0 and all(map(math.isfinite, rest))):
            raise FileError(f"{where}: {text[:40]!r} is not longitude,latitude[,altitude]")
        found.append((lon, lat, rest[0] if rest else 0.0))
    return found


def _tag(element: Any) -> str:  # noqa: ANN401 - comments have a function for a tag
    """The name of an element without its namespace."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""
