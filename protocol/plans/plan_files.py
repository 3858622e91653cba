"""Loads and saves plan files: the content of a file tells its format, the suffix of a new one chooses it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from protocol.errors import FileError
from protocol.plans import qgc_plan, qgc_wpl
from protocol.plans.plan import Plan
from protocol.tools.files import decode_text, write_atomically

_MAX_FILE_SIZE = 16 * 1024 * 1024  # [bytes] no plan is this long, but a log given by mistake may be
_WRITERS = {".plan": qgc_plan.render, ".waypoints": qgc_wpl.render, ".txt": qgc_wpl.render}


def load(path: Path | str) -> Plan:
    """Read a plan file of either format.

    Raises:
        FileError: It cannot be read or is not a plan; the message names the file, the place and the value.
    """
    path = Path(path)
    text = _read(path)
    if text.startswith(qgc_wpl.HEADER):
        return replace(qgc_wpl.parse(text, str(path)), source=path)
    if text.lstrip().startswith("{"):
        return replace(qgc_plan.parse(text, str(path)), source=path)
    raise FileError(f"{path}: neither a .plan (JSON) nor a '{qgc_wpl.HEADER} ...' file")


def save(plan: Plan, path: Path | str) -> None:
    """Write a plan; the suffix chooses the format. An old file stays until the new one is complete.

    Raises:
        FileError: The suffix is unknown, the plan does not fit the format, or the file cannot be written.
    """
    path = Path(path)
    require_plan_suffix(path)
    write_atomically(path, _WRITERS[path.suffix](plan, str(path)).encode("utf-8"))


def require_plan_suffix(path: Path) -> None:
    """Check that a plan can have a name, before the work for it is done.

    Raises:
        FileError: The suffix names no format.
    """
    if path.suffix not in _WRITERS:
        raise FileError(f"{path}: the suffix of a plan is {', '.join(_WRITERS)}")


def _read(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(_MAX_FILE_SIZE + 1)  # a device reports no length
        if len(content) > _MAX_FILE_SIZE:
            raise FileError(f"{path}: too long for a plan")
        return decode_text(content)
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeError as error:
        raise FileError(f"{path}: not a text file: {error}") from error
