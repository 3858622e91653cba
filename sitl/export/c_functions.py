"""Statements of the compiled language as C, and whole functions."""

from __future__ import annotations

import ast
import io
import tokenize
from collections import Counter
from collections.abc import Iterable, Iterator

from sitl.export.c_expressions import Expression, Expressions, Variable
from sitl.export.c_program import Instance, Program, Text
from sitl.export.c_types import ArrayKind, Kind, TupleKind, comment, identifier

INDENT = "    "


def translate(program: Program, made: Instance) -> None:
    """Translate a function, and those that it calls."""
    source = program.text(made.function)
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
        self._puts = self._written_paths()

    def translate(self) -> None:
        """Fill in the function's head and body."""
        hints = self.program.hints(self.made.function)
        names = [argument.arg for argument in self.source.tree.args.args]
        shapes = iter(self.made.shapes)
        copies: list[str] = []
        heads: list[str] = []
        for name in names:
            if name not in hints:
                self.refuse(self.source.tree, f"the kind of the parameter {name!r}")
            kind = hints[name]
            if isinstance(kind, ArrayKind):
                kind = ArrayKind(next(shapes, ()))
            self.made.parameters[name] = kind
            heads.append(self._parameter(name, kind, copies))
            self._declared.add(name)
        self.made.returns = hints.get("return")
        body = self._block(self.source.tree.body, id(self.source.tree), 1)
        if self.made.returns is None:
            self.made.returns = type(None)
        returned = "void" if self.made.returns is type(None) else self.program.types.name(self.made.returns)
        heads = [head if self.made.writes else head.replace("\1", "const ") for head in heads]
        heads = [head.replace("\1", "") for head in heads]
        self.made.head = f"static inline {returned} {self.made.token}({', '.join(heads) or 'void'})"
        unused = [f"{INDENT}(void){self.variables[name].c_name};" for name in names if name not in self._homes]
        self.made.body = [*copies, *unused, *body]

    def _parameter(self, name: str, kind: Kind, copies: list[str]) -> str:
        types, c_name, changes = self.program.types, identifier(name), self._stores[name] > 0
        if isinstance(kind, ArrayKind):
            self.variables[name] = Variable(kind, c_name)
            return types.declared(kind, c_name, const=True)
        if not types.by_pointer(kind):
            self.variables[name] = Variable(kind, c_name)
            return types.declared(kind, c_name)
        if changes:
            copies.append(f"{INDENT}{types.declared(kind, c_name)} = *{c_name}_given;")
            self.variables[name] = Variable(kind, c_name)
            return f"const {types.name(kind)} *{c_name}_given"
        self.variables[name] = Variable(kind, c_name, is_pointer=True)
        return f"{chr(1) if name == 'flight' else 'const '}{types.name(kind)} *{c_name}"

    def _written_paths(self) -> list[tuple[str, ...]]:
        found = []
        for node in ast.walk(self.source.tree):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                path = self.program.paths(self.made.function.__globals__.get(node.func.id))
                if path is not None:
                    found.append(path)
        return found

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
        last = statement.lineno if isinstance(statement, ast.If | ast.For) else (statement.end_lineno or 0)
        notes = [self._comments.pop(line) for line in sorted(self._comments) if line <= last]
        return [f"{INDENT * depth}/* {comment(note)} */" for note in notes] + lines

    def _statement(self, node: ast.stmt, block: int, depth: int) -> list[str]:
        outer, self.before = self.before, []
        if isinstance(node, ast.If):
            lines = self._if(node, depth)
        elif isinstance(node, ast.For):
            lines = self._for(node, depth)
        else:
            lines = [INDENT * depth + line for line in self._simple(node, block)]
        lines = [INDENT * depth + line for line in self.before] + lines
        self.before = outer
        return lines

    def _simple(self, node: ast.stmt, block: int) -> Iterable[str]:
        if isinstance(node, ast.Return):
            return self._return(node)
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            return self._assigned(node.targets[0], node.value, block)
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            return self._assigned(node.target, node.value, block)
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
            parts = [self.expression(part) for part in node.value.elts]
            made = self.tuple_of(node, parts, self.made.returns)
        else:
            made = self.expression(node.value)
        if self.made.returns is None:
            self.made.returns = made.kind
        return [f"return {self.value(self.converted(node, made, self.made.returns)).text};"]

    def _called(self, node: ast.Call) -> list[str]:
        path = self.program.paths(self.looked_up(node.func))
        if path is None:
            return [f"{self.expression(node).text};"]
        self.made.writes = True
        place = self.expression(node.args[0])
        for name in path:
            place = self.field(node, place, name)
        value = self.value(self.converted(node, self.expression(node.args[1]), place.kind))
        return [f"{place.text} = {value.text};"]

    def _assigned(self, target: ast.expr, value: ast.expr, block: int) -> list[str]:
        if isinstance(target, ast.Name):
            return [self._set(target, self.expression(value), block)]
        if not isinstance(target, ast.Tuple) or not all(isinstance(part, ast.Name) for part in target.elts):
            self.refuse(target, f"the assignment to {ast.unparse(target)!r}")
        names = [part for part in target.elts if isinstance(part, ast.Name)]
        if isinstance(value, ast.Tuple) and len(value.elts) == len(names):
            return self._all_at_once(names, value.elts, block)
        whole = self.expression(value)
        if not self.program.types.is_struct(whole.kind):
            self.refuse(value, f"{ast.unparse(value)!r} in {len(names)} parts")
        fields = list(self.program.types.fields(whole.kind))
        if len(fields) != len(names):
            self.refuse(value, f"{ast.unparse(value)!r} in {len(names)} parts: it has {len(fields)}")
        if not whole.root:
            whole = Expression(self.temporary(whole.kind, whole.text), whole.kind)
        taken = [(one, self.field(value, whole, name)) for one, name in zip(names, fields, strict=True)]
        return [self._set(one, part, block) for one, part in taken if one.id != "_"]

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
            self.variables[name] = Variable(value.kind, c_name)
            return f"{types.pointed(value.kind, c_name)} = {value.text};"
        if once and home == block and types.by_pointer(value.kind) and self._stays(value.root, value.text):
            self.variables[name] = Variable(value.kind, c_name, is_pointer=True)
            return f"const {types.name(value.kind)} *{c_name} = {value.text if value.is_pointer else '&' + value.text};"
        self.variables[name] = Variable(value.kind, c_name)
        made = self.value(value)
        if home == block:
            return f"{types.declared(value.kind, c_name, const=once)} = {made.text};"
        self._late.setdefault(at, []).append(f"{types.declared(value.kind, c_name)};")
        return f"{c_name} = {made.text};"

    def _stays(self, root: str, text: str) -> bool:
        """Whether a part of a variable is as it is to the function's end."""
        if not root or self._stores[root] > (0 if root in self.made.parameters else 1):
            return False
        path = tuple(text.replace("->", ".").split(".")[1:])
        return root != "flight" or not any(path[: len(put)] == put[: len(path)] for put in self._puts)

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

    def _for(self, node: ast.For, depth: int) -> list[str]:
        if not isinstance(node.target, ast.Name) or node.orelse:
            self.refuse(node, f"the loop {ast.unparse(node).splitlines()[0]!r}")
        name, c_name = node.target.id, identifier(node.target.id)
        c_name = f"i_{depth}" if c_name == "_" else c_name
        self._declared.add(name)
        call = node.iter
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range":
            if len(call.args) != 1:
                self.refuse(node, f"the loop {ast.unparse(call)!r}: only range(n)")
            end = self.converted(call, self.expression(call.args[0]), int)
            self.variables[name] = Variable(int, c_name)
            head = [f"for (int32_t {c_name} = 0; {c_name} < {end.within(71)}; ++{c_name}) {{"]
            body = []
        elif isinstance(call, ast.Tuple):
            parts = [self.converted(call, self.expression(part), float) for part in call.elts]
            real, many, at = self.program.types.real, f"each_{c_name}", f"at_{c_name}"
            self.variables[name] = Variable(float, c_name)
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
        nested = [statement.body, statement.orelse] if isinstance(statement, ast.If | ast.For) else []
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
