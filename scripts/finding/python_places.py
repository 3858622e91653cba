"""Places in a file of Python: definitions, constants, fields with their metadata, and texts."""

import ast
import re
from collections.abc import Iterator

from .place import MOST_OF_A_VALUE, Place

Definition = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
Assignment = ast.Assign | ast.AnnAssign

TEXT = re.compile(r"[^\W\d]{2,} \S*[^\W\d]{2,}")  # at least two words
USED = re.compile(r"\w\.([a-z]\w+_\w+)\b(?!\()")  # names of at least two words
FOR_TOOLS = re.compile(r"  # (?:fmt: |noqa|type: )")
ENTRY = re.compile(r"^ +(\w+(?:, \w+)*): (.+)$", re.MULTILINE)  # of a docstring's section


def python_places(path: str, text: str) -> Iterator[Place]:
    """The file itself, then what is in it.

    Args:
        path: Of the file, from the root.
        text: Its source.
    """
    tree = ast.parse(text)
    first, more = described(tree)
    yield Place(path, 1, "", first, more)
    yield from _Reader(path, text.splitlines()).members(tree, "", "")


def described(node: ast.Module | Definition) -> tuple[str, str]:
    """A docstring's first line, and the rest; empty without one."""
    first, _, more = (ast.get_docstring(node) or "").partition("\n")
    return first, more


class _Reader:
    """Reads one file.

    Args:
        path: Of the file, from the root.
        lines: Its source.
    """

    def __init__(self, path: str, lines: list[str]) -> None:
        self._path = path
        self._lines = lines

    def members(self, node: ast.Module | ast.ClassDef, scope: str, around: str) -> Iterator[Place]:
        """Places in a file or a class.

        Args:
            node: The file or class.
            scope: Names of the classes it is in, each with a dot behind it.
            around: What the class says.
        """
        told = dict(_entries(ast.get_docstring(node) or ""))
        for part in node.body:
            if isinstance(part, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                yield from self._definition(part, scope, around)
            elif isinstance(part, ast.Assign | ast.AnnAssign):
                yield from self._assigned(part, scope, around, told)

    def _definition(self, node: Definition, scope: str, around: str) -> Iterator[Place]:
        first, more = described(node)
        name = f"{scope}{node.name}"
        if isinstance(node, ast.ClassDef):
            yield Place(self._path, node.lineno, name, first, more, around)
            yield from self.members(node, f"{name}.", first)
            return
        yield Place(self._path, node.lineno, name, first, f"{more} {self._inside(node)}", around)
        yield from self._texts(node.body[1:] if first else node.body, name)
        for part in node.body:
            yield from self._attribute(part, scope, around)

    def _attribute(self, node: ast.stmt, scope: str, around: str) -> Iterator[Place]:
        """An attribute that a constructor sets, if a comment tells of it."""
        if isinstance(node, ast.Assign | ast.AnnAssign) and (about := self._comment(node)):
            for target in _targets(node):
                if isinstance(target, ast.Attribute):
                    yield Place(self._path, node.lineno, f"{scope}{target.attr}", about, "", around)

    def _assigned(self, node: Assignment, scope: str, around: str, told: dict[str, str]) -> Iterator[Place]:
        """Constants named together, or a field, with the texts in them."""
        names = [target.id for target in _targets(node) if isinstance(target, ast.Name)]
        if not names:
            return
        strings = [" ".join(_strings(part)) for part in _parts(node)]
        about = self._comment(node) or " ".join(filter(None, (told.get(name, "") for name in names)))
        if scope and isinstance(node, ast.AnnAssign) and (metadata := " ".join(_strings(node.annotation))):
            about = f"{metadata}; {about}" if about else metadata
        name = ", ".join(f"{scope}{name}" for name in names)
        yield Place(self._path, node.lineno, name, about, " ".join(strings), around, _shown(node.value))
        if not scope:
            yield from self._texts([node], name)

    def _texts(self, nodes: list[ast.stmt], name: str) -> Iterator[Place]:
        """Texts of at least two words, such as those for the pilot."""
        for node in nodes:
            quotes = any('"' in line for line in self._lines[node.lineno - 1 : node.end_lineno])
            for line, text in _texts_in(node) if quotes else ():
                if TEXT.search(text):
                    yield Place(self._path, line, name, f'"{" ".join(text.split())}"', is_text=True)

    def _comment(self, node: Assignment) -> str:
        """The comments behind its lines, then those right above it, without those for tools."""
        own = self._lines[node.lineno - 1 : node.end_lineno]
        behind = " ".join(line.partition("  # ")[2] for line in own if "  # " in line and not FOR_TOOLS.search(line))
        above: list[str] = []
        for line in reversed(self._lines[: node.lineno - 1]):
            if not line.lstrip().startswith("# "):
                break
            above.insert(0, line.strip("# "))
        return "; ".join(filter(None, (behind, " ".join(above))))

    def _inside(self, node: Definition) -> str:
        """All comments in a function, and attributes that it uses."""
        lines = self._lines[node.lineno : node.end_lineno]
        comments = [line.partition("# ")[2] for line in lines if "# " in line]
        return " ".join([*comments, *USED.findall("\n".join(lines))])


def _targets(node: Assignment) -> Iterator[ast.expr]:
    for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
        yield from target.elts if isinstance(target, ast.Tuple) else [target]


def _parts(node: Assignment) -> list[ast.expr]:
    return [part for part in (getattr(node, "annotation", None), node.value) if part is not None]


def _strings(node: ast.expr) -> list[str]:
    return [it.value for it in ast.walk(node) if isinstance(it, ast.Constant) and isinstance(it.value, str)]


def _shown(value: ast.expr | None) -> str:
    """A value that is short enough to be shown."""
    if value is None or isinstance(value, ast.Call | ast.Lambda | ast.Dict | ast.ListComp | ast.DictComp):
        return ""
    text = ast.unparse(value)
    text = text[1:-1] if isinstance(value, ast.Tuple) else text
    return text if len(text) <= MOST_OF_A_VALUE else ""


def _texts_in(node: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and text of each string; what is put into one is shown as three dots."""
    children = ast.iter_child_nodes(node)
    if isinstance(node, ast.JoinedStr):
        children = (part.value for part in node.values if isinstance(part, ast.FormattedValue))
        yield node.lineno, "".join(str(it.value) if isinstance(it, ast.Constant) else "…" for it in node.values)
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.lineno, node.value
    for child in children:
        yield from _texts_in(child)


def _entries(docstring: str) -> Iterator[tuple[str, str]]:
    """Names and what a docstring's sections tell of them."""
    for names, text in ENTRY.findall(docstring):
        for name in names.split(", "):
            yield name, text
