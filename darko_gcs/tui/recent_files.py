"""Files that were opened or saved lately, kept in the station's state folder."""

from __future__ import annotations

import contextlib
from pathlib import Path

from protocol.errors import FileError
from protocol.tools.files import write_atomically

MAX_FILES = 10


class RecentFiles:
    """Paths, newest first; those that are gone are left out.

    Args:
        file: Where they are kept, a path a line; None: only until the program ends.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._paths: list[str] | None = None if file is not None else []

    @property
    def paths(self) -> tuple[str, ...]:
        """The files that are there, newest first."""
        if self._paths is None:
            self._paths = self._read()
        return tuple(path for path in self._paths if Path(path).is_file())

    def add(self, path: Path | str) -> None:
        """Put a file first. A disk that fails costs the memory of it, nothing else."""
        newest = str(Path(path).expanduser().resolve())
        self._paths = [newest, *(other for other in self.paths if other != newest)][:MAX_FILES]
        if self._file is not None:
            with contextlib.suppress(FileError, OSError):
                self._file.parent.mkdir(parents=True, exist_ok=True)
                write_atomically(self._file, "\n".join(self._paths).encode())

    def _read(self) -> list[str]:
        try:
            text = self._file.read_text(encoding="utf-8") if self._file is not None else ""
        except (OSError, UnicodeDecodeError):
            return []
        return [line for line in text.splitlines() if line][:MAX_FILES]


def short_path(path: Path | str) -> str:
    """A path as short as it can be typed: below the working folder, or below the user's."""
    full = Path(path).expanduser().resolve()
    for folder, sign in ((Path.cwd(), ""), (Path.home(), "~/")):
        if full.is_relative_to(folder.resolve()):
            return f"{sign}{full.relative_to(folder.resolve())}"
    return str(full)
