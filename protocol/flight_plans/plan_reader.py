"""Makes a flight plan of its elements, with the macros of its header, and checks that what it names exists.

Only macros that are expressions count; conditions of the preprocessor are not looked at, and the first of two
definitions counts. A name that the autopilot knows stays the autopilot's.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from protocol.flight_plans.attributes import NameUse, known_attributes, read_attributes, unknown_attributes
from protocol.flight_plans.expressions import (
    ArrayItem,
    Call,
    Expression,
    Instruction,
    Member,
    Negation,
    Operation,
    Script,
    StoredIn,
    Tree,
    VariableName,
    parse_expression,
    walk,
)
from protocol.flight_plans.flight_plan import (
    STAGE_CLASSES,
    AbiBinding,
    FlightPlan,
    ForStage,
    KmlSector,
    ModuleOption,
    PlanBlock,
    PlanElement,
    PlanException,
    PlanHeader,
    PlanModule,
    PlanSector,
    PlanVariable,
    PlanWaypoint,
    Stage,
    WhileStage,
)
from protocol.flight_plans.plan_limits import check_plan
from protocol.flight_plans.plan_names import CONSTANTS, FUNCTIONS, VARIABLES
from protocol.flight_plans.xml_elements import FlightPlanError, Place, SourceText, XmlElement

MAX_EXPANSIONS = 8  # of macros in macros
MAX_PARTS = 2000  # of an expression with its macros put in
_DEFINE = re.compile(
    r"^[ \t]*#[ \t]*define[ \t]+([A-Za-z_]\w*)(\([\w \t,]*\))?[ \t]+(\S[^\n]*)$", re.MULTILINE | re.ASCII
)
_COMMENT = re.compile(r"//[^\n]*|/\*[^*]*\*+(?:[^/*][^*]*\*+)*/")
_KNOWN = {*FUNCTIONS, *VARIABLES, *CONSTANTS}
Element = TypeVar("Element", bound=PlanElement)


@dataclass(frozen=True, slots=True)
class Macro:
    """Macro of the header: its expression and its parameters."""

    tree: Tree
    parameters: tuple[str, ...] | None = None  # None: it is used without parentheses


def header_macros(text: str, place: Place) -> Mapping[str, Macro]:
    """The macros of a header that are expressions.

    Args:
        text: Of the header, C.
        place: Of the header.
    """
    macros: dict[str, Macro] = {}
    for match in _DEFINE.finditer(_COMMENT.sub(" ", text.replace("\\\n", " "))):
        name, listed, body = match.groups()
        if name in _KNOWN or name in macros:
            continue
        try:
            tree = parse_expression(SourceText(body.strip(), place, body.strip())).tree
        except FlightPlanError:
            continue  # statements, types: nothing that a plan could use in an expression
        parameters = None if listed is None else tuple(re.findall(r"\w+", listed))
        macros[name] = Macro(tree, parameters)
    return macros


def with_macros(plan: FlightPlan) -> FlightPlan:
    """The plan with the macros of its header put in; its texts stay as they were written.

    Raises:
        FlightPlanError: An expression grows beyond all measure.
    """
    macros = header_macros(plan.header.text, plan.header.place) if plan.header is not None else {}
    return _Expansion(macros).element(plan) if macros else plan


class _Expansion:
    """Puts macros into the expressions of a plan."""

    def __init__(self, macros: Mapping[str, Macro]) -> None:
        self._macros = macros

    def element(self, element: Element) -> Element:
        """A part of the plan, and all in it."""
        changes: dict[str, Any] = {}
        for field in dataclasses.fields(element):
            value = getattr(element, field.name)
            changed = tuple(map(self._part, value)) if isinstance(value, tuple) else self._part(value)
            if changed != value:
                changes[field.name] = changed
        return replace(element, **changes) if changes else element

    def _part(self, part: Any) -> Any:  # noqa: ANN401 - a field of any type
        match part:
            case Expression():
                return replace(part, tree=self._expanded(part.tree))
            case StoredIn():
                tree = self._expanded(part.tree)
                return replace(part, tree=tree) if isinstance(tree, VariableName | ArrayItem | Call) else part
            case Script():
                return replace(part, instructions=tuple(map(self._instruction, part.instructions)))
            case PlanElement():
                return self.element(part)
            case _:
                return part

    def _instruction(self, instruction: Instruction) -> Instruction:
        condition = None if instruction.condition is None else self._expanded(instruction.condition)
        return replace(instruction, expression=self._expanded(instruction.expression), condition=condition)

    def _expanded(self, tree: Tree) -> Tree:
        for _ in range(MAX_EXPANSIONS):
            if not any(self._is_macro(part) for part in walk(tree)):
                return tree
            tree = self._put_in(tree, {})
            if sum(1 for _ in walk(tree)) > MAX_PARTS:
                raise FlightPlanError(tree.place, f"with the header's macros more than {MAX_PARTS} parts")
        return tree

    def _is_macro(self, part: Tree) -> bool:
        return isinstance(part, VariableName | Call) and part.name in self._macros

    def _put_in(self, tree: Tree, values: Mapping[str, Tree]) -> Tree:
        """A tree with its macros, or with the values of a macro's parameters, put in once."""
        match tree:
            case VariableName():
                if values:
                    return values.get(tree.name, tree)
                macro = self._macros.get(tree.name)
                return tree if macro is None or macro.parameters is not None else _at(macro.tree, tree.place)
            case Negation():
                return replace(tree, operand=self._put_in(tree.operand, values))
            case Operation():
                return replace(tree, left=self._put_in(tree.left, values), right=self._put_in(tree.right, values))
            case ArrayItem():
                return replace(tree, index=self._put_in(tree.index, values))
            case Member():
                call = self._put_in(tree.call, values)
                return replace(tree, call=call) if isinstance(call, Call) else tree
            case Call():
                return self._call(tree, values)
            case _:
                return tree

    def _call(self, call: Call, values: Mapping[str, Tree]) -> Tree:
        arguments = tuple(self._put_in(argument, values) for argument in call.arguments)
        macro = None if values else self._macros.get(call.name)
        if macro is None:
            return replace(call, arguments=arguments)
        if macro.parameters is None:  # another name for a function
            is_name = isinstance(macro.tree, VariableName)
            return replace(call, name=macro.tree.name, arguments=arguments) if is_name else call  # type: ignore[union-attr]
        if len(macro.parameters) != len(arguments):
            return replace(call, arguments=arguments)
        given = dict(zip(macro.parameters, arguments, strict=True))
        return self._put_in(_at(macro.tree, call.place), given) if given else _at(macro.tree, call.place)


def _at(tree: Tree, place: Place) -> Tree:
    """A macro's tree where it is used."""
    return replace(tree, place=place)


SECTIONS = ("header", "waypoints", "sectors", "variables", "modules", "includes", "exceptions", "blocks")
_NEEDED = ("waypoints", "blocks")
_UTM = ("utm_x0", "utm_y0")


def plan_from_elements(root: XmlElement) -> FlightPlan:
    """The plan of a root element without includes.

    Raises:
        FlightPlanError: It is not a flight plan.
    """
    if root.tag != "flight_plan":
        hint = ": a procedure is flown by a plan that includes it" if root.tag == "procedure" else ""
        raise FlightPlanError(root.place, f"<{root.tag}> where <flight_plan> was expected{hint}")
    sections = sections_of(root)
    for tag in _NEEDED:
        if tag not in sections:
            raise FlightPlanError(root.place, f"<flight_plan> has no <{tag}>")
    values = read_attributes(FlightPlan, root)
    for tag, field, read in (
        ("waypoints", "waypoints", _waypoint),
        ("sectors", "sectors", _sector),
        ("variables", "variables", _variable),
        ("modules", "modules", _module),
        ("exceptions", "exceptions", _exception),
        ("blocks", "blocks", _block),
    ):
        values[field] = _all(sections.get(tag), read)
    if "header" in sections:
        values["header"] = PlanHeader(**_shared(sections["header"]), text=sections["header"].text)
    values.update(_utm(sections["waypoints"]))
    remarks = [(s.tag, s.comments, s.last_comments) for s in sections.values() if s.tag != "header"]
    kept = tuple(remark for remark in remarks if remark[1] or remark[2])
    repeated = tuple(_repetitions(root))
    plan = with_macros(FlightPlan(**_shared(root), **values, section_comments=kept, repeated_attributes=repeated))
    check_plan(plan)
    return plan


def _repetitions(element: XmlElement) -> Iterator[NameUse]:
    """The attributes of an element, and of all in it, that their tags gave before."""
    for attribute in element.repeated:
        yield NameUse(f"{element.tag} {attribute.name}", attribute.place)
    for child in element.children:
        yield from _repetitions(child)


def sections_of(root: XmlElement) -> dict[str, XmlElement]:
    """The sections of a plan or procedure by tag.

    Raises:
        FlightPlanError: One is unknown, or there twice.
    """
    known = SECTIONS if root.tag == "flight_plan" else (*SECTIONS, "param")
    sections: dict[str, XmlElement] = {}
    _no_text(root)
    for child in root.children:
        if child.tag not in known:
            raise FlightPlanError(child.place, f"<{root.tag}> holds no <{child.tag}>")
        if child.tag == "param":
            continue
        if child.tag in sections:
            raise FlightPlanError(child.place, f"a second <{child.tag}>")
        if child.tag == "header":
            _no_children(child)
        elif child.tag != "waypoints":
            _no_attributes(child)
        sections[child.tag] = child
    return sections


def _shared(element: XmlElement) -> dict[str, Any]:
    """The fields that every part of a plan has."""
    return {"place": element.place, "comments": element.comments, "last_comments": element.last_comments}


def _all(section: XmlElement | None, read: Callable[[XmlElement], Element]) -> tuple[Element, ...]:
    if section is None:
        return ()
    _no_text(section)
    return tuple(map(read, section.children))


def _leaf(record: type[Element], element: XmlElement, tag: str) -> Element:
    """An element without children."""
    _expect(element, tag)
    _no_children(element)
    _no_text(element)
    return record(**_shared(element), **read_attributes(record, element))


def _expect(element: XmlElement, *tags: str) -> None:
    if element.tag not in tags:
        raise FlightPlanError(element.place, f"<{element.tag}> where <{'> or <'.join(tags)}> was expected")


def _no_children(element: XmlElement) -> None:
    if element.children:
        child = element.children[0]
        raise FlightPlanError(child.place, f"<{element.tag}> holds no <{child.tag}>")


def _no_attributes(element: XmlElement) -> None:
    for name, source in element.attributes.items():
        raise FlightPlanError(source.place, f"<{element.tag}> has no attribute {name!r}")


def _no_text(element: XmlElement) -> None:
    if text := element.text.strip():
        raise FlightPlanError(element.place, f"<{element.tag}> holds the text {text[:30]!r}")


def _utm(waypoints: XmlElement) -> dict[str, float]:
    values: dict[str, float] = {}
    for name, source in waypoints.attributes.items():
        if name not in _UTM:
            raise FlightPlanError(source.place, f"<waypoints> has no attribute {name!r}")
        try:
            values[name] = float(source.text)
        except ValueError:
            raise FlightPlanError(source.place, f"{name} {source.text[:40]!r} is not a number") from None
    return values


def _waypoint(element: XmlElement) -> PlanWaypoint:
    """A waypoint of the plan."""
    return _leaf(PlanWaypoint, element, "waypoint")


def _exception(element: XmlElement) -> PlanException:
    """An exception of the plan or of a block."""
    return _leaf(PlanException, element, "exception")


def _sector(element: XmlElement) -> PlanSector | KmlSector:
    if element.tag == "kml":
        return _leaf(KmlSector, element, "kml")
    _expect(element, "sector", "kml")
    _no_text(element)
    corners = []
    for corner in element.children:
        _expect(corner, "corner")
        _no_children(corner)
        corners.append(_corner(corner))
    return PlanSector(**_shared(element), **read_attributes(PlanSector, element), corners=tuple(corners))


def _corner(element: XmlElement) -> NameUse:
    for name, source in element.attributes.items():
        if name != "name":
            raise FlightPlanError(source.place, f"<corner> has no attribute {name!r}")
    if "name" not in element.attributes:
        raise FlightPlanError(element.place, "<corner> needs the attribute 'name'")
    return NameUse(element.attributes["name"].text, element.attributes["name"].place)


def _variable(element: XmlElement) -> PlanVariable | AbiBinding:
    if element.tag == "abi_binding":
        return _leaf(AbiBinding, element, "abi_binding")
    return _leaf(PlanVariable, element, "variable")


def _module(element: XmlElement) -> PlanModule:
    _expect(element, "module")
    _no_text(element)
    options = tuple(map(_module_option, element.children))
    return PlanModule(**_shared(element), **read_attributes(PlanModule, element), options=options)


def _module_option(element: XmlElement) -> ModuleOption:
    _expect(element, "define", "configure")
    _no_children(element)
    return ModuleOption(**_shared(element), option=element.tag, **read_attributes(ModuleOption, element))


def _block(element: XmlElement) -> PlanBlock:
    _expect(element, "block")
    return PlanBlock(**_shared(element), **_tolerant(PlanBlock, element), **_body(element))


def _tolerant(record: type[PlanElement], element: XmlElement) -> dict[str, Any]:
    """Its attributes, and what a block or stage has besides."""
    return {**known_attributes(record, element), "unknown": unknown_attributes(record, element)}


def _body(element: XmlElement) -> Mapping[str, Any]:
    """Stages and exceptions of a block or a loop."""
    _no_text(element)
    exceptions = tuple(_exception(child) for child in element.children if child.tag == "exception")
    stages = tuple(_stage(child) for child in element.children if child.tag != "exception")
    return {"exceptions": exceptions, "stages": stages}


def _stage(element: XmlElement) -> Stage:
    stage = STAGE_CLASSES.get(element.tag)
    if stage is None:
        raise FlightPlanError(element.place, f"<{element.tag}> is not a stage: {', '.join(STAGE_CLASSES)}")
    values = _tolerant(stage, element)
    if stage in {WhileStage, ForStage}:
        return stage(**_shared(element), **values, **_body(element))
    _no_children(element)
    _no_text(element)
    return stage(**_shared(element), **values)
