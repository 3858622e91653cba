"""Output of a command for a program: one JSON object, on success and on failure.

``{"ok": true, ...}``, or ``{"ok": false, "command": ..., "error": ..., "exit_code": ...}`` with what else is known of
the failure: the vehicle's words, the item, what was waited for.
"""

from __future__ import annotations

import io
import json
import math
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from typing import Any

__all__ = [
    "PrintedLines",
    "asks_for_json",
    "failure_of",
    "json_values",
    "print_json",
    "printed_lines",
]


def json_values(value: Any) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """The value with null for NaN and infinity, which JSON does not have, at any depth; tuples become lists."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: json_values(inner) for key, inner in value.items()}
    return [json_values(inner) for inner in value] if isinstance(value, list | tuple) else value


OPTION = "--json"
_ITEM = re.compile(r"\bitem (\d+)\b|\bitems\[(\d+)\]")
_PARAMETER = re.compile(r"\bparam(?:eter)? ?([1-7])\b")
_RANGE = re.compile(r"\bfrom (-?[\d.]+(?:e[-+]?\d+)?) to (-?[\d.]+(?:e[-+]?\d+)?)(?: ([^\s()]+))?(?: \(|$)")


def asks_for_json(arguments: list[str]) -> bool:
    """Whether ``--json``, or what argparse takes for it, is among the arguments."""
    before = arguments[: arguments.index("--")] if "--" in arguments else arguments
    return any(text.startswith("--j") and OPTION.startswith(text.partition("=")[0]) for text in before)


def print_json(result: Mapping[str, Any], indent: int | None = None) -> None:
    """Print a result on stdout; what JSON does not have is null."""
    print(json.dumps(json_values(dict(result)), indent=indent), flush=True)


def failure_of(error: BaseException, command: str, code: int) -> dict[str, Any]:
    """A failed command's result.

    Args:
        error: What happened; its attribute ``details``, if it has one, tells more by name.
        command: What was asked for.
        code: The exit code.
    """
    text = str(error) or type(error).__name__
    told: dict[str, Any] = {"ok": False, "command": command, "error": text, "exit_code": code}
    if item := _ITEM.search(text):
        told |= {"item": int(item[1] or item[2]), **_about_item(text, item.end())}
    return told | dict(getattr(error, "details", {}))


def _about_item(text: str, begin: int) -> dict[str, Any]:
    """The number of an item's parameter, and its range, that the words behind the item's number name."""
    told: dict[str, Any] = {}
    if parameter := _PARAMETER.search(text, begin):
        told["param"] = int(parameter[1])
    if found := _RANGE.search(text, begin):
        told["limit"] = {"min": float(found[1]), "max": float(found[2]), "unit": found[3] or ""}
    return told


class PrintedLines(io.TextIOBase):
    """Takes what is printed: to stderr, where people read it, and as lines."""

    def __init__(self) -> None:
        self._text: list[str] = []

    def write(self, text: str) -> int:
        """Take a text."""
        self._text.append(text)
        return sys.stderr.write(text)

    def flush(self) -> None:
        """Show what was taken."""
        sys.stderr.flush()

    @property
    def lines(self) -> list[str]:
        """Lines printed so far."""
        return "".join(self._text).splitlines()


@contextmanager
def printed_lines() -> Iterator[PrintedLines]:
    """Keep texts of a command that has no JSON of its own off stdout."""
    taken = PrintedLines()
    with redirect_stdout(taken):
        yield taken
