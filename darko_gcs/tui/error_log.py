"""Tracebacks of the station's own errors, in a file."""

from __future__ import annotations

import contextlib
import os
import traceback
from datetime import datetime
from pathlib import Path

MAX_ERRORS = 20  # of a session that are written: an error may come with every frame
MAX_TEXT = 200  # of an error that a line has room for [characters]


class ErrorLog:
    """Writes the traceback of each error once, all of a session into one file.

    Args:
        folder: Where the file is made with the first error.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known: set[str] = set()
        self.file: Path | None = None  # None until a traceback was written

    def add(self, error: BaseException, where: str) -> bool:
        """Write an error's traceback; False if the same error was written before, or too many others.

        Args:
            error: As it was raised.
            where: The part of the station that it happened in.
        """
        key = f"{where} {type(error).__name__} {error_place(error)}"
        if key in self._known or len(self._known) >= MAX_ERRORS:
            return False
        self._known.add(key)
        now = datetime.now().astimezone()
        path = self.file or self._folder / f"darko-gcs-{now:%Y%m%d-%H%M%S}-{os.getpid()}.txt"
        with contextlib.suppress(OSError):  # a disk that fails costs the traceback, nothing else
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("a", encoding="utf-8") as file:
                file.write(f"{now:%Y-%m-%d %H:%M:%S}  {where}\n{''.join(traceback.format_exception(error))}\n")
            self.file = path
        return True

    @property
    def words(self) -> str:
        """Path of the tracebacks, in words."""
        return f"{self._folder}: cannot be written" if self.file is None else f"traceback: {self.file}"


def error_words(error: BaseException) -> str:
    """An error in a line: "ZeroDivisionError: float division by zero (map_drawing.py:196)"."""
    text = " ".join(str(error).split())[:MAX_TEXT]
    return ": ".join(filter(None, (type(error).__name__, text))) + f" ({error_place(error)})"


def error_place(error: BaseException) -> str:
    """File and line that an error was raised in."""
    frames = traceback.extract_tb(error.__traceback__)
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "nowhere"
