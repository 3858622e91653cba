"""The values that a condition saw: what an operator is told with an exception that fired."""

from __future__ import annotations

from protocol.flight_plans.expressions.evaluation import NameTable, UnknownNameError, evaluate
from protocol.flight_plans.expressions.expression_text import expression_text
from protocol.flight_plans.expressions.expression_tree import Call, LoopVariable, Member, Tree, VariableName, walk
from protocol.flight_plans.place import FlightPlanError

__all__ = ["condition_values"]

READERS = ("Get", "stateGet")  # functions whose names begin so change nothing: they may be asked twice


def condition_values(tree: Tree, names: NameTable) -> str:
    """Values that the condition read, such as ``GetPosHeight() 1.52, laps 2``; empty if it read none that can be told.

    Args:
        tree: The condition.
        names: What its names mean now.
    """
    told: dict[str, str] = {}
    for part in walk(tree):
        if not _is_read(part):
            continue
        try:
            told[expression_text(part)] = f"{evaluate(part, names):.4g}"
        except (FlightPlanError, UnknownNameError):
            continue
    return ", ".join(f"{text} {value}" for text, value in told.items())


def _is_read(part: Tree) -> bool:
    match part:
        case VariableName():
            return not part.name.isupper()  # those are constants
        case LoopVariable():
            return True
        case Call():
            return part.name.startswith(READERS)
        case Member():
            return part.call.name.startswith(READERS)
        case _:
            return False
