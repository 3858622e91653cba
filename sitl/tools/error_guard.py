"""Keeps an error in one part of the vehicle's own code from ending the rest of it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from traceback import format_exception, walk_tb
from types import TracebackType
from typing import ClassVar

__all__ = ["ErrorGuard", "place_of", "traceback_of"]

OWN_CODE = tuple(str(Path(__file__).parents[2] / package) + os.sep for package in ("sitl", "protocol"))


class ErrorGuard:
    """``with guard:`` hands an error to ``report`` and goes on after the block; without ``report`` it is raised.

    Attributes:
        raises: Whether errors are raised whoever would report them: tests are to see each.
        report: Takes an error; it must not raise one itself.
    """

    raises: ClassVar[bool] = False

    def __init__(self) -> None:
        self.report: Callable[[Exception], None] | None = None

    def __enter__(self) -> None:
        """Nothing is to be prepared."""

    def __exit__(self, _kind: object, error: BaseException | None, _traceback: TracebackType | None) -> bool:
        """Report an error; an interrupt is none."""
        if not isinstance(error, Exception) or self.raises or self.report is None:
            return False
        self.report(error)
        return True


def place_of(error: Exception) -> str:
    """Place where an error was raised: function, file and line; of our own code, if it went through any."""
    frames = [(frame.f_code, line) for frame, line in walk_tb(error.__traceback__)]
    own = [(code, line) for code, line in frames if code.co_filename.startswith(OWN_CODE)]
    if not frames:
        return "an unknown place"
    code, line = (own or frames)[-1]
    return f"{code.co_qualname} ({Path(code.co_filename).name}:{line})"


def traceback_of(error: Exception) -> str:
    """The traceback of an error, as Python prints it."""
    return "".join(format_exception(error))
