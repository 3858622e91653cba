"""A plan in one file with what the names of its build mean, as it is sent to a vehicle and stored there.

The file is the plan's XML; the names, a TOML text, stand behind it in a processing instruction, which other readers
pass over.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from protocol.flight_plans.flight_plan import FlightPlan
from protocol.flight_plans.name_mapping import NameMapping, parse_name_mapping
from protocol.flight_plans.place import FlightPlanError, Place
from protocol.flight_plans.plan_loader import read_flight_plan
from protocol.flight_plans.plan_writer import render_flight_plan

__all__ = ["PackedPlan", "pack_plan", "unpack_plan"]

_BEGIN, _END = b"<?darko-names\n", b"?>"


class PackedPlan(NamedTuple):
    """Content of a packed plan file."""

    plan: FlightPlan
    mapping: NameMapping


def pack_plan(plan: FlightPlan, mapping: NameMapping | None = None) -> bytes:
    """One file of a plan, its procedures and what its names mean."""
    text = render_flight_plan(plan).encode()
    mapping = mapping or NameMapping()
    if not (mapping.functions or mapping.variables):
        return text
    names = _table("functions", mapping.functions) + _table("variables", mapping.variables)
    return text + _BEGIN + names.encode() + _END + b"\n"


def unpack_plan(data: bytes, name: str) -> PackedPlan:
    """The plan of a file called ``name``, which includes nothing, and what its names mean.

    Raises:
        FlightPlanError: It is not valid.
    """
    plan = read_flight_plan(data, name)
    _, begin, behind = data.rpartition(_BEGIN)
    content, end, rest = behind.partition(_END)
    if not (begin and end) or rest.strip():
        return PackedPlan(plan, NameMapping())
    names = f"names of {name}"
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        raise FlightPlanError(Place(names, 0, 0), "not a text in UTF-8") from None
    return PackedPlan(plan, parse_name_mapping(text, names))


def _table(title: str, meanings: Mapping[str, float | int | str]) -> str:
    lines = "".join(
        f'"{name}" = ' + (f'"{value}"' if isinstance(value, str) else repr(value)) + "\n"
        for name, value in meanings.items()
    )
    return f"[{title}]\n{lines}"
