"""A JSON object that knows its place in a file, so that every error message names the place."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from protocol.errors import FileError

__all__ = ["JsonTable"]


class JsonTable:
    """One object of a JSON document.

    Args:
        values: The parsed object.
        name: The file.
        path: Keys that lead to it, such as ``mission.items[3]``.

    Raises:
        FileError: It is not an object.
    """

    def __init__(self, values: object, name: str, path: str = "") -> None:
        self._name, self._path = name, path
        self.place = f"{name}: {path}" if path else name
        if not isinstance(values, dict):
            raise FileError(f"{self.place}: {_show(values)} is not an object")
        self.values: dict[str, Any] = values

    def error(self, key: str, what: str) -> FileError:
        """An error about one key."""
        return FileError(f"{self._name}: {self._join(key)}: {what}")

    def expect(self, key: str, wanted: str | int) -> None:
        """Refuse any other value of a key."""
        value = self.values.get(key)
        if isinstance(value, bool) or value != wanted:
            raise self.error(key, f"{_show(value)} where {wanted!r} was expected")

    def table(self, key: str, default: Mapping[str, Any] | None = None) -> JsonTable:
        """An object inside this one."""
        return JsonTable(self.values.get(key, default), self._name, self._join(key))

    def rows(self, key: str) -> list[Any]:
        """A list."""
        value = self.values.get(key)
        if not isinstance(value, list):
            raise self.error(key, f"{_show(value)} is not a list")
        return value

    def entry(self, key: str, index: int) -> JsonTable:
        """An object in a list."""
        return JsonTable(self.rows(key)[index], self._name, f"{self._join(key)}[{index}]")

    def made(self, values: Mapping[str, Any]) -> JsonTable:
        """An object that was made of this one: its errors name the place of this one."""
        return JsonTable(dict(values), self._name, self._path)

    def whole(self, key: str, default: int | None = None) -> int:
        """A number from 0 to 65535 without decimals."""
        value = self.values.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= 0xFFFF:
            raise self.error(key, f"{_show(value)} is not a whole number from 0 to 65535")
        return value

    def flag(self, key: str, *, default: bool) -> bool:
        """True or false, also as 1 and 0."""
        value = self.values.get(key, default)
        if value not in (True, False):
            raise self.error(key, f"{_show(value)} is neither true nor false")
        return bool(value)

    def number(self, key: str, default: float) -> float:
        """A finite number."""
        value = self._number(key, self.values.get(key, default))
        if math.isnan(value):
            raise self.error(key, "null is not a number")
        return value

    def numbers(self, key: str, count: int) -> list[float]:
        """A list of numbers; null is NaN."""
        values = self.rows(key)
        if len(values) != count:
            raise self.error(key, f"{len(values)} numbers where {count} were expected")
        return [self._number(f"{key}[{index}]", value) for index, value in enumerate(values)]

    def others(self, known: set[str]) -> dict[str, Any]:
        """The values of all other keys."""
        return {key: value for key, value in self.values.items() if key not in known}

    def _number(self, key: str, value: object) -> float:
        if value is None:
            return math.nan
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1e300:
            raise self.error(key, f"{_show(value)} is not a number")
        return float(value)

    def _join(self, key: str) -> str:
        return f"{self._path}.{key}" if self._path else key


def _show(value: object) -> str:
    """A value, shortened."""
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else "a list"
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
