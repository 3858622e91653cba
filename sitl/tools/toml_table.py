"""Values of one table of a TOML file, checked, with one-line errors that say where."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from protocol.tools.files import decode_text
from sitl.errors import SitlError


def toml_content(path: Path, fault: type[SitlError]) -> dict[str, Any]:
    """Content of a TOML file.

    Args:
        path: The file.
        fault: The error that is raised.

    Raises:
        SitlError: It cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(decode_text(path.read_bytes()))
    except OSError as error:
        raise fault(f"{path}: cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeError) as error:
        raise fault(f"{path}: is not TOML: {error}") from None


class TomlTable:
    """One table.

    Args:
        file: What errors call the file.
        table: As it was read.
        where: The table's place in the file; empty for the file itself.
        known: The keys it may have.
        fault: The error that is raised.

    Raises:
        SitlError: It is no table, or has a key that is not known.
    """

    def __init__(
        self, file: str, table: object, where: str, known: set[str], fault: type[SitlError] = SitlError
    ) -> None:
        self._file, self._where, self._fault = file, where, fault
        if not isinstance(table, dict):
            raise fault(f"{file}: {where} must be a table")
        self._table: Mapping[str, Any] = table
        for key in table:
            if key not in known:
                near = get_close_matches(key, known, n=1)
                raise self.error(key, "is not known" + (f"; did you mean {near[0]!r}?" if near else ""))

    def error(self, key: str, what: str) -> SitlError:
        """The error of a wrong key, or of the table if the key is empty."""
        return self._fault(f"{self._file}: {'.'.join(filter(None, (self._where, key)))} {what}")

    def has(self, key: str) -> bool:
        """Whether a key is there."""
        return key in self._table

    def number(self, key: str, low: float, high: float, default: float | None = None) -> float:
        """A number within bounds."""
        if key not in self._table and default is not None:
            return default
        return self._checked(key, self._given(key), low, high)

    def numbers(self, key: str, count: int, low: float, high: float, default: tuple[float, ...] = ()) -> list[float]:
        """Several numbers within the same bounds."""
        if key not in self._table and default:
            return list(default)
        given = self._given(key)
        if not isinstance(given, list) or len(given) != count:
            raise self.error(key, f"= {given!r} must be {count} numbers in brackets")
        return [self._checked(key, value, low, high) for value in given]

    def lines(self, key: str, count: int) -> list[list[float]]:
        """Lines of so many numbers; none where the key is missing."""
        given = self._table.get(key, [])
        if not isinstance(given, list) or any(not isinstance(line, list) or len(line) != count for line in given):
            raise self.error(key, f"must be lines of {count} numbers in brackets")
        return [[self._checked(key, value, 0.0, 1e6) for value in line] for line in given]

    def text(self, key: str) -> str:
        """A text that is not empty."""
        given = self._given(key)
        if not isinstance(given, str) or not given.strip() or not given.isprintable():
            raise self.error(key, f"= {given!r} is not a name")
        return given

    def choice(self, key: str, allowed: Sequence[str]) -> str:
        """One of some words."""
        given = self._given(key)
        if given not in allowed:
            raise self.error(key, f"= {given!r} must be one of {', '.join(allowed)}")
        return str(given)

    def flag(self, key: str) -> bool:
        """True or false; false where the key is missing."""
        given = self._table.get(key, False)
        if not isinstance(given, bool):
            raise self.error(key, f"= {given!r} is neither true nor false")
        return given

    def tables(self, key: str) -> list[dict[str, Any]]:
        """A list of tables; none where the key is missing."""
        given = self._table.get(key, [])
        if not isinstance(given, list) or any(not isinstance(entry, dict) for entry in given):
            raise self.error(key, f"must be written [[{key}]]")
        return given

    def table(self, key: str) -> object:
        """Value of a key, unchecked."""
        return self._given(key)

    def _given(self, key: str) -> Any:  # noqa: ANN401 - whatever the file has
        if key not in self._table:
            raise self.error(key, "is missing")
        return self._table[key]

    def _checked(self, key: str, value: object, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.error(key, f"= {value!r} is not a finite number")
        if not low <= value <= high:
            raise self.error(key, f"= {value:g} is not within {low:g} and {high:g}")
        return float(value)
