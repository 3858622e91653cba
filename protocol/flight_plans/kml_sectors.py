"""Sectors of KML files: every polygon of one becomes a sector, with waypoints that no operator drags as its corners."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace

from protocol.flight_plans.place import FlightPlanError, Place, SourceText
from protocol.flight_plans.xml_elements import MAX_ELEMENTS, XmlElement

__all__ = ["with_kml_sectors"]

MAX_FILES = 32  # of a plan
OUTLINES = ("LinearRing", "LineString")
_NAMESPACE = re.compile(r"\{[^}]*\}")
Fetch = Callable[[SourceText], XmlElement | None]


def with_kml_sectors(root: XmlElement, fetch: Fetch) -> XmlElement:
    """The plan with the polygons of its KML files in place of its ``kml``; a file that is not there stays named.

    Args:
        root: Of the plan.
        fetch: Gives the root of a KML file; None: it is not there.

    Raises:
        FlightPlanError: A file is not valid.
    """
    section = next((child for child in root.children if child.tag == "sectors"), None)
    if section is None:
        return root
    if sum(child.tag == "kml" for child in section.children) > MAX_FILES:
        raise FlightPlanError(section.place, f"more than {MAX_FILES} KML files")
    sectors: list[XmlElement] = []
    corners: list[XmlElement] = []
    for child in section.children:
        file = child.attributes.get("file") if child.tag == "kml" else None
        kml = None if file is None else fetch(file)
        if kml is None:
            sectors.append(child)
            continue
        found = list(_sectors(kml))
        if not found:
            raise FlightPlanError(kml.place, "the KML file holds no polygon")
        sectors += [replace(found[0][0], comments=child.comments), *(sector for sector, _ in found[1:])]
        corners += [corner for _, points in found for corner in points]
        if len(sectors) + 2 * len(corners) > MAX_ELEMENTS:
            raise FlightPlanError(child.place, f"the plan with this file has more than {MAX_ELEMENTS} elements")
    return replace(root, children=tuple(_changed(child, sectors, corners) for child in root.children))


def _changed(child: XmlElement, sectors: list[XmlElement], corners: list[XmlElement]) -> XmlElement:
    if child.tag == "sectors":
        return replace(child, children=tuple(sectors))
    return replace(child, children=(*child.children, *corners)) if child.tag == "waypoints" else child


def _sectors(kml: XmlElement) -> Iterator[tuple[XmlElement, list[XmlElement]]]:
    """The sectors of a file, each with its waypoints."""
    for placemark in _all(kml, "Placemark"):
        outline = next((part for tag in OUTLINES for part in _all(placemark, tag)), None)
        name = next((child.text for child in placemark.children if _tag(child) == "name"), "").strip()
        if outline is None:
            continue  # a point, or a picture
        if not name:
            raise FlightPlanError(placemark.place, "a polygon has no <name>")
        name = re.sub(r"\W", "_", name, flags=re.ASCII)
        corners = [
            _element("waypoint", outline.place, name=f"_{name}_{number}", lat=repr(lat), lon=repr(lon))
            for number, (lat, lon) in enumerate(_coordinates(outline), 1)
        ]
        uses = tuple(_element("corner", outline.place, name=corner.attributes["name"].text) for corner in corners)
        yield replace(_element("sector", placemark.place, name=name), children=uses), corners


def _coordinates(outline: XmlElement) -> list[tuple[float, float]]:
    """Latitudes and longitudes of an outline [deg], the first not again at its end."""
    texts = next((child for child in outline.children if _tag(child) == "coordinates"), None)
    points = []
    for text in texts.text.split() if texts is not None else ():
        try:
            lon, lat = (float(part) for part in text.split(",")[:2])
        except ValueError:
            raise FlightPlanError(outline.place, f"{text[:40]!r} is not a longitude and a latitude") from None
        if not (abs(lat) <= 90.0 and abs(lon) <= 180.0):
            raise FlightPlanError(outline.place, f"{text[:40]!r} is not on the globe")
        points.append((lat, lon))
    return points[:-1] if len(points) > 1 and points[0] == points[-1] else points


def _all(element: XmlElement, tag: str) -> Iterator[XmlElement]:
    if _tag(element) == tag:
        yield element
    for child in element.children:
        yield from _all(child, tag)


def _tag(element: XmlElement) -> str:
    return _NAMESPACE.sub("", element.tag)


def _element(tag: str, place: Place, **texts: str) -> XmlElement:
    attributes = {name: SourceText(text, place, text) for name, text in texts.items()}
    return XmlElement(tag, attributes, (), "", (), (), place)
