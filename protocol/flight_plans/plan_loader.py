"""Opens flight plans with the procedures and KML files they name, and nothing outside the plan's folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from protocol.flight_plans.flight_plan import FlightPlan
from protocol.flight_plans.kml_sectors import with_kml_sectors
from protocol.flight_plans.place import FlightPlanError, Place, SourceText
from protocol.flight_plans.plan_reader import plan_from_elements
from protocol.flight_plans.procedures import with_procedures
from protocol.flight_plans.xml_elements import XmlElement, parse_xml
from protocol.limits import MAX_PLAN_FILE

__all__ = ["load_flight_plan", "read_flight_plan"]


def load_flight_plan(path: Path | str, procedures: Path | str | None = None) -> FlightPlan:
    """Read a plan, its procedures and its KML files, which lie in the plan's folder or below it.

    Args:
        path: Of the plan.
        procedures: Another folder that they may lie in.

    Raises:
        FlightPlanError: A file cannot be read or is not valid: file, line, column and reason.
    """
    path = Path(path)
    folders = [path.parent] if procedures is None else [path.parent, Path(procedures)]

    def fetch(procedure: SourceText) -> XmlElement:
        found = _inside(folders, "procedure", procedure)
        if found is None:
            raise FlightPlanError(
                procedure.place, f"procedure {procedure.text[:80]!r} cannot be found in {_listed(folders)}"
            )
        return parse_xml(_content(found, procedure.place), str(found), folds_case=True)

    def fetch_kml(file: SourceText) -> XmlElement | None:
        found = _inside(folders, "kml", file)
        return None if found is None else parse_xml(_content(found, file.place), str(found))

    root = parse_xml(_content(path, Place(str(path), 0, 0)), str(path), folds_case=True)
    return plan_from_elements(with_kml_sectors(with_procedures(root, fetch), fetch_kml))


def read_flight_plan(data: bytes, name: str) -> FlightPlan:
    """A plan from the content of a file called ``name``; it must include nothing.

    Raises:
        FlightPlanError: It is not valid.
    """

    def refuse(procedure: SourceText) -> XmlElement:
        raise FlightPlanError(procedure.place, f"procedure {procedure.text!r} is not available here")

    return plan_from_elements(with_procedures(parse_xml(data, name, folds_case=True), refuse))


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
        raise FlightPlanError(place, f"{path.name} cannot be read: {error.strerror}") from None
    except ValueError:
        raise FlightPlanError(place, "cannot be read: not the name of a file") from None
