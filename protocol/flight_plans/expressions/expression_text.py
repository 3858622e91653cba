"""Writes expressions, without < and & that XML would have to escape."""

from __future__ import annotations

from typing import Final

from protocol.flight_plans.expressions.expression_syntax import PRECEDENCE, WORDS
from protocol.flight_plans.expressions.expression_tree import (
    ArrayItem,
    BlockTitle,
    Call,
    Instruction,
    LoopVariable,
    Member,
    Negation,
    Number,
    Operation,
    Reference,
    Script,
    Tree,
    VariableName,
)

__all__ = ["expression_text", "script_text"]

_UNARY, _ATOM = 9, 11  # precedence of -x and !x, and of what needs no parentheses
_WORD_OF_SIGN: Final = {sign: word for word, sign in WORDS.items() if sign != "=="}


def expression_text(tree: Tree) -> str:
    """A tree as text that is read to the same tree."""
    return _text(tree)[0]


def script_text(script: Script) -> str:
    """Statements as text that is read to the same statements."""
    return "; ".join(map(_instruction, script.instructions))


def _instruction(instruction: Instruction) -> str:
    text = expression_text(instruction.expression)
    if instruction.target is not None:
        text = f"{expression_text(instruction.target)} = {text}"
    return text if instruction.condition is None else f"if ({expression_text(instruction.condition)}) {text}"


def _text(tree: Tree) -> tuple[str, int]:
    """The text of a tree, and the precedence of what stands outermost in it."""
    match tree:
        case Number() | BlockTitle() | VariableName() | LoopVariable():
            return _atom(tree), _ATOM
        case Reference():
            return f"&{tree.name}", _UNARY
        case ArrayItem():
            member = f".{tree.member}" if tree.member else ""
            return f"{tree.name}[{expression_text(tree.index)}]{member}", _ATOM
        case Call():
            return f"{tree.name}({', '.join(map(expression_text, tree.arguments))})", _ATOM
        case Member():
            return f"{expression_text(tree.call)}->{tree.name}", _ATOM
        case Negation():
            return tree.operator + _within(tree.operand, _UNARY), _UNARY
        case Operation():
            return _operation(tree)


def _atom(tree: Number | BlockTitle | VariableName | LoopVariable) -> str:
    match tree:
        case Number():
            return repr(tree.value)
        case BlockTitle():
            return f"'{tree.text}'" if "'" not in tree.text else f'"{tree.text}"'
        case LoopVariable():
            return f"${tree.name}"
        case _:
            return tree.name


def _operation(tree: Operation) -> tuple[str, int]:
    rank = PRECEDENCE[tree.operator]
    if tree.operator == "**":
        left, right = _within(tree.left, _ATOM), _within(tree.right, _UNARY)
    else:
        left, right = _within(tree.left, rank), _within(tree.right, rank + 1)
    return f"{left} {_WORD_OF_SIGN.get(tree.operator, tree.operator)} {right}", rank


def _within(tree: Tree, least: int) -> str:
    """The text of a part, in parentheses if it binds less tightly than ``least``."""
    text, rank = _text(tree)
    return text if rank >= least else f"({text})"
