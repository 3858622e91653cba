"""``scripts/where.py WORD...``: files, classes, functions and constants whose name or description has every word.

It finds parts of words, in any case: ``scripts/where.py touch ground``. What a first line says comes first. Where
nothing has every word, places that have most of them are shown. Tables of values (TOML) and scripts of pages are found
by their names and first lines, values by their keys.
"""

import argparse
import ast
import os
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("sitl", "darko_gcs", "protocol", "scripts")
GENERATED = {ROOT / "protocol/dialect/mavlink.py", ROOT / "protocol/dialect/vocabulary.py"}
MOST = 40  # lines that a person still reads
NAMED = re.compile(r"\[+([\w.-]+)\]|(?:export )?(?:function|class|const) (\w+)")  # a table of TOML; of JavaScript


class Place(NamedTuple):
    """A file (without a name), or a class, function or constant in it."""

    path: str
    line: int
    name: str
    about: str  # its description's first line
    more: str = ""  # the rest of that

    def holds(self, words: list[str], *, whole: bool) -> bool:
        """Whether path, name and first line, or the whole description, have every word."""
        text = f"{self.path} {self.name} {self.about} {self.more if whole else ''}".lower()
        return all(word.lower() in text for word in words)


@cache
def places() -> tuple[Place, ...]:
    """All files but generated ones, then what is in them."""
    files: list[Place] = []
    parts: list[Place] = []
    for package in PACKAGES:
        for file in sorted({*(ROOT / package).rglob("*.py")} - GENERATED):
            path, text = file.relative_to(ROOT).as_posix(), file.read_text(encoding="utf-8")
            tree = ast.parse(text)
            files.append(Place(path, 1, "", *described(tree)))
            parts += definitions(path, tree)
            parts += constants(path, tree, text.splitlines())
    return (*files, *parts, *other_files())


def other_files() -> Iterator[Place]:
    """Tables of values with their keys, and scripts of pages with their functions and classes."""
    for package in PACKAGES:
        for file in sorted({*(ROOT / package).rglob("*.toml"), *(ROOT / package).rglob("*.js")}):
            if file.suffix == ".js" and file.name.endswith(".min.js"):
                continue
            path, lines = file.relative_to(ROOT).as_posix(), file.read_text(encoding="utf-8").splitlines()
            yield Place(path, 1, "", (lines or [""])[0].lstrip("#/* "))
            for number, line in enumerate(lines, 1):
                if named := NAMED.match(line):
                    yield Place(path, number, named[1] or named[2], line.strip())


def described(node: ast.Module | ast.ClassDef | ast.FunctionDef) -> tuple[str, str]:
    """A docstring's first line, and the rest; empty without one."""
    first, _, more = (ast.get_docstring(node) or "").partition("\n")
    return first, more


def definitions(path: str, tree: ast.Module) -> Iterator[Place]:
    """Classes and functions of a file, methods among them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield Place(path, node.lineno, node.name, *described(node))


def constants(path: str, tree: ast.Module, lines: list[str]) -> Iterator[Place]:
    """Constants of a file, described by the comment behind them."""
    for node in tree.body:
        target = node.targets[0] if isinstance(node, ast.Assign) else None
        if isinstance(target, ast.Name) and target.id.isupper():
            yield Place(path, node.lineno, target.id, lines[node.lineno - 1].partition("  # ")[2])


def holding(words: list[str]) -> list[Place]:
    """Places with every word, those whose first line has them first."""
    found = [place for place in places() if place.holds(words, whole=False)]
    return found + [place for place in places() if place.holds(words, whole=True) and place not in found]


def main(arguments: list[str] | None = None) -> int:
    """Print what is found; exit code 1 if nothing is."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("words", nargs="+", metavar="WORD")
    words = parser.parse_args(arguments).words
    found = holding(words)
    if not found and len(words) > 1:
        fewer = [holding([*words[:k], *words[k + 1 :]]) for k in range(len(words))]
        found = list(dict.fromkeys(place for some in fewer for place in some))
        print("nothing has every word, these have all but one:" if found else "nothing has all but one of these words")
    lines = [f"{place.path}:{place.line}  {place.name or '(file)'}  {place.about}" for place in found[:MOST]]
    lines += [f"and {len(found) - MOST} more: give another word"] if len(found) > MOST else []
    print("\n".join(lines), end="\n" if lines else "")
    return 0 if found else 1


if __name__ == "__main__":
    try:
        code = main()
        sys.stdout.flush()
    except BrokenPipeError:  # the reader, such as `head`, has enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    sys.exit(code)
