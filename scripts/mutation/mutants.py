"""The small changes that mutation testing makes to a module: each one a mutant that some test should notice."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from typing import NamedTuple

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitAnd,
}
OPERATORS = (ast.Compare, ast.BinOp, ast.BoolOp, ast.UnaryOp)
# Texts and what raises one are for people; imports, decorators and annotations compute nothing.
SKIPPED = (ast.JoinedStr, ast.Raise, ast.Assert, ast.Import, ast.ImportFrom)
CACHED = re.compile(r"(functools\.)?(lru_)?cache\b")  # decorators of what only its first caller computes
CLASS_NAME = re.compile(r"_?[A-Z]\w*[a-z]\w*")
UNIT = 1000  # numbers up to here may count something: they change by one, larger ones are doubled


class Mutant(NamedTuple):
    """One change of one expression."""

    file: str  # relative to the tree
    line: int
    function: str  # qualified name; empty outside of functions, and in those that compute once for all callers
    start: int  # bytes of the file that are replaced
    end: int
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}  {self.before}  ->  {self.after}"

    def applied(self, source: bytes) -> bytes:
        """The source with this change in it; parentheses keep the change in its place."""
        return source[: self.start] + f"({self.after})".encode() + source[self.end :]


def mutants_of(file: str, source: bytes) -> list[Mutant]:
    """All mutants of a module, in the order of the text.

    Raises:
        SyntaxError: The source is not Python.
    """
    starts = [0]
    for text in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(text))
    found = []
    for node, function, after in _changes(ast.parse(source), None):
        start = starts[node.lineno - 1] + node.col_offset
        end = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
        before = " ".join(source[start:end].decode().split())
        found.append(Mutant(file, node.lineno, function or "", start, end, before, after))
    return sorted(found, key=lambda mutant: (mutant.start, mutant.end, mutant.after))


def _changes(node: ast.AST, function: str | None, scope: str = "") -> Iterator[tuple[ast.expr, str | None, str]]:
    """The expressions at and below a node that can change, with their function and the changed text."""
    if isinstance(node, SKIPPED):
        return
    if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and function is None:
        scope = f"{scope}.{node.name}".lstrip(".")
        if not isinstance(node, ast.ClassDef):
            function = "" if any(CACHED.match(ast.unparse(by)) for by in node.decorator_list) else scope
    if isinstance(node, ast.expr):
        for changed in _changed(node):
            yield node, function, ast.unparse(changed)
    for condition in _conditions(node):
        yield condition, function, f"not ({ast.unparse(condition)})"
    for child in _computing(node):
        yield from _changes(child, function, scope)


def _computing(node: ast.AST) -> Iterator[ast.AST]:
    """The children of a node that compute something when the module runs."""
    skipped = {"annotation", "returns", "decorator_list", "type_comment"}
    for name, value in ast.iter_fields(node):
        if name not in skipped:
            yield from (item for item in (value if isinstance(value, list) else [value]) if isinstance(item, ast.AST))


def _conditions(node: ast.AST) -> Iterator[ast.expr]:
    """Conditions that are not operators themselves: those have mutants of their own."""
    tests: list[ast.expr] = []
    if isinstance(node, ast.If | ast.While | ast.IfExp):
        tests = [node.test]
    elif isinstance(node, ast.comprehension):
        tests = node.ifs
    for test in tests:
        if not isinstance(test, OPERATORS) or isinstance(test, ast.BoolOp):
            yield test


def _changed(node: ast.expr) -> Iterator[ast.expr]:
    """Mutations of an expression."""
    if isinstance(node, ast.Compare):
        for index, operator in enumerate(node.ops):
            for other in COMPARISONS[type(operator)]:
                operators = [*node.ops[:index], other(), *node.ops[index + 1 :]]
                yield ast.Compare(node.left, operators, node.comparators)
    elif isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC and not _is_text_or_type(node):
        yield ast.BinOp(node.left, ARITHMETIC[type(node.op)](), node.right)
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub | ast.Invert):
        yield node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
        yield ast.Constant(_other_number(node.value))


def _is_text_or_type(node: ast.BinOp) -> bool:
    """Whether an operator joins texts or types: changed, it could only raise at once."""
    sides = (node.left, node.right)
    if any(isinstance(side, ast.JoinedStr | ast.List | ast.Tuple) for side in sides):
        return True
    if any(isinstance(side, ast.Constant) and isinstance(side.value, str | bytes | None) for side in sides):
        return True
    return isinstance(node.op, ast.BitOr) and any(CLASS_NAME.fullmatch(ast.unparse(side)) for side in sides)


def _other_number(value: complex) -> complex:
    """Another truth value; one more for what may count something; otherwise double."""
    if isinstance(value, bool):
        return not value
    small = abs(value) <= UNIT if isinstance(value, int) else abs(value) < 1.0
    return value + 1 if small else 2 * value
