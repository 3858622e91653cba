"""The unit of an expression of fields, as the messages' definitions have it; empty where it is not known."""

from __future__ import annotations

import ast

from protocol.errors import LocalProtocolError
from protocol.tlog.message_set import message_named

__all__ = ["unit_of"]

KEEPS_UNIT = {"abs", "min", "max", "hypot"}  # of values of one unit
ANGLES = {"deg": ("rad", "deg"), "rad": ("deg", "rad")}  # a function's unit of what it takes, and of what it gives


def unit_of(node: ast.expr) -> str:
    """The unit of an expression's tree, such as ``m/s``."""
    match node:
        case (
            ast.Attribute(value=ast.Name(id=message), attr=field)
            | ast.Subscript(value=ast.Attribute(value=ast.Name(id=message), attr=field))
        ):
            return _field_unit(message, field)
        case ast.UnaryOp(operand=operand):
            return unit_of(operand)
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub(), right=right):
            return _common([left, right])
        case ast.Call(func=ast.Name(id=name), args=arguments) if name in ANGLES:
            taken, given = ANGLES[name]
            unit = _common(arguments)
            return given + unit.removeprefix(taken) if unit.startswith(taken) else ""
        case ast.Call(func=ast.Name(id="atan2")):
            return "rad"
        case ast.Call(func=ast.Name(id=name), args=arguments) if name in KEEPS_UNIT:
            return _common(arguments)
    return ""


def _common(parts: list[ast.expr]) -> str:
    """The unit that all parts have; a bare number has that of the others."""
    units = {unit_of(part) for part in parts if not _is_number(part)}
    return units.pop() if len(units) == 1 else ""


def _is_number(node: ast.expr) -> bool:
    return not any(isinstance(part, ast.Attribute) for part in ast.walk(node))


def _field_unit(message: str, field: str) -> str:
    try:
        units: dict[str, str] = message_named(message).fieldunits_by_name
    except LocalProtocolError:
        return ""
    return units.get(field, "")
