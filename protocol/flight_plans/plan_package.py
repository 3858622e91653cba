"""Writes a flight plan as one file: as it is saved, and as it is sent to a vehicle with what its names mean.

The file is the plan's XML; the names, a TOML text, stand behind it in a processing instruction, which other readers
pass over.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple
from xml.sax.saxutils import escape

from protocol.flight_plans.attributes import attribute_texts
from protocol.flight_plans.flight_plan import (
    FlightPlan,
    ForStage,
    PlanBlock,
    PlanElement,
    PlanModule,
    PlanSector,
    WhileStage,
)
from protocol.flight_plans.plan_loader import read_flight_plan
from protocol.flight_plans.plan_names import NameMapping, parse_name_mapping
from protocol.flight_plans.xml_elements import FlightPlanError, Place

_DOCTYPE = '<!DOCTYPE flight_plan SYSTEM "flight_plan.dtd">'
_STEP = "  "


def render_flight_plan(plan: FlightPlan) -> str:
    """The text of a plan."""
    return "\n".join((*_comments(plan.comments, 0), _DOCTYPE, "", *_plan(plan), ""))


def _plan(plan: FlightPlan) -> Iterator[str]:
    yield _tag("flight_plan", attribute_texts(plan), 0)
    if plan.header is not None:
        yield from _comments(plan.header.comments, 1)
        yield f"{_STEP}<header>{escape(plan.header.text)}</header>"
    utm = {key: repr(value) for key in ("utm_x0", "utm_y0") if (value := getattr(plan, key)) is not None}
    yield from _section(plan, "waypoints", plan.waypoints, utm)
    for tag in ("sectors", "variables", "modules", "exceptions"):
        if getattr(plan, tag) or any(remark[0] == tag for remark in plan.section_comments):
            yield from _section(plan, tag, getattr(plan, tag))
    yield from _section(plan, "blocks", plan.blocks)
    yield from _comments(plan.last_comments, 1)
    yield "</flight_plan>"


def _section(
    plan: FlightPlan, tag: str, parts: Sequence[PlanElement], texts: dict[str, str] | None = None
) -> Iterator[str]:
    remarks = next((remark for remark in plan.section_comments if remark[0] == tag), (tag, (), ()))
    yield from _comments(remarks[1], 1)
    yield _tag(tag, texts or {}, 1)
    for part in parts:
        yield from _element(part, 2)
    yield from _comments(remarks[2], 2)
    yield f"{_STEP}</{tag}>"


def _element(part: PlanElement, depth: int) -> Iterator[str]:
    yield from _comments(part.comments, depth)
    tag = getattr(part, "option", "") or getattr(part, "tag", "")
    inner = list(_inner(part, depth + 1))
    texts = attribute_texts(part)
    if not inner:
        yield _tag(tag, texts, depth, closed=True)
        return
    yield _tag(tag, texts, depth)
    yield from inner
    yield f"{_STEP * depth}</{tag}>"


def _inner(part: PlanElement, depth: int) -> Iterator[str]:
    children: Iterable[PlanElement] = ()
    match part:
        case PlanSector():
            yield from (_tag("corner", {"name": corner.name}, depth, closed=True) for corner in part.corners)
        case PlanModule():
            children = part.options
        case PlanBlock() | WhileStage() | ForStage():
            children = (*part.exceptions, *part.stages)
        case _:
            pass
    for child in children:
        yield from _element(child, depth)
    yield from _comments(part.last_comments, depth)


def _tag(tag: str, attributes: dict[str, str], depth: int, *, closed: bool = False) -> str:
    texts = "".join(f' {name}="{_value(text)}"' for name, text in attributes.items())
    return f"{_STEP * depth}<{tag}{texts}{'/' if closed else ''}>"


def _value(text: str) -> str:
    """An attribute's value; a bare > is allowed in one."""
    references = {'"': "&quot;", "\n": "&#10;", "\t": "&#9;", "\r": "&#13;"}
    return escape(text, references).replace("&gt;", ">")


def _comments(comments: Sequence[str], depth: int) -> Iterator[str]:
    return (f"{_STEP * depth}<!--{comment}-->" for comment in comments)


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
