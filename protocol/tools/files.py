"""Files: text with any byte-order mark, writing that leaves a whole file or none, JSON whose errors name the place."""

from __future__ import annotations

import codecs
import json
import math
import os
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from protocol.errors import FileError

_WIDE = (  # the longer marks first: that of UTF-16 begins that of UTF-32
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def wide_encoding(data: bytes) -> str | None:
    """The encoding that a byte order mark at the beginning names, if it is not UTF-8's."""
    return next((name for mark, name in _WIDE if data.startswith(mark)), None)


def decode_text(data: bytes, errors: str = "strict") -> str:
    """The text, without its byte order mark.

    Args:
        data: The whole file.
        errors: As of ``bytes.decode``, for what is no UTF-8.

    Raises:
        UnicodeError: It is not a text in one of the encodings; the message names the line.
    """
    encoding = wide_encoding(data)
    if encoding is not None:
        try:
            return data.decode(encoding)
        except UnicodeDecodeError as error:
            raise UnicodeError(f"its byte order mark says {encoding.upper()}, but it is not: {error.reason}") from None
    if b"\0" in data:
        raise UnicodeError("it holds zero bytes: it is no text, or one in UTF-16 without a byte order mark")
    try:
        return data.decode("utf-8-sig", errors)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise UnicodeError(f"line {line}: byte {data[error.start]:#04x} is not UTF-8") from None


def read_toml(path: Path, most: int) -> dict[str, Any]:
    """Content of a TOML file of at most so many bytes; nothing if there is no file.

    Raises:
        FileError: It cannot be read, is longer, or is not TOML.
    """
    try:
        with path.open("rb") as opened:
            data = opened.read(most + 1)
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    if len(data) > most:
        raise FileError(f"{path}: longer than {most} bytes")
    try:
        return tomllib.loads(decode_text(data))
    except (tomllib.TOMLDecodeError, UnicodeError, RecursionError) as error:
        raise FileError(f"{path}: not TOML: {error}") from None


def write_atomically(path: Path, data: bytes, *, mode: int = 0o666) -> None:
    """Write a file; an old one stays until the new one is complete and on the disk.

    Args:
        path: The file.
        data: Its whole content.
        mode: Its permissions, less the process's umask.

    Raises:
        FileError: The file cannot be written; nothing is left behind.
    """
    staged = path.with_name(f".{path.name}.new")
    try:
        staged.unlink(missing_ok=True)  # a leftover of a crash may have other permissions
        with os.fdopen(os.open(staged, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        staged.replace(path)
    except OSError as error:
        with suppress(OSError):
            staged.unlink(missing_ok=True)
        raise FileError(f"{path}: cannot be written: {error.strerror}") from error


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
