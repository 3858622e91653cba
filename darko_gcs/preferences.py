"""What the operator prefers, kept between sessions in one small TOML file."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import NamedTuple

from platformdirs import user_config_path

from protocol.atomic_write import write_atomically
from protocol.errors import FileError

__all__ = ["Preferences", "PreferencesFile"]

MAX_PREFERENCES = 1 << 16  # of the file [byte]


class Preferences(NamedTuple):
    """The file's content; each field is one key of it."""

    favourite_parameters: frozenset[str] = frozenset()


class PreferencesFile:
    """The file, read once, when it is first asked for.

    Args:
        path: Of the file; by default ``darko/gcs.toml`` in the user's configuration folder.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.path = path or user_config_path("darko") / "gcs.toml"
        self._known: Preferences | None = None

    def load(self) -> Preferences:
        """What it holds; without a file, what holds by default.

        Raises:
            FileError: It cannot be read or has an error; the message says where.
        """
        if self._known is None:
            self._known = _parsed(self.path)
        return self._known

    def save(self, preferences: Preferences) -> None:
        """Keep them.

        Raises:
            FileError: The file cannot be written, or has an error: it is not overwritten then.
        """
        self.load()
        names = ", ".join(json.dumps(name) for name in sorted(preferences.favourite_parameters))
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"{self.path}: cannot be written: {error.strerror}") from error
        write_atomically(self.path, f"favourite_parameters = [{names}]\n".encode())
        self._known = preferences


def _parsed(path: Path) -> Preferences:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_PREFERENCES + 1)
    except FileNotFoundError:
        return Preferences()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    if len(data) > MAX_PREFERENCES:
        raise FileError(f"{path}: longer than {MAX_PREFERENCES} bytes")
    try:
        content = tomllib.loads(data.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise FileError(f"{path}: not TOML: {error}") from None
    for key in content:
        if key not in Preferences._fields:
            raise FileError(f"{path}: {key} is not known: there is {', '.join(Preferences._fields)}")
    names = content.get("favourite_parameters", [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise FileError(f"{path}: favourite_parameters is not a list of names")
    return Preferences(frozenset(names))
