"""The pilot's own keys: ``darko/keys.toml`` in the user's configuration folder, a key by the name of each action."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from textual.binding import Binding, BindingType
from textual.keys import Keys

from protocol.errors import FileError
from protocol.tools.files import read_toml

MAX_KEYS_FILE = 1 << 16  # of the file
RESERVED = frozenset({"ctrl+c", "ctrl+q", "ctrl+p", "escape", "enter", "tab"})  # the ways out of everything
MODIFIERS = re.compile(r"^((ctrl|alt|shift)\+)*(?P<key>.+)$")
KEY_NAMES = frozenset(key.value for key in Keys)
CHARACTERS = {
    "?": "question_mark", "+": "plus", "-": "minus", "=": "equals_sign", "<": "less_than_sign", ">": "greater_than_sign"
}  # fmt: skip


class OwnKeys(NamedTuple):
    """Keys by binding, and what is wrong with the file, in words."""

    keys: Mapping[str, str] = {}
    problems: Sequence[str] = ()


def named_keys(screen: str, bindings: Iterable[BindingType]) -> list[BindingType]:
    """A screen's bindings with names for the file, "mission.move-up"; one that has a name keeps it."""
    return [
        replace(binding, id=f"{screen}.{re.sub(r'[^a-z0-9]+', '-', binding.description.lower()).strip('-')}")
        if isinstance(binding, Binding) and binding.description and not binding.id
        else binding
        for binding in bindings
    ]


def own_keys(path: Path, bindings: Iterable[Binding]) -> OwnKeys:
    """The keys of a file that can be used: a bad entry is told, the others are kept.

    Args:
        path: The file; none: no own keys.
        bindings: All that have a name.
    """
    try:
        content = read_toml(path, MAX_KEYS_FILE)
    except FileError as error:
        return OwnKeys(problems=(str(error),))
    present = {binding.id: binding.key for binding in bindings if binding.id}
    keys: dict[str, str] = {}
    problems = []
    for name, key in _entries(content):
        fault = _fault(name, key, present)
        if fault:
            problems.append(f"{name}: {fault}")
        else:
            keys[name] = CHARACTERS.get(key, key)
    for name, key in list(keys.items()):
        if other := _taken_by(name, key, present, keys):
            problems.append(f"{name}: {key} is the key of {other}")
            del keys[name]
    return OwnKeys(keys, (f"{path}: {'; '.join(problems)}",) if problems else ())


def _entries(content: Mapping[str, Any]) -> Iterable[tuple[str, Any]]:
    """Names and keys; those of a screen may stand in a table of their own."""
    for name, value in content.items():
        if isinstance(value, dict):
            yield from ((f"{name}.{inner}", key) for inner, key in value.items())
        else:
            yield name, value


def _fault(name: str, key: object, present: Mapping[str, str]) -> str:
    if name not in present:
        return "there is no such action"
    if not isinstance(key, str) or not key:
        return "its key is not a text"
    match = MODIFIERS.match(key)
    base = match["key"] if match else key
    if len(base) > 1 and base not in KEY_NAMES and base not in CHARACTERS.values():
        return f"there is no key {key!r}"
    return f"{key} keeps its meaning" if key in RESERVED else ""


def _taken_by(name: str, key: str, present: Mapping[str, str], own: Mapping[str, str]) -> str:
    """Another action of the same screen that has the key; empty if none has."""
    scope = name.rpartition(".")[0]
    for other, usual in present.items():
        if other != name and other.rpartition(".")[0] == scope and key in own.get(other, usual).split(","):
            return other
    return ""
