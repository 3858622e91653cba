"""Macros of a plan's header: ``#define NAME text`` and ``#define NAME(a, b) text`` are put in where a plan uses them.

Only macros that are expressions count; conditions of the preprocessor are not looked at, and the first of two
definitions counts. A name that the autopilot knows stays the autopilot's.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from protocol.flight_plans.expressions.expression_syntax import parse_expression
from protocol.flight_plans.expressions.expression_tree import (
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
    walk,
)
from protocol.flight_plans.flight_plan import FlightPlan
from protocol.flight_plans.known_names import CONSTANTS, FUNCTIONS, VARIABLES
from protocol.flight_plans.place import FlightPlanError, Place, SourceText
from protocol.flight_plans.stages import PlanElement

__all__ = ["Macro", "header_macros", "with_macros"]

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
