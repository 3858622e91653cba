"""Places in files that are not Python: tables of values, pages' scripts, styles, C, the dialect, shell scripts."""

import re
from collections.abc import Callable, Iterator
from pathlib import PurePath

from .place import MOST_OF_A_VALUE, Place

MARKS = "#/*!<-\"' \t>"  # of a comment
TABLE = re.compile(r"\[+([\w.-]+)\]+")
ENTRY = re.compile(r"([\w-]+) = (.+?)(?:\s+# (.*))?$")  # of a table
SCRIPT = re.compile(r"(?:export )?(?:async )?(?:function|class|const) (\w+)")
STYLE = re.compile(r"\s*([^{}/]+?)\s*\{(.*)")
C_PART = re.compile(r"(?:#define (\w+)|(?:[\w*]+ )+\*?(\w+)\(.*)")
TEST = re.compile(r"\s*(?:async )?def (\w+)")
ELEMENT = re.compile(r"\s*<(?:message|enum|entry) .*?name=\"(\w+)\"")


def first_words(lines: list[str]) -> str:
    """A file's first line that says something, without its comment marks."""
    said = (line.strip(MARKS) for line in lines if not line.startswith(("#!", "<?xml", "<!DOCTYPE")))
    return next(filter(None, said), "")


def above(lines: list[str], number: int) -> str:
    """The comment that ends right above a line."""
    found: list[str] = []
    for line in reversed(lines[: number - 1]):
        if not line.lstrip().startswith(("#", "//", "*", "/*")) or line.startswith("#define"):
            break
        found.insert(0, line.strip(MARKS))
    return " ".join(filter(None, found))


def values(path: str, lines: list[str]) -> Iterator[Place]:
    """Tables of TOML and what is in them; one that is a value with its unit and source is one place."""
    table, start = "", 0
    for number, line in enumerate(lines, 1):
        if named := TABLE.match(line):
            table, start = named[1], number
            if not lines[number : number + 1] or not lines[number].startswith("value = "):
                yield Place(path, number, table, above(lines, number))
        elif entry := ENTRY.match(line):
            about = "; ".join(filter(None, (entry[3], above(lines, number))))
            name = ".".join(filter(None, (table, entry[1])))
            if entry[1] == "value":
                yield Place(path, start, table, _unit_and_source(lines[number : number + 2]), value=entry[2])
            elif entry[1] not in {"unit", "source"}:
                yield Place(path, number, name, about, value=entry[2][:MOST_OF_A_VALUE])


def _unit_and_source(lines: list[str]) -> str:
    return " ".join(re.findall(r'^(?:unit|source) = "(.*)"', "\n".join(lines), re.MULTILINE))


def parts(pattern: re.Pattern[str]) -> Callable[[str, list[str]], Iterator[Place]]:
    """Reader of the lines that begin as a pattern says, with the comments above them.

    Args:
        pattern: Its first group that is there is a name.
    """

    def found(path: str, lines: list[str]) -> Iterator[Place]:
        for number, line in enumerate(lines, 1):
            if named := pattern.match(line):
                name = next(filter(None, named.groups()))
                yield Place(path, number, name, above(lines, number) or line.strip())

    return found


def styles(path: str, lines: list[str]) -> Iterator[Place]:
    """Rules of a style sheet."""
    for number, line in enumerate(lines, 1):
        if rule := STYLE.match(line):
            yield Place(path, number, rule[1], rule[2].strip(" }") or " ".join(_block(lines[number:])))


def _block(lines: list[str]) -> Iterator[str]:
    for line in lines:
        if "}" in line or "{" in line:
            return
        yield line.strip()


def dialect(path: str, lines: list[str]) -> Iterator[Place]:
    """Messages, enumerations and their entries."""
    for number, line in enumerate(lines, 1):
        if named := ELEMENT.match(line):
            said = re.search(r"<description>(.*?)(?:</description>|$)", " ".join(lines[number - 1 : number + 1]))
            yield Place(path, number, named[1], said[1] if said else "")


def _nothing(_path: str, _lines: list[str]) -> Iterator[Place]:
    return iter(())


READERS: dict[str, Callable[[str, list[str]], Iterator[Place]]] = {
    ".toml": values,
    ".js": parts(SCRIPT),
    ".css": styles,
    ".tcss": styles,
    ".c": parts(C_PART),
    ".h": parts(C_PART),
    ".xml": dialect,
    ".html": _nothing,
    ".sh": _nothing,
    ".py": parts(TEST),  # of tests alone
    "": _nothing,
}


def other_places(path: str, text: str) -> Iterator[Place]:
    """The file itself, then what is in it.

    Args:
        path: Of the file, from the root.
        text: What is in it.
    """
    lines = text.splitlines()
    yield Place(path, 1, "", first_words(lines))
    yield from READERS[PurePath(path).suffix](path, lines)
