"""``scripts/where.py WORD...``: files, classes and functions whose name or first line of description has every word.

It finds parts of words, in any case: ``scripts/where.py touch ground``.
"""

import argparse
import ast
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("sitl", "darko_gcs", "protocol", "scripts")
MOST = 40  # lines that a person still reads


class Place(NamedTuple):
    """A file (without a name), or a class or function in it."""

    path: str
    line: int
    name: str
    about: str

    def holds(self, words: list[str]) -> bool:
        """Whether path, name or description has every word."""
        text = f"{self.path} {self.name} {self.about}".lower()
        return all(word.lower() in text for word in words)


@cache
def places() -> tuple[Place, ...]:
    """All files, then what is public in them."""
    trees = {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
    }
    files = [Place(path, 1, "", first_line(tree)) for path, tree in trees.items()]
    parts = [
        Place(path, node.lineno, node.name, first_line(node))
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_")
    ]
    return (*files, *parts)


def first_line(node: ast.Module | ast.ClassDef | ast.FunctionDef) -> str:
    """First line of a docstring; empty without one."""
    return (ast.get_docstring(node) or "").partition("\n")[0]


def main(arguments: list[str] | None = None) -> int:
    """Print what is found; exit code 1 if nothing is."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("words", nargs="+", metavar="WORD")
    words = parser.parse_args(arguments).words
    found = [place for place in places() if place.holds(words)]
    for place in found[:MOST]:
        print(f"{place.path}:{place.line}  {place.name}  {place.about}".replace("    ", "  "))
    if len(found) > MOST:
        print(f"and {len(found) - MOST} more: give another word")
    return 0 if found else 1


if __name__ == "__main__":
    sys.exit(main())
