"""Expressions of the compiled language as C: the tree as it is, so that every operation keeps its place."""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any, NoReturn

from sitl.export.c_program import Instance, Place, Program, Text
from sitl.export.c_types import ArrayKind, ExportError, Kind, TupleKind, identifier, is_named
from sitl.storage import field_replaced, value_of

PRIMARY, UNARY, PRODUCT, SUM, RELATION, EQUALITY, AND_BITS, OR_BITS, AND, OR, CHOICE = (
    100, 90, 80, 70, 50, 45, 40, 30, 20, 15, 10,
)  # fmt: skip
OPERATORS: dict[type[ast.operator], tuple[str, int]] = {
    ast.Add: ("+", SUM),
    ast.Sub: ("-", SUM),
    ast.Mult: ("*", PRODUCT),
    ast.Div: ("/", PRODUCT),
    ast.BitOr: ("|", OR_BITS),
    ast.BitAnd: ("&", AND_BITS),
}
COMPARISONS: dict[type[ast.cmpop], tuple[str, int]] = {
    ast.Lt: ("<", RELATION),
    ast.LtE: ("<=", RELATION),
    ast.Gt: (">", RELATION),
    ast.GtE: (">=", RELATION),
    ast.Eq: ("==", EQUALITY),
    ast.NotEq: ("!=", EQUALITY),
}
_SETTLED = (ast.Name, ast.Constant)  # no call changes what these are
BY_FIELD_NAMES = 5  # structs of so many fields are made with their names


@dataclass(frozen=True)
class Expression:
    """An expression of C."""

    text: str
    kind: Kind
    rank: int = PRIMARY
    place: Place = ()  # where it is kept; none of what is computed
    is_pointer: bool = False  # the variable is a pointer to it
    is_mutable: bool = False  # it may be written to

    def within(self, rank: int) -> str:
        """Text as an operand of an operator."""
        return self.text if self.rank >= rank else f"({self.text})"


@dataclass
class Variable:
    """A name in a function."""

    kind: Kind
    c_name: str
    place: Place
    is_pointer: bool = False
    is_mutable: bool = False


@dataclass
class Expressions:
    """Translates the expressions of one function.

    Lines that have to stand before the statement gather in ``before``.
    """

    program: Program
    made: Instance
    source: Text
    variables: dict[str, Variable] = field(default_factory=dict)
    before: list[str] = field(default_factory=list)
    lazy: int = 0  # within so many expressions that may not be reached
    temporaries: int = 0
    writing_calls: int = 0  # so far

    def refuse(self, node: ast.AST, what: str) -> NoReturn:
        """Refuse what the language does not have, with its place."""
        line = self.source.first_line + getattr(node, "lineno", 1) - 1
        raise ExportError(f"{self.source.file}:{line}: the export to C does not know {what}")

    # Names

    def expression(self, node: ast.expr) -> Expression:
        """The C of an expression."""
        method: Callable[[Any], Expression] | None = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            self.refuse(node, f"the expression {ast.unparse(node)!r}")
        return method(node)

    def operands(self, node: ast.AST, parts: list[ast.expr]) -> list[Expression]:
        """The C of expressions that C may work out in any order: what writes stands beside names and numbers alone."""
        values, writes = [], []
        for part in parts:
            before = self.writing_calls
            values.append(self.expression(part))
            writes.append(self.writing_calls > before)
        others = [part for part, does in zip(parts, writes, strict=True) if does or not isinstance(part, _SETTLED)]
        if any(writes) and len(others) > 1:
            self.refuse(node, f"the order of {' and '.join(ast.unparse(part) for part in others)!r}")
        return values

    def _name(self, node: ast.Name) -> Expression:
        if node.id in self.variables:
            seen = self.variables[node.id]
            return Expression(
                seen.c_name, seen.kind, place=seen.place, is_pointer=seen.is_pointer, is_mutable=seen.is_mutable
            )
        value = self.looked_up(node)
        return self._constant_named(node, node.id, value, self.made.function)

    def looked_up(self, node: ast.expr) -> Any:  # noqa: ANN401 - what Python finds
        """The object of a name of the module, or of a module in it; refused where there is none."""
        if isinstance(node, ast.Name):
            scope = self.made.function.__globals__
            if node.id in scope:
                return scope[node.id]
            if node.id in (built_in := scope.get("__builtins__", {})) or hasattr(built_in, node.id):
                return built_in[node.id] if isinstance(built_in, dict) else getattr(built_in, node.id)
            self.refuse(node, f"the name {node.id!r}")
        if isinstance(node, ast.Attribute):
            holder = self.looked_up(node.value)
            if hasattr(holder, node.attr):
                return getattr(holder, node.attr)
        return self.refuse(node, f"{ast.unparse(node)!r}")

    def _constant_named(self, node: ast.expr, name: str, value: Any, function: Callable[..., Any]) -> Expression:  # noqa: ANN401
        if not isinstance(value, bool | int | float):
            self.refuse(node, f"{name!r}, which is neither a number nor a variable")
        kind = bool if isinstance(value, bool) else int if isinstance(value, int) else float
        return Expression(self.program.constant(self.made.module, function, name, value), kind)

    def _constant(self, node: ast.Constant) -> Expression:
        if not isinstance(node.value, bool | int | float):
            self.refuse(node, f"the constant {node.value!r}")
        return self.literal(node.value)

    def literal(self, value: Any) -> Expression:  # noqa: ANN401 - a number
        """A number as it is written."""
        kind = bool if isinstance(value, bool) else int if isinstance(value, int) else float
        text = self.program.types.number(value)
        return Expression(text, kind, UNARY if text.startswith("-") else PRIMARY)

    def _attribute(self, node: ast.Attribute) -> Expression:
        if not self._is_value(node.value):
            holder, value = self.looked_up(node.value), self.looked_up(node)
            if isinstance(holder, ModuleType):
                if holder is math:
                    return self.literal(value)
                return self.constant_of(node, holder, value)
            return self.literal(int(value)) if isinstance(value, int) else self.refuse(node, ast.unparse(node))
        base = self.expression(node.value)
        if isinstance(base.kind, ArrayKind) and node.attr == "size":
            return self.literal(math.prod(base.kind.shape))
        return self.field(node, base, node.attr)

    def constant_of(self, node: ast.expr, module: ModuleType, value: Any) -> Expression:  # noqa: ANN401
        """A constant that is named with its module."""
        name = ast.unparse(node).rpartition(".")[2]
        if not isinstance(value, bool | int | float):
            self.refuse(node, f"{ast.unparse(node)!r}, which is no number")
        home = self.program.module(module.__name__)
        self.program.need(self.made.module, home)
        text = self.program.declare_constant(home, name, value)
        return Expression(text, bool if isinstance(value, bool) else int if isinstance(value, int) else float)

    def field(self, node: ast.AST, base: Expression, name: str) -> Expression:
        """A field of a struct."""
        fields = self.program.types.fields(base.kind) if self.program.types.is_struct(base.kind) else {}
        if name not in fields:
            self.refuse(node, f"{name!r} of {base.text}: aboard there is {', '.join(fields) or 'nothing in it'}")
        text = f"{base.text}{'->' if base.is_pointer else '.'}{identifier(name)}"
        if self.program.types.is_view(base.kind) and isinstance(fields[name], ArrayKind):
            return Expression(text, fields[name], is_mutable=True)
        place = (*base.place, name) if base.place else ()
        return Expression(text, fields[name], place=place, is_mutable=base.is_mutable)

    def _is_value(self, node: ast.expr) -> bool:
        """Whether an expression begins with a variable or is computed; else it names a module's member."""
        while isinstance(node, ast.Attribute):
            node = node.value
        return not isinstance(node, ast.Name) or node.id in self.variables

    def _subscript(self, node: ast.Subscript) -> Expression:
        base = self.expression(node.value)
        parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if self.program.types.is_struct(base.kind):
            index = parts[0].value if len(parts) == 1 and isinstance(parts[0], ast.Constant) else None
            fields = list(self.program.types.fields(base.kind))
            if not isinstance(index, int) or not 0 <= index < len(fields):
                self.refuse(node, f"the part {ast.unparse(node)!r} of a tuple: only a constant index from 0")
            return self.field(node, base, fields[index])
        if not isinstance(base.kind, ArrayKind) or len(parts) > len(base.kind.shape):
            self.refuse(node, f"{ast.unparse(node)!r}")
        places = [self.converted(part, self.expression(part), int).text for part in parts]
        rest = base.kind.shape[len(parts) :]
        text = base.text + "".join(f"[{place}]" for place in places)
        kind = ArrayKind(rest, base.kind.of) if rest else base.kind.of
        return Expression(text, kind, place=base.place, is_mutable=base.is_mutable)

    # Operators

    def _binop(self, node: ast.BinOp) -> Expression:
        if isinstance(node.op, ast.Mod):
            values = self.operands(node, [node.left, node.right])
            if {value.kind for value in values} != {int}:
                self.refuse(node, f"{ast.unparse(node)!r} of these kinds")
            return Expression(f"darko_modulo({values[0].text}, {values[1].text})", int)
        if type(node.op) not in OPERATORS:
            self.refuse(node, f"the operator of {ast.unparse(node)!r}")
        sign, rank = OPERATORS[type(node.op)]
        left, right = self.operands(node, [node.left, node.right])
        is_bits = isinstance(node.op, ast.BitOr | ast.BitAnd)
        kinds = {left.kind, right.kind}
        if is_bits:
            kind: Kind = int if kinds == {int} else self.refuse(node, f"{ast.unparse(node)!r} of these kinds")
        elif isinstance(node.op, ast.Div) or float in kinds:
            kind = float
        else:
            kind = int
        left, right = self.converted(node, left, kind), self.converted(node, right, kind)
        if is_bits:  # said with brackets, as a reader and the compiler want it
            rank_of = {left.rank: left.within(UNARY if left.rank != rank else rank)}
            return Expression(f"{rank_of[left.rank]} {sign} {right.within(UNARY)}", int, rank)
        return Expression(f"{left.within(rank)} {sign} {right.within(rank + 1)}", kind, rank)

    def converted(self, node: ast.AST, value: Expression, kind: Kind) -> Expression:
        """A value as one of another kind: whole numbers become real ones, as in Python."""
        if value.kind == kind or (isinstance(kind, TupleKind) and value.kind == kind):
            return value
        if kind is float and value.kind in {int, bool}:
            if value.text.lstrip("-").isdigit():
                return self.literal(float(value.text))
            return Expression(f"({self.program.types.real}){value.within(UNARY)}", float, UNARY)
        if kind is int and value.kind is bool:
            return Expression(f"({value.text} ? 1 : 0)", int)
        return self.refuse(node, f"a value of kind {value.kind} as {kind}: {value.text}")

    def _unaryop(self, node: ast.UnaryOp) -> Expression:
        value = self.expression(node.operand)
        if isinstance(node.op, ast.Not):
            return Expression(f"!{self.truth(node, value).within(UNARY)}", bool, UNARY)
        if not isinstance(node.op, ast.USub) or value.kind not in {int, float}:
            self.refuse(node, f"{ast.unparse(node)!r}")
        inner = value.within(UNARY)
        return Expression(f"-({inner})" if inner.startswith("-") else f"-{inner}", value.kind, UNARY)

    def truth(self, node: ast.AST, value: Expression) -> Expression:
        """A value that is asked whether it is true."""
        return value if value.kind is bool else self.refuse(node, f"the truth of {value.text}: it is no bool")

    def _boolop(self, node: ast.BoolOp) -> Expression:
        sign, rank = ("&&", AND) if isinstance(node.op, ast.And) else ("||", OR)
        parts = [self.truth(node, self.expression(node.values[0]))]
        self.lazy += 1
        parts += [self.truth(node, self.expression(value)) for value in node.values[1:]]
        self.lazy -= 1
        return Expression(f" {sign} ".join(part.within(AND_BITS) for part in parts), bool, rank)

    def _compare(self, node: ast.Compare) -> Expression:
        if len(node.ops) != 1:
            self.refuse(node, f"the chain of comparisons {ast.unparse(node)!r}")
        op, right = node.ops[0], node.comparators[0]
        if isinstance(op, ast.In | ast.NotIn) and isinstance(right, ast.Tuple):
            left = self.expression(node.left)
            tests = [self._compared(node, left, self.expression(one), ast.Eq).text for one in right.elts]
            text = " || ".join(tests)
            return Expression(f"!({text})", bool, UNARY) if isinstance(op, ast.NotIn) else Expression(text, bool, OR)
        one, other = self.operands(node, [node.left, right])
        return self._compared(node, one, other, type(op))

    def _compared(self, node: ast.Compare, left: Expression, right: Expression, op: type[ast.cmpop]) -> Expression:
        if op not in COMPARISONS or not {left.kind, right.kind} <= {int, float, bool}:
            self.refuse(node, f"the comparison {ast.unparse(node)!r}")
        sign, rank = COMPARISONS[op]
        kind = float if float in {left.kind, right.kind} else left.kind
        left, right = self.converted(node, left, kind), self.converted(node, right, kind)
        return Expression(f"{left.within(SUM)} {sign} {right.within(SUM)}", bool, rank)

    def _ifexp(self, node: ast.IfExp) -> Expression:
        test = self.truth(node.test, self.expression(node.test))
        self.lazy += 1
        yes, no = self.expression(node.body), self.expression(node.orelse)
        self.lazy -= 1
        kind = self.common(node, [yes.kind, no.kind])
        yes, no = self.value(self.converted(node, yes, kind)), self.value(self.converted(node, no, kind))
        return Expression(f"{test.within(OR + 1)} ? {yes.within(OR)} : {no.within(OR)}", kind, CHOICE)

    def common(self, node: ast.AST, kinds: list[Kind]) -> Kind:
        """The kind that values of several can be."""
        if len(set(kinds)) == 1:
            return kinds[0]
        return float if set(kinds) <= {int, float} else self.refuse(node, f"values of the kinds {kinds} in one place")

    def _tuple(self, node: ast.Tuple) -> Expression:
        return self.tuple_of(node, self.operands(node, node.elts), None)

    def tuple_of(self, node: ast.AST, parts: list[Expression], kind: Kind) -> Expression:
        """A tuple; of a kind, where that is known."""
        wanted = list(kind.parts) if isinstance(kind, TupleKind) else [part.kind for part in parts]
        values = [self.value(self.converted(node, part, one)).text for part, one in zip(parts, wanted, strict=True)]
        made = TupleKind(tuple(wanted))
        return Expression(f"({self.program.types.name(made)}){{{', '.join(values)}}}", made)

    def value(self, seen: Expression) -> Expression:
        """An expression for the value itself, where a pointer leads to it."""
        return Expression(f"*{seen.text}", seen.kind, UNARY, seen.place) if seen.is_pointer else seen

    def temporary(self, kind: Kind, text: str) -> str:
        """A variable of its own for a value, declared before the statement."""
        self.temporaries += 1
        name = f"made_{self.temporaries}"
        self.before.append(f"const {self.program.types.declared(kind, name)} = {text};")
        return name

    # Calls

    def _call(self, node: ast.Call) -> Expression:
        if any(isinstance(part, ast.Starred) for part in node.args) or any(key.arg is None for key in node.keywords):
            self.refuse(node, f"the starred arguments of {ast.unparse(node)!r}")
        if isinstance(node.func, ast.Attribute) and node.func.attr == "_replace":
            return self._replaced(node, self.expression(node.func.value), self._by_keyword(node))
        called: Any = self.looked_up(node.func)
        if called is value_of:
            return self.expression(node.args[0])
        if is_named(called):
            return self._struct(node, called)
        if name := field_replaced(called):
            base, value = (self.expression(part) for part in node.args)
            return self._replaced(node, base, {name: value})
        if called in {min, max, abs, int, float, bool} or called is math.sqrt:
            return self._built_in(node, called)
        if inspect.isfunction(called) or inspect.isfunction(getattr(called, "py_func", None)):
            return self._function(node, getattr(called, "py_func", called))
        return self.refuse(node, f"{ast.unparse(node.func)!r}")

    def _built_in(self, node: ast.Call, called: Any) -> Expression:  # noqa: ANN401
        values = self.operands(node, node.args)
        real = self.program.types.real
        single = self.program.types.single
        if called is math.sqrt:
            root = "sqrtf" if single else "sqrt"
            return Expression(f"{root}({self.converted(node, values[0], float).text})", float)
        if called is abs and values[0].kind is float:
            return Expression(f"{'fabsf' if single else 'fabs'}({values[0].text})", float)
        if called is float:
            return self.converted(node, values[0], float)
        if called is bool:
            return self.truth(node, values[0])
        if called is int and values[0].kind is float:
            return Expression(f"(int32_t){values[0].within(UNARY)}", int, UNARY)
        if called in {min, max} and len(values) > 1:
            kind = self.common(node, [value.kind for value in values])
            word = f"darko_{called.__name__}_{'int' if kind is int else real}"
            text = self.converted(node, values[0], kind).text
            for value in values[1:]:
                text = f"{word}({text}, {self.converted(node, value, kind).text})"
            return Expression(text, kind)
        return self.refuse(node, f"{ast.unparse(node)!r} of this kind")

    def _given(self, node: ast.Call, names: list[str], defaults: dict[str, Any]) -> list[Expression]:
        """Arguments in the order of the parameters, left out ones by their defaults."""
        told = [*names[: len(node.args)], *(str(key.arg) for key in node.keywords)]
        parts = [*node.args, *(key.value for key in node.keywords)]
        given = dict(zip(told, self.operands(node, parts), strict=True))
        for name in names:
            if name not in given and name not in defaults:
                self.refuse(node, f"{ast.unparse(node)!r} without {name}")
        return [given[name] if name in given else self.literal(defaults[name]) for name in names]

    def _struct(self, node: ast.Call, kind: Any) -> Expression:  # noqa: ANN401 - a NamedTuple's class
        kind = self.program.types.resolved(kind)
        values = self._given(node, list(kind._fields), kind._field_defaults)
        if any(isinstance(value.kind, ArrayKind) for value in values):
            return self._view(node, kind, values)
        fields = self.program.types.fields(kind)
        if any(isinstance(part, ArrayKind) for part in fields.values()):
            self.refuse(node, f"a {kind.__name__} made in flight: it holds arrays")
        return self._struct_of(node, kind, fields, values)

    def _view(self, node: ast.Call, kind: Any, values: list[Expression]) -> Expression:  # noqa: ANN401
        """A struct of arrays that stay where they are, and may be written to through it."""
        arrays = {
            name: value for name, value in zip(kind._fields, values, strict=True) if isinstance(value.kind, ArrayKind)
        }
        if not self.program.types.learn_view(kind, {name: value.kind.shape for name, value in arrays.items()}):
            self.refuse(node, f"a {kind.__name__} made in flight: it holds arrays")
        for value in arrays.values():
            self.note_put(value.place)
        return self._struct_of(node, kind, self.program.types.fields(kind), values)

    def _struct_of(self, node: ast.Call, kind: Any, fields: dict[str, Kind], values: list[Expression]) -> Expression:  # noqa: ANN401
        texts = [
            self.value(self.converted(node, value, part)).text
            for value, part in zip(values, fields.values(), strict=True)
        ]
        if node.keywords or len(fields) >= BY_FIELD_NAMES:
            texts = [f".{identifier(name)} = {text}" for name, text in zip(fields, texts, strict=True)]
        return Expression(f"({self.program.types.name(kind)}){{{', '.join(texts)}}}", kind)

    def _by_keyword(self, node: ast.Call) -> dict[str, Expression]:
        return {str(key.arg): self.expression(key.value) for key in node.keywords}

    def _replaced(self, node: ast.Call, base: Expression, values: dict[str, Expression]) -> Expression:
        """A copy of a struct with other values in some fields."""
        if self.lazy or not self.program.types.is_struct(base.kind):
            self.refuse(node, f"{ast.unparse(node)!r} here")
        fields = self.program.types.fields(base.kind)
        self.temporaries += 1
        name = f"made_{self.temporaries}"
        self.before.append(f"{self.program.types.declared(base.kind, name)} = {self.value(base).text};")
        for key, value in values.items():
            if key not in fields:
                self.refuse(node, f"the field {key!r}")
            self.before.append(
                f"{name}.{identifier(key)} = {self.value(self.converted(node, value, fields[key])).text};"
            )
        return Expression(name, base.kind)

    def _function(self, node: ast.Call, function: Callable[..., Any]) -> Expression:
        parameters = inspect.signature(function).parameters
        defaults = {name: one.default for name, one in parameters.items() if one.default is not inspect.Parameter.empty}
        values = self._given(node, list(parameters), defaults)
        arrays = [value.kind for value in values if isinstance(value.kind, ArrayKind)]
        shapes = tuple(kind.shape if kind.of is float else kind for kind in arrays)
        called = self.program.instance(function, shapes)
        self.program.need(self.made.module, called.module)
        given = dict(zip(called.parameters, values, strict=True))
        puts = {(*given[name].place, *rest) for name, *rest in called.puts if given[name].place}
        for put in puts:
            self.note_put(put)
        self.writing_calls += len(called.puts) > 0
        texts = []
        for (name, kind), value in zip(called.parameters.items(), values, strict=True):
            if isinstance(kind, ArrayKind):
                texts.append(self._array_argument(node, value, kind, written=called.writes_to(name)))
                continue
            changes = not called.writes_to(name) and any(overlap(put, value.place) for put in puts)
            texts.append(self._argument(node, self._computed(value) if changes else value, kind))
        return Expression(f"{called.token}({', '.join(texts)})", called.returns)

    def note_put(self, place: Place) -> None:
        """Note that a part of a parameter is written to."""
        if place and place[0] in self.made.parameters:
            self.made.puts.add(place)

    def _computed(self, value: Expression) -> Expression:
        """A value by itself, which no change of where it was kept reaches."""
        value = self.value(value)
        return Expression(value.text, value.kind, value.rank)

    def _array_argument(self, node: ast.Call, value: Expression, kind: ArrayKind, *, written: bool) -> str:
        if value.kind != kind:
            self.refuse(node, f"{value.text} as an array of {kind.shape}")
        if not value.is_mutable or written or len(kind.shape) == 1:
            return value.text
        # C has no way from rows of numbers to rows of constant numbers but to say so.
        return f"({self.program.types.pointed(kind, '')}){value.within(UNARY)}"

    def _argument(self, node: ast.Call, value: Expression, kind: Kind) -> str:
        value = self.converted(node, value, kind)
        if not self.program.types.by_pointer(kind):
            return self.value(value).text
        if value.is_pointer:
            return value.text
        if value.place:
            return f"&{value.text}"
        if self.lazy:  # it may not be worked out before it is known to be needed
            return f"({self.program.types.name(kind)}[1]){{{value.text}}}"
        return f"&{self.temporary(kind, value.text)}"


def overlap(one: Place, other: Place) -> bool:
    """Whether two places are one, or one is a part of the other."""
    n = min(len(one), len(other))
    return n > 0 and one[:n] == other[:n]
