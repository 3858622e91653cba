"""The expressions of flight plans as trees: C-like, with names of the autopilot, waypoints, sectors and variables.

Trees are equal if they mean the same, wherever they stand.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from protocol.flight_plans.place import NOWHERE, Place

__all__ = [
    "MAX_WHOLE_NUMBER",
    "ArrayItem",
    "BlockTitle",
    "Call",
    "Expression",
    "Instruction",
    "LoopVariable",
    "Member",
    "Negation",
    "Number",
    "Operation",
    "Reference",
    "Script",
    "StoredIn",
    "Target",
    "Tree",
    "VariableName",
    "walk",
]

MAX_WHOLE_NUMBER = 2**63 - 1


@dataclass(frozen=True, slots=True)
class Number:
    """A number; without a point or an exponent it is whole, as in C."""

    value: int | float
    place: Place = NOWHERE

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Number) and type(self.value) is type(other.value) and self.value == other.value

    def __hash__(self) -> int:
        return hash((type(self.value), self.value))


@dataclass(frozen=True, slots=True)
class BlockTitle:
    """A quoted text: the name of a block."""

    text: str
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class VariableName:
    """A variable or constant by its name; ``nav.radius`` is one name."""

    name: str
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Reference:
    """``&name``: a variable that a function changes."""

    name: str
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class LoopVariable:
    """``$name``: the counter of a loop around."""

    name: str
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Negation:
    """``-x`` or ``!x``."""

    operator: str
    operand: Tree
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Operation:
    """Two operands and an operator: one of ``expression_syntax.PRECEDENCE``."""

    operator: str
    left: Tree
    right: Tree
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class ArrayItem:
    """``name[index]`` or a field of it, ``name[index].field``: here only waypoints are an array."""

    name: str
    index: Tree
    member: str = ""  # the field, with points between the parts of its name
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Call:
    """A function called with arguments."""

    name: str
    arguments: tuple[Tree, ...]
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Member:
    """A field of what a call gives: ``stateGetPositionEnu_f()->z``."""

    call: Call
    name: str
    place: Place = field(default=NOWHERE, compare=False)


Tree: TypeAlias = (
    Number | BlockTitle | VariableName | Reference | LoopVariable | Negation | Operation | ArrayItem | Call | Member
)


Target: TypeAlias = VariableName | ArrayItem | Call  # C's lvalues; of calls those that are macros for one


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression of a plan; ``text`` is how it was written."""

    tree: Tree
    text: str = field(default="", compare=False)
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class StoredIn:
    """Target in which a stage stores a value; ``text`` is the source text."""

    tree: Target
    text: str = field(default="", compare=False)
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Instruction:
    """One statement: ``expression;``, ``name = expression;`` or either after ``if (condition)``."""

    expression: Tree
    target: Target | None = None  # what the value is stored in
    condition: Tree | None = None
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Script:
    """Call of one function, or of several statements one after the other."""

    instructions: tuple[Instruction, ...]
    text: str = field(default="", compare=False)
    place: Place = field(default=NOWHERE, compare=False)


def walk(tree: Tree) -> Iterator[Tree]:
    """All parts of a tree, itself first."""
    waiting = [tree]
    while waiting:
        part = waiting.pop()
        yield part
        match part:
            case Negation():
                waiting.append(part.operand)
            case Operation():
                waiting += [part.right, part.left]
            case ArrayItem():
                waiting.append(part.index)
            case Call():
                waiting += reversed(part.arguments)
            case Member():
                waiting.append(part.call)
            case _:
                pass
