"""Statements of the compiled language as C, and whole functions."""

from __future__ import annotations

import ast
import io
import tokenize
from collections import Counter
from collections.abc import Iterable, Iterator

from sitl.export.c_expressions import OPERATORS, Expression, Expressions, Variable, overlap
from sitl.export.c_program import Instance, Place, Program, Text
from sitl.export.c_types import ArrayKind, Kind, TupleKind, comment, identifier

INDENT = "    "
_NESTED = (ast.If, ast.For, ast.While)
_TARGETS = (ast.Name, ast.Subscript)


def translate(program: Program, made: Instance) -> None:
    """Translate a function, and those that it calls."""
    source = program.text(made.function)
    _Function(program, made, source).translate()
    if made.puts:  # what is written to is known now, and with it what has to be copied before
        _Function(program, made, source).translate()


class _Function(Expressions):
    """The statements of one function."""

    def __init__(self, program: Program, made: Instance, source: Text) -> None:
        super().__init__(program, made, source)
        self._stores = _stores(source.tree)
        self._homes = _homes(source.tree)
        self._declared: set[str] = set()
        self._late: dict[int, list[str]] = {}  # declarations that stand at the head of a block
        self._comments = _comments(source)
        self._puts = frozenset(made.puts)

    def translate(self) -> None:
        """Fill in the function's head and body."""
        hints = self.program.hints(self.made.function)
        names = [argument.arg for argument in self.source.tree.args.args]
        shapes = iter(self.made.shapes)
        copies: list[str] = []
        for name in names:
            if name not in hints:
                self.refuse(self.source.tree, f"the kind of the parameter {name!r}")
            kind = hints[name]
            if isinstance(kind, ArrayKind):
                shape = next(shapes, ())
                kind = shape if isinstance(shape, ArrayKind) else ArrayKind(shape)
            self.made.parameters[name] = kind
            copies += self._parameter(name, kind)
            self._declared.add(name)
        self.made.returns = hints.get("return")
        body = self._block(self.source.tree.body, id(self.source.tree), 1)
        if self.made.returns is None:
            self.made.returns = type(None)
        heads = [self._head(name, kind) for name, kind in self.made.parameters.items()]
        self.made.head = f"static inline {self._returned()}{self.made.token}({', '.join(heads) or 'void'})"
        unused = [f"{INDENT}(void){self.variables[name].c_name};" for name in names if name not in self._homes]
        self.made.body = [*copies, *unused, *body]

    def _parameter(self, name: str, kind: Kind) -> list[str]:
        """Make a parameter a variable; gives the line that copies it where it changes."""
        c_name, is_mutable = identifier(name), any(put[0] == name for put in self._puts)
        is_pointer = self.program.types.by_pointer(kind) and not self._stores[name]
        self.variables[name] = Variable(kind, c_name, (name,), is_pointer, is_mutable)
        if isinstance(kind, ArrayKind) or is_pointer or not self.program.types.by_pointer(kind):
            return []
        return [f"{INDENT}{self.program.types.declared(kind, c_name)} = *{c_name}_given;"]

    def _head(self, name: str, kind: Kind) -> str:
        """A parameter's declaration."""
        types, seen = self.program.types, self.variables[name]
        if isinstance(kind, ArrayKind):
            return types.declared(kind, seen.c_name, const=not self.made.writes_to(name))
        if not types.by_pointer(kind):
            return types.declared(kind, seen.c_name)
        word = "" if self.made.writes_to(name) else "const "
        return f"{word}{types.name(kind)} *{seen.c_name}{'' if seen.is_pointer else '_given'}"

    def _returned(self) -> str:
        """Type of the result, as it stands before the name."""
        returns = self.made.returns
        if isinstance(returns, ArrayKind):
            return f"const {self.program.types.name(returns.of)} *"
        return f"{self.program.types.name(returns)} "

    # Statements

    def _block(self, statements: list[ast.stmt], block: int, depth: int) -> list[str]:
        lines: list[str] = []
        for number, statement in enumerate(statements):
            if number == 0 and isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                continue  # the docstring
            self._late.setdefault(id(statement), [])
            made = self._noted(statement, self._statement(statement, block, depth), depth)
            lines += [INDENT * depth + late for late in self._late[id(statement)]] + made
        return lines

    def _noted(self, statement: ast.stmt, lines: list[str], depth: int) -> list[str]:
        """A statement's lines with the comments above and beside it."""
        last = statement.lineno if isinstance(statement, _NESTED) else (statement.end_lineno or 0)
        notes = [self._comments.pop(line) for line in sorted(self._comments) if line <= last]
        return [f"{INDENT * depth}/* {comment(note)} */" for note in notes] + lines

    def _statement(self, node: ast.stmt, block: int, depth: int) -> list[str]:
        outer, self.before = self.before, []
        if isinstance(node, ast.If):
            lines = self._if(node, depth)
        elif isinstance(node, ast.For):
            lines = self._for(node, depth)
        elif isinstance(node, ast.While):
            lines = self._while(node, depth)
        else:
            lines = [INDENT * depth + line for line in self._simple(node, block)]
        lines = [INDENT * depth + line for line in self.before] + lines
        self.before = outer
        return lines

    def _simple(self, node: ast.stmt, block: int) -> Iterable[str]:
        if isinstance(node, ast.Return):
            return self._return(node)
        if isinstance(node, ast.Break):
            return ["break;"]
        if isinstance(node, ast.Assign):
            return self._assigned_to_all(node, block)
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            return self._assigned(node.target, node.value, block)
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Subscript) and type(node.op) in OPERATORS:
            return self._stored(node.target, self.expression(node.value), OPERATORS[type(node.op)][0])
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            value = ast.BinOp(left=ast.Name(node.target.id, ast.Load()), op=node.op, right=node.value)
            ast.copy_location(value, node)
            ast.fix_missing_locations(value)
            return self._assigned(node.target, value, block)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            return self._called(node.value)
        return self.refuse(node, f"the statement {ast.unparse(node).splitlines()[0]!r}")

    def _return(self, node: ast.Return) -> list[str]:
        if node.value is None or (isinstance(node.value, ast.Constant) and node.value.value is None):
            return ["return;"]
        if isinstance(node.value, ast.Tuple):
            parts = self.operands(node, node.value.elts)
            made = self.tuple_of(node, parts, self.made.returns)
        else:
            made = self.expression(node.value)
        if isinstance(made.kind, ArrayKind) and len(made.kind.shape) > 1:
            self.refuse(node, f"the array {ast.unparse(node.value)!r} as what is returned")
        if self.made.returns is None or self.made.returns == ArrayKind():
            self.made.returns = made.kind
        return [f"return {self.value(self.converted(node, made, self.made.returns)).text};"]

    def _called(self, node: ast.Call) -> list[str]:
        path = self.program.paths(self.looked_up(node.func))
        if path is None:
            return [f"{self.expression(node).text};"]
        place = self.expression(node.args[0])
        for name in path:
            place = self.field(node, place, name)
        self.note_put(place.place)
        value = self.value(self.converted(node, self.expression(node.args[1]), place.kind))
        return [f"{place.text} = {value.text};"]

    def _assigned_to_all(self, node: ast.Assign, block: int) -> list[str]:
        """``a = b = x``; of several only what is simple, as each takes the value by itself."""
        if len(node.targets) > 1 and not isinstance(node.value, ast.Constant | ast.Name | ast.UnaryOp):
            self.refuse(node, f"the statement {ast.unparse(node)!r}")
        return [line for target in node.targets for line in self._assigned(target, node.value, block)]

    def _assigned(self, target: ast.expr, value: ast.expr, block: int) -> list[str]:
        if isinstance(target, ast.Name):
            return [self._set(target, self.expression(value), block)]
        if isinstance(target, ast.Subscript):
            return self._stored(target, self.expression(value))
        if not isinstance(target, ast.Tuple) or not all(isinstance(part, _TARGETS) for part in target.elts):
            self.refuse(target, f"the assignment to {ast.unparse(target)!r}")
        if isinstance(value, ast.Tuple) and any(isinstance(part, ast.Subscript) for part in target.elts):
            return self._all_stored(target, value, block)
        names = [part for part in target.elts if isinstance(part, ast.Name)]
        if isinstance(value, ast.Tuple) and len(value.elts) == len(names):
            return self._all_at_once(names, value.elts, block)
        whole = self.expression(value)
        if not self.program.types.is_struct(whole.kind):
            self.refuse(value, f"{ast.unparse(value)!r} in {len(names)} parts")
        fields = list(self.program.types.fields(whole.kind))
        if len(fields) != len(names):
            self.refuse(value, f"{ast.unparse(value)!r} in {len(names)} parts: it has {len(fields)}")
        if not whole.place:
            whole = Expression(self.temporary(whole.kind, whole.text), whole.kind)
        taken = [(one, self.field(value, whole, name)) for one, name in zip(names, fields, strict=True)]
        return [self._set(one, part, block) for one, part in taken if one.id != "_"]

    def _stored(self, target: ast.Subscript, value: Expression, operator: str = "") -> list[str]:
        """A number put into an array, or joined by an operator with what is there, or an array filled."""
        parts = target.slice.elts if isinstance(target.slice, ast.Tuple) else [target.slice]
        if any(isinstance(part, ast.Slice) for part in parts) and not operator:
            return self._filled(target, parts, value)
        place = self.expression(target)
        if isinstance(place.kind, ArrayKind):
            self.refuse(target, f"the assignment to {ast.unparse(target)!r}")
        self.note_put(place.place)
        return [f"{place.text} {operator}= {self.value(self.converted(target, value, place.kind)).text};"]

    def _filled(self, target: ast.Subscript, parts: list[ast.expr], value: Expression) -> list[str]:
        """``a[:, :] = x``: all of an array set to a number, or to another array."""
        place = self.expression(target.value)
        whole = all(isinstance(part, ast.Slice) and not (part.lower or part.upper or part.step) for part in parts)
        if not whole or not isinstance(place.kind, ArrayKind) or len(parts) != len(place.kind.shape):
            self.refuse(target, f"the assignment to {ast.unparse(target)!r}")
        self.note_put(place.place)
        lines, indices = [], ""
        for depth, size in enumerate(place.kind.shape):
            lines.append(f"{INDENT * depth}for (int32_t n_{depth} = 0; n_{depth} < {size}; ++n_{depth}) {{")
            indices += f"[n_{depth}]"
        number = value.text + indices if value.kind == place.kind else self.converted(target, value, float).text
        lines.append(f"{INDENT * len(parts)}{place.text}{indices} = {number};")
        return lines + [f"{INDENT * depth}}}" for depth in reversed(range(len(parts)))]

    def _all_stored(self, target: ast.Tuple, value: ast.Tuple, block: int) -> list[str]:
        """``a[i], b[j] = x, y``, where no value looks at what is stored before it."""
        lines: list[str] = []
        stored: set[str] = set()
        for one, part in zip(target.elts, value.elts, strict=True):
            seen = {name.id for name in ast.walk(part) if isinstance(name, ast.Name)}
            if stored & (seen | self._roots(seen)):
                self.refuse(part, f"{ast.unparse(part)!r}, which what is stored before it may change")
            lines += self._assigned(one, part, block)
            array = one.value if isinstance(one, ast.Subscript) else one
            changed = {name.id for name in ast.walk(array) if isinstance(name, ast.Name)}
            stored |= changed | self._roots(changed)
        return lines

    def _roots(self, names: set[str]) -> set[str]:
        """Variables whose parts these names stand for."""
        return {
            self.variables[name].place[0] for name in names if name in self.variables and self.variables[name].place
        }

    def _all_at_once(self, names: list[ast.Name], values: list[ast.expr], block: int) -> list[str]:
        """``a, b = x, y``: nothing is set before everything is worked out."""
        lines, changed = [], set()
        meets = [
            {part.id for part in ast.walk(value) if isinstance(part, ast.Name)} & {one.id for one in names[:number]}
            for number, value in enumerate(values)
        ]
        if not any(meets):
            for one, value in zip(names, values, strict=True):
                lines += [*self._flushed(self._set(one, self.expression(value), block))]
                changed.add(one.id)
            return lines
        kept = []
        for value in values:
            made = self.expression(value)
            kept.append(Expression(self.temporary(made.kind, self.value(made).text), made.kind))
        return [self._set(one, made, block) for one, made in zip(names, kept, strict=True)]

    def _flushed(self, line: str) -> list[str]:
        before, self.before[:] = list(self.before), []
        return [*before, line]

    def _set(self, target: ast.Name, value: Expression, block: int) -> str:
        name, types = target.id, self.program.types
        if isinstance(value.kind, TupleKind) and value.kind.parts == ():
            self.refuse(target, f"the empty tuple {name!r}")
        if name in self._declared:
            seen = self.variables[name]
            made = self.value(self.converted(target, value, seen.kind))
            return f"{seen.c_name} = {made.text};"
        self._declared.add(name)
        c_name, once = identifier(name), self._stores[name] == 1
        home, at = self._homes[name]
        if isinstance(value.kind, ArrayKind):
            if not once or home != block:
                self.refuse(target, f"the array {name!r}, which is not the same one everywhere")
            self.variables[name] = Variable(value.kind, c_name, value.place, is_mutable=value.is_mutable)
            return f"{types.pointed(value.kind, c_name, const=not value.is_mutable)} = {value.text};"
        if once and home == block and types.by_pointer(value.kind) and self._stays(value.place):
            self.variables[name] = Variable(value.kind, c_name, value.place, is_pointer=True)
            return f"const {types.name(value.kind)} *{c_name} = {value.text if value.is_pointer else '&' + value.text};"
        self.variables[name] = Variable(value.kind, c_name, (name,))
        made = self.value(value)
        if home == block:
            return f"{types.declared(value.kind, c_name, const=once)} = {made.text};"
        self._late.setdefault(at, []).append(f"{types.declared(value.kind, c_name)};")
        return f"{c_name} = {made.text};"

    def _stays(self, place: Place) -> bool:
        """Whether a part of a variable is as it is to the function's end."""
        if not place or self._stores[place[0]] > (0 if place[0] in self.made.parameters else 1):
            return False
        return not any(overlap(put, place) for put in self._puts)

    def _if(self, node: ast.If, depth: int) -> list[str]:
        test = self.truth(node.test, self.expression(node.test))
        lines = [f"{INDENT * depth}if ({test.text}) {{", *self._block(node.body, id(node.body[0]), depth + 1)]
        if not node.orelse:
            return [*lines, f"{INDENT * depth}}}"]
        inner = self._block(node.orelse, id(node.orelse[0]), depth + 1)
        if len(node.orelse) == 1 and inner[0].lstrip().startswith("if ("):
            rest = [line[len(INDENT) :] for line in inner]
            return [*lines, f"{INDENT * depth}}} else {rest[0].lstrip()}", *rest[1:]]
        return [*lines, f"{INDENT * depth}}} else {{", *inner, f"{INDENT * depth}}}"]

    def _while(self, node: ast.While, depth: int) -> list[str]:
        if node.orelse:
            self.refuse(node, f"the loop {ast.unparse(node).splitlines()[0]!r}")
        self.lazy += 1  # it is asked anew in every round: nothing can stand before it
        test = self.truth(node.test, self.expression(node.test))
        self.lazy -= 1
        inner = self._block(node.body, id(node.body[0]), depth + 1)
        return [f"{INDENT * depth}while ({test.text}) {{", *inner, f"{INDENT * depth}}}"]

    def _for(self, node: ast.For, depth: int) -> list[str]:
        if not isinstance(node.target, ast.Name) or node.orelse:
            self.refuse(node, f"the loop {ast.unparse(node).splitlines()[0]!r}")
        name, c_name = node.target.id, identifier(node.target.id)
        c_name = f"i_{depth}" if c_name == "_" else c_name
        self._declared.add(name)
        call = node.iter
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range":
            if len(call.args) > 2:
                self.refuse(node, f"the loop {ast.unparse(call)!r}: only range(n) and range(m, n)")
            *begins, end = (self.converted(call, self.expression(part), int) for part in call.args)
            begin = begins[0].text if begins else "0"
            self.variables[name] = Variable(int, c_name, (name,))
            head = [f"for (int32_t {c_name} = {begin}; {c_name} < {end.within(71)}; ++{c_name}) {{"]
            body = []
        elif isinstance(call, ast.Tuple):
            parts = [self.expression(part) for part in call.elts]
            kind = int if all(part.kind is int for part in parts) else float
            parts = [self.converted(call, part, kind) for part in parts]
            real, many, at = self.program.types.name(kind), f"each_{c_name}", f"at_{c_name}"
            self.variables[name] = Variable(kind, c_name, (name,))
            values = ", ".join(part.text for part in parts)
            head = [
                f"const {real} {many}[{len(parts)}] = {{{values}}};",
                f"for (int32_t {at} = 0; {at} < {len(parts)}; ++{at}) {{",
            ]
            body = [f"{INDENT * (depth + 1)}const {real} {c_name} = {many}[{at}];"]
        else:
            self.refuse(node, f"the loop {ast.unparse(node).splitlines()[0]!r}")
        body += self._block(node.body, id(node.body[0]), depth + 1)
        return [*(INDENT * depth + line for line in head), *body, f"{INDENT * depth}}}"]


def _stores(tree: ast.FunctionDef) -> Counter[str]:
    """Count of the assignments to each name."""
    found: Counter[str] = Counter()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found[node.id] += 1
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            found[node.target.id] += 1
    return found


def _homes(tree: ast.FunctionDef) -> dict[str, tuple[int, int]]:
    """Of each name the innermost block that holds all its uses, and the statement there that has the first."""
    uses: dict[str, list[list[tuple[int, int]]]] = {}
    for name, path in _uses(tree.body, id(tree), []):
        uses.setdefault(name, []).append(path)
    found = {}
    for name, paths in uses.items():
        depth = 0
        while all(len(path) > depth for path in paths) and len({path[depth][0] for path in paths}) == 1:
            depth += 1
        found[name] = paths[0][depth - 1]
    return found


def _uses(
    statements: list[ast.stmt], block: int, path: list[tuple[int, int]]
) -> Iterator[tuple[str, list[tuple[int, int]]]]:
    for statement in statements:
        here = [*path, (block, id(statement))]
        nested = [statement.body, statement.orelse] if isinstance(statement, _NESTED) else []
        inside = {id(part) for body in nested for one in body for part in ast.walk(one)}
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and id(node) not in inside:
                yield node.id, here
        for body in nested:
            if body:
                yield from _uses(body, id(body[0]), here)


def _comments(source: Text) -> dict[int, str]:
    """Comments in a function's body by line of its text, but those for the checkers."""
    text = "\n".join(line.rstrip("\n") for line in source.lines) + "\n"
    found = {}
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        note = token.string.lstrip("# ")
        if token.type == tokenize.COMMENT and token.start[0] > source.tree.lineno and not note.startswith("noqa"):
            found[token.start[0]] = note
    return found
