"""Opens flight plans with the procedures and KML files they name, and nothing outside the plan's folder.

Waypoints and sectors keep their names, because expressions name them (``WP_TD``); where plan and procedure both have
one, that of the plan is meant, so that a plan can move what a procedure lands at.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from protocol.flight_plans.flight_plan import FlightPlan
from protocol.flight_plans.plan_reader import plan_from_elements, sections_of
from protocol.flight_plans.xml_elements import MAX_ELEMENTS, FlightPlanError, Place, SourceText, XmlElement, parse_xml
from protocol.ranges import MAX_PLAN_FILE

SHIPPED_PLANS = Path(__file__).parent / "data"
MAX_FILES = 32  # of a plan
OUTLINES = ("LinearRing", "LineString")
_NAMESPACE = re.compile(r"\{[^}]*\}")
FetchBytes = Callable[[SourceText], XmlElement | None]


def with_kml_sectors(root: XmlElement, fetch: FetchBytes) -> XmlElement:
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


MAX_INCLUDES = 32  # of a plan
_PARAMETER = re.compile(r"\$([A-Za-z_][A-Za-z0-9_]*)")
_QUOTED = re.compile(r"'([^']*)'")
_ADDED = ("waypoints", "sectors", "variables", "modules", "exceptions", "blocks")
_NAMES = {"waypoints": "name", "sectors": "name", "variables": "var"}  # section: attribute
Fetch = Callable[[SourceText], XmlElement]


def with_procedures(root: XmlElement, fetch: Fetch) -> XmlElement:
    """The plan with its procedures in place, without ``includes``.

    Args:
        root: Of the plan.
        fetch: Gives the root of a procedure's file.

    Raises:
        FlightPlanError: An include, or the procedure it names, is not valid.
    """
    includes = next((child for child in root.children if child.tag == "includes"), None)
    if root.tag != "flight_plan" or includes is None:
        return root
    if len(includes.children) > MAX_INCLUDES:
        raise FlightPlanError(includes.children[MAX_INCLUDES].place, f"more than {MAX_INCLUDES} includes")
    for include in includes.children:
        root = _merged(root, _procedure(include, fetch))
        if _size(root) > MAX_ELEMENTS:
            raise FlightPlanError(include.place, f"the plan with this file has more than {MAX_ELEMENTS} elements")
    return replace(root, children=tuple(child for child in root.children if child.tag != "includes"))


def _procedure(include: XmlElement, fetch: Fetch) -> XmlElement:
    """The procedure that an include names, with its arguments and under its names."""
    if include.tag != "include":
        raise FlightPlanError(include.place, f"<{include.tag}> where <include> was expected")
    name, file = _attributes(include, "name", "procedure")
    given, reroutes = {}, {}
    for child in include.children:
        if child.tag == "arg":
            key, value = _attributes(child, "name", "value")
            given[key.text] = value
        elif child.tag == "with":
            old, new = _attributes(child, "from", "to")
            reroutes[old.text] = new.text
        else:
            raise FlightPlanError(child.place, f"<include> holds no <{child.tag}>")
    procedure = fetch(file)
    if procedure.tag != "procedure":
        raise FlightPlanError(procedure.place, f"<{procedure.tag}> where <procedure> was expected")
    values = _parameters(procedure, given, include)
    sections = sections_of(procedure)
    for tag, section in sections.items():
        if tag not in {*_ADDED, "header"}:
            raise FlightPlanError(section.place, f"<procedure> holds no <{tag}>")
    return _Renaming(f"{name.text}.", reroutes, values, _block_names(sections.get("blocks"))).applied(procedure)


def _attributes(element: XmlElement, *names: str) -> tuple[SourceText, ...]:
    for name, source in element.attributes.items():
        if name not in names:
            raise FlightPlanError(source.place, f"<{element.tag}> has no attribute {name!r}: {', '.join(names)}")
    for name in names:
        if name not in element.attributes:
            raise FlightPlanError(element.place, f"<{element.tag}> needs the attribute {name!r}")
    return tuple(element.attributes[name] for name in names)


def _parameters(procedure: XmlElement, given: Mapping[str, SourceText], include: XmlElement) -> dict[str, str]:
    values: dict[str, str] = {}
    for child in procedure.children:
        if child.tag != "param":
            continue
        default = child.attributes.get("default_value")
        (name, *_) = _attributes(child, *(("name",) if default is None else ("name", "default_value")))
        value = given.get(name.text, default)
        if value is None:
            raise FlightPlanError(include.place, f"the procedure needs <arg name={name.text!r}>")
        values[name.text] = value.text
    for key, source in given.items():
        if key not in values:
            raise FlightPlanError(source.place, f"the procedure has no parameter {key!r}")
    return values


def _block_names(blocks: XmlElement | None) -> frozenset[str]:
    children = blocks.children if blocks is not None else ()
    return frozenset(child.attributes["name"].text for child in children if "name" in child.attributes)


class _Renaming:
    """Puts arguments and the names of blocks into a procedure."""

    def __init__(
        self, prefix: str, reroutes: Mapping[str, str], values: Mapping[str, str], own_blocks: frozenset[str]
    ) -> None:
        self._prefix, self._reroutes, self._values, self._own_blocks = prefix, reroutes, values, own_blocks

    def applied(self, element: XmlElement) -> XmlElement:
        """The element, and all in it, as it stands in the plan."""
        attributes = {name: self._attribute(element.tag, name, value) for name, value in element.attributes.items()}
        return replace(element, attributes=attributes, children=tuple(map(self.applied, element.children)))

    def _attribute(self, tag: str, name: str, source: SourceText) -> SourceText:
        text = self._with_values(source.text)
        if (tag, name) == ("block", "name"):
            text = self._prefix + text
        elif (tag, name) in {("exception", "deroute"), ("deroute", "block")}:
            text = self._block(text)
        else:
            text = _QUOTED.sub(lambda match: f"'{self._block(match.group(1))}'", text)
        return source if text == source.text else SourceText(text, source.place, text)

    def _block(self, name: str) -> str:
        """A block that the procedure jumps to: rerouted, its own, or one of the plan."""
        return self._reroutes.get(name, self._prefix + name if name in self._own_blocks else name)

    def _with_values(self, text: str) -> str:
        whole = _PARAMETER.fullmatch(text.strip())
        if whole and whole.group(1) in self._values:
            return self._values[whole.group(1)]
        return _PARAMETER.sub(self._value, text)

    def _value(self, match: re.Match[str]) -> str:
        value = self._values.get(match.group(1))
        if value is None:
            return match.group()  # the counter of a loop
        return value if re.fullmatch(r"[\w.]+", value) else f"({value})"


def _merged(root: XmlElement, procedure: XmlElement) -> XmlElement:
    """The plan with the sections of a procedure behind its own."""
    sections = sections_of(root)
    for tag, added in sections_of(procedure).items():
        if tag == "header":
            before = sections.get(tag, replace(added, text=""))
            sections[tag] = replace(before, text=f"{before.text}\n{added.text}")
        if tag not in _ADDED:
            continue
        old = sections.get(tag, replace(added, children=(), comments=(), last_comments=()))
        key = _NAMES.get(tag)
        taken = {_name(child, key) for child in old.children} - {""} if key is not None else set()
        new = tuple(child for child in added.children if key is None or _name(child, key) not in taken)
        sections[tag] = replace(old, children=(*old.children, *new))
    return replace(root, children=tuple(sections.values()))


def _name(element: XmlElement, key: str) -> str:
    return element.attributes[key].text if key in element.attributes else ""


def _size(element: XmlElement) -> int:
    return 1 + sum(map(_size, element.children))


def shipped_plan_names() -> list[str]:
    """Names of the plans that are shipped."""
    return sorted(path.stem for path in SHIPPED_PLANS.glob("*.xml"))


def _or_shipped(path: Path) -> Path:
    """The file, or the shipped plan of that name where there is no such file."""
    return SHIPPED_PLANS / f"{path.name}.xml" if path.name in shipped_plan_names() and not path.exists() else path


def load_flight_plan(path: Path | str, procedures: Path | str | None = None) -> FlightPlan:
    """Read a plan, its procedures and its KML files, which lie in the plan's folder or below it.

    Args:
        path: Of the plan, or the name of a shipped one.
        procedures: Another folder that they may lie in.

    Raises:
        FlightPlanError: A file cannot be read or is not valid: file, line, column and reason.
    """
    path = _or_shipped(Path(path))
    folders = [path.parent] if procedures is None else [path.parent, Path(procedures)]

    def fetch(procedure: SourceText) -> XmlElement:
        found = _inside(folders, "procedure", procedure)
        if found is None:
            raise FlightPlanError(
                procedure.place, f"procedure {procedure.text[:80]!r} cannot be found in {_listed(folders)}"
            )
        return parse_xml(_content(found, procedure.place), str(found), lenient=True)

    def fetch_kml(file: SourceText) -> XmlElement | None:
        found = _inside(folders, "kml", file)
        return None if found is None else parse_xml(_content(found, file.place), str(found))

    root = parse_xml(_content(path, Place(str(path), 0, 0)), str(path), lenient=True)
    return plan_from_elements(with_kml_sectors(with_procedures(root, fetch), fetch_kml))


def read_flight_plan(data: bytes, name: str) -> FlightPlan:
    """A plan from the content of a file called ``name``; it must include nothing.

    Raises:
        FlightPlanError: It is not valid.
    """

    def refuse(procedure: SourceText) -> XmlElement:
        raise FlightPlanError(procedure.place, f"procedure {procedure.text!r} is not available here")

    return plan_from_elements(with_procedures(parse_xml(data, name, lenient=True), refuse))


def _inside(folders: Sequence[Path], what: str, file: SourceText) -> Path | None:
    """A file that a plan names, after all links, inside one of the folders; None: it is not there.

    Raises:
        FlightPlanError: It is there, but outside of them.
    """
    is_there = False
    for folder in folders:
        try:
            root = folder.resolve(strict=True)
            found = (folder / file.text).resolve(strict=True)
        except (OSError, ValueError, RuntimeError):
            continue
        is_there = True
        if found.is_relative_to(root):
            return found
    if is_there:
        raise FlightPlanError(file.place, f"{what} {file.text[:80]!r} is outside {_listed(folders)}")
    return None


def _listed(folders: Sequence[Path]) -> str:
    return " or ".join(map(str, folders))


def _content(path: Path, place: Place) -> bytes:
    try:
        if path.exists() and not path.is_file():
            raise FlightPlanError(place, f"{path.name} is not a file")
        with path.open("rb") as file:
            return file.read(MAX_PLAN_FILE + 1)
    except OSError as error:
        shipped = "" if path.suffix == ".kml" else f" (shipped plans: {', '.join(shipped_plan_names())})"
        raise FlightPlanError(place, f"{path.name} cannot be read: {error.strerror}{shipped}") from None
    except ValueError:
        raise FlightPlanError(place, "cannot be read: not the name of a file") from None
