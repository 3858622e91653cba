"""The operator's preferences, kept between sessions in one small TOML file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

from platformdirs import user_config_path

from protocol.errors import FileError
from protocol.tools.files import read_toml, write_atomically

KEYS_FILE = "keys.toml"  # beside it: the pilot's own keys
FAULT_SHOWN_TIME = 20.0  # for which the screen tells what is wrong with the file [s]
MAX_PREFERENCES = 1 << 16  # of the file [byte]


class Preferences(NamedTuple):
    """The file's content; each field is one key of it."""

    favourite_parameters: frozenset[str] = frozenset()
    hidden_panels: frozenset[str] = frozenset()  # of the flight screen
    theme: str = ""  # of the colours; empty: the one it comes with


class PreferencesFile:
    """The file, read once, when it is first asked for.

    Args:
        path: Of the file; by default ``darko/gcs.toml`` in the user's configuration folder.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.path = path or user_config_path("darko") / "gcs.toml"
        self._known: Preferences | None = None

    def load(self) -> Preferences:
        """Preferences in the file; the defaults if there is no file.

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
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"{self.path}: cannot be written: {error.strerror}") from error
        lines = [f"{key} = {_toml(value)}\n" for key, value in preferences._asdict().items() if value]
        write_atomically(self.path, "".join(lines).encode())
        self._known = preferences


def _toml(value: frozenset[str] | str) -> str:
    """A value as TOML: JSON writes texts and lists of texts the same way."""
    return json.dumps(value if isinstance(value, str) else sorted(value), ensure_ascii=False)


def _parsed(path: Path) -> Preferences:
    content = read_toml(path, MAX_PREFERENCES)
    for key in content:
        if key not in Preferences._fields:
            raise FileError(f"{path}: {key} is not known: there is {', '.join(Preferences._fields)}")
    theme = content.get("theme", "")
    if not isinstance(theme, str):
        raise FileError(f"{path}: theme is not a name")
    favourites, hidden = (_names(path, content, key) for key in ("favourite_parameters", "hidden_panels"))
    return Preferences(favourites, hidden, theme)


def _names(path: Path, content: dict[str, Any], key: str) -> frozenset[str]:
    names = content.get(key, [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise FileError(f"{path}: {key} is not a list of names")
    return frozenset(names)
