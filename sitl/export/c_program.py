"""Everything that one export translates: functions as they are asked for, constants, and the modules they are of."""

from __future__ import annotations

import ast
import inspect
import math
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

from sitl.export.c_types import ArrayKind, ExportError, Kind, Types, comment, kind_of, wrapped_line

SOURCE = Path(__file__).parents[2]
Shape = tuple[int, ...] | ArrayKind  # of numbers, or of what the kind says
Place = tuple[str, ...]  # a variable, and the fields that lead to a part of it


class GeneratedText(NamedTuple):
    """A function that was generated: its text, and the kinds of its parameters, which it does not annotate."""

    text: str
    kinds: Mapping[str, Kind]


@dataclass(frozen=True)
class Text:
    """Source of a function."""

    tree: ast.FunctionDef
    file: str
    first_line: int  # of the tree's first, in the file
    lines: tuple[str, ...]


@dataclass
class Module:
    """The part of one Python module that is translated, in the order in which it is needed."""

    name: str
    stem: str
    constants: dict[str, str] = field(default_factory=dict)  # declarations by name in C
    functions: list[Instance] = field(default_factory=list)
    needs: dict[str, None] = field(default_factory=dict)  # other modules, by name


@dataclass
class Instance:
    """A function for arrays of certain shapes."""

    function: Callable[..., Any]
    module: Module
    c_name: str  # of the function, without the shapes
    shapes: tuple[Shape, ...]
    parameters: dict[str, Kind] = field(default_factory=dict)
    returns: Kind = None
    puts: set[Place] = field(default_factory=set)  # parts of its parameters that it writes to
    head: str = ""
    body: list[str] = field(default_factory=list)

    @property
    def token(self) -> str:
        """Stands for the name until it is known whether there are several shapes."""
        return f"\0{self.c_name}|{'_'.join(self.shape_names)}\0"

    @property
    def shape_names(self) -> list[str]:
        """The shapes as words."""
        shapes = (shape.shape if isinstance(shape, ArrayKind) else shape for shape in self.shapes)
        return ["x".join(map(str, shape)) for shape in shapes]

    def writes_to(self, name: str) -> bool:
        """Whether it changes what a parameter leads to."""
        return any(place[0] == name for place in self.puts)


class Program:
    """All that is translated.

    Args:
        types: Structs.
        generated: Generated functions by themselves.
        paths: Where a writer puts its value, by the writer: names of fields.
        constants: Other values for constants, by module and name, which have to be there.
    """

    def __init__(
        self,
        types: Types,
        generated: Mapping[Callable[..., Any], GeneratedText],
        paths: Callable[[Any], tuple[str, ...] | None],
        constants: Mapping[tuple[str, str], float],
    ) -> None:
        self.types = types
        self.paths = paths
        self.modules: dict[str, Module] = {}
        self._generated = generated
        self._constants = constants
        self._used_constants: set[tuple[str, str]] = set()
        self._instances: dict[tuple[Any, ...], Instance] = {}
        self._stems: dict[str, str] = {}

    def module(self, name: str) -> Module:
        """The module of a name.

        Raises:
            ExportError: If another one would get the same name in C.
        """
        if name not in self.modules:
            stem = name.rpartition(".")[2].strip("_")
            if self._stems.setdefault(stem, name) != name:
                raise ExportError(f"two modules are called {stem}: {self._stems[stem]} and {name}")
            self.modules[name] = Module(name, stem)
        return self.modules[name]

    def text(self, function: Callable[..., Any]) -> Text:
        """Source of a function.

        Raises:
            ExportError: If it has none.
        """
        if function in self._generated:
            text = self._generated[function].text
            return Text(_function_of(text), f"generated {function.__name__}", 1, tuple(text.splitlines()))
        try:
            lines, first = inspect.getsourcelines(function)
            file = inspect.getsourcefile(function) or "?"
        except (OSError, TypeError) as error:
            raise ExportError(f"{function!r} has no source to translate") from error
        path = Path(file)
        shown = str(path.relative_to(SOURCE)) if path.is_relative_to(SOURCE) else file
        return Text(_function_of(textwrap.dedent("".join(lines))), shown, first, tuple(lines))

    def instance(self, function: Callable[..., Any], shapes: tuple[Shape, ...] = ()) -> Instance:
        """A function's C for arrays of these shapes; translated where it is first asked for."""
        from sitl.export.c_functions import translate  # noqa: PLC0415 - the two need each other

        function = getattr(function, "py_func", function)
        key = (function, shapes)
        if key not in self._instances:
            module = self.module(function.__globals__.get("__name__", "") or "laws_in_force")
            made = Instance(function, module, self._name(function, module), shapes)
            self._instances[key] = made
            translate(self, made)
            module.functions.append(made)
        return self._instances[key]

    def _name(self, function: Callable[..., Any], module: Module) -> str:
        name = function.__name__
        own = name.lstrip("_")
        twin = own != name and own in function.__globals__
        return f"{module.stem}_{own}{'_' if twin else ''}"

    def hints(self, function: Callable[..., Any]) -> dict[str, Kind]:
        """Kinds of a function's parameters, and of ``return`` where that is told."""
        if function in self._generated:
            return dict(self._generated[function].kinds)
        return {name: self.types.resolved(kind_of(hint)) for name, hint in get_type_hints(function).items()}

    def constant(self, user: Module, function: Callable[..., Any], name: str, value: Any) -> str:  # noqa: ANN401
        """The C name of a module's constant, declared where it belongs.

        Args:
            user: The module that uses it.
            function: In which it is used.
            name: In Python.
            value: What it is.
        """
        home = self.module(_home(function.__globals__, name, user.name))
        self.need(user, home)
        return self.declare_constant(home, name, value)

    def declare_constant(self, home: Module, name: str, value: Any) -> str:  # noqa: ANN401
        """The C name of a constant of a module.

        Raises:
            ExportError: If it is no number.
        """
        c_name = f"{home.stem.upper()}_{name.lstrip('_')}"
        key = (home.name, name)
        if key in self._constants:
            self._used_constants.add(key)
            value = self._constants[key]
        if isinstance(value, int):
            home.constants[c_name] = f"enum {{ {c_name} = {int(value)} }};"
        elif isinstance(value, float) and math.isfinite(value):
            home.constants[c_name] = f"static const {self.types.real} {c_name} = {self.types.number(value)};"
        else:
            raise ExportError(f"{home.name}.{name} is no number: {value!r}")
        return c_name

    def need(self, user: Module, other: Module) -> None:
        """Note that a module uses another."""
        if other is not user:
            user.needs[other.name] = None

    def unused_constants(self) -> set[tuple[str, str]]:
        """Constants that were to be replaced and that nothing uses."""
        return set(self._constants) - self._used_constants

    def finished(self, text: str) -> str:
        """Text with the names of functions in place of what stands for them."""
        several: dict[str, int] = {}
        for made in self._instances.values():
            several[made.c_name] = several.get(made.c_name, 0) + 1
        for made in self._instances.values():
            if made.token in text:
                shapes = "".join(f"_{name}" for name in made.shape_names)
                text = text.replace(made.token, made.c_name + (shapes if several[made.c_name] > 1 else ""))
        return text

    def file_of(self, module: Module) -> str:
        """Text of the header that holds a module's functions."""
        guard = f"DARKO_{module.stem.upper()}_H"
        lines = list(_head_of(module))
        lines += [f"#ifndef {guard}", f"#define {guard}", "", "#include <math.h>", '#include "darko_types.h"']
        lines += [f'#include "{self.modules[name].stem}.h"' for name in sorted(module.needs)]
        lines += ["", *module.constants.values(), ""]
        for made in module.functions:
            lines += ["", *self._documented(made), f"{made.head} {{", *made.body, "}"]
        text = self.finished("\n".join([*lines, "", "#endif", ""]))
        return "\n".join(wrapped_line(line) for line in text.split("\n"))

    def _documented(self, made: Instance) -> list[str]:
        text = inspect.getdoc(made.function)
        if not text:
            return []
        first, *rest = comment(text).splitlines()
        return [f"/* {first} */"] if not rest else [f"/* {first}", *(f" * {line}".rstrip() for line in rest), " */"]


def _head_of(module: Module) -> Iterator[str]:
    """The comment at the head of a module's file: where it comes from, and what is said there."""
    python = sys.modules.get(module.name)
    if python is None:
        yield "/* Generated from the register of laws, the guards and the table of jumps. */"
        return
    yield f"/* Translated from {module.name.replace('.', '/')}.py: change that, not this."
    for line in comment(inspect.getdoc(python) or "").splitlines():
        yield f" * {line}".rstrip()
    yield " */"


def _function_of(text: str) -> ast.FunctionDef:
    (tree,) = ast.parse(text).body
    if not isinstance(tree, ast.FunctionDef):
        raise ExportError("it is no function")
    return tree


def _home(scope: Mapping[str, Any], name: str, user: str) -> str:
    """Name of the module that a name in a scope was imported from; that of the user where it is its own."""
    return _imports(str(scope.get("__name__", ""))).get(name, user)


@cache
def _imports(module_name: str) -> dict[str, str]:
    """Names that a module imports from others, and which those are."""
    module = sys.modules.get(module_name)
    if module is None:
        return {}
    found = {}
    for node in ast.parse(inspect.getsource(module)).body:
        if isinstance(node, ast.ImportFrom) and node.module:
            found.update({alias.asname or alias.name: node.module for alias in node.names})
    return found
