"""Loading by content, saving by suffix and only ever whole."""

from __future__ import annotations

import os
from pathlib import Path

from protocol.errors import FileError
from protocol.plans import qgc_plan, qgc_wpl
from protocol.plans.plan import Plan

__all__ = ["load", "save"]

LARGEST = 16 * 1024 * 1024  # no plan is this long; a log given by mistake may be [bytes]
WRITERS = {".plan": qgc_plan.render, ".waypoints": qgc_wpl.render, ".txt": qgc_wpl.render}


def load(path: Path) -> Plan:
    """Read a plan file of either format.

    Raises:
        FileError: If it cannot be read or is not a plan; the message names the file, the place and the value.
    """
    try:
        if path.stat().st_size > LARGEST:
            raise FileError(f"{path}: too long for a plan")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: not a text file") from error
    if text.startswith(qgc_wpl.HEADER):
        return qgc_wpl.parse(text, str(path))
    if text.lstrip().startswith("{"):
        return qgc_plan.parse(text, str(path))
    raise FileError(f"{path}: neither a .plan (JSON) nor a '{qgc_wpl.HEADER} ...' file")


def save(plan: Plan, path: Path) -> None:
    """Write a plan; the suffix chooses the format. An old file stays until the new one is complete.

    Raises:
        FileError: If the suffix is unknown, the plan does not fit the format, or the file cannot be written.
    """
    writer = WRITERS.get(path.suffix)
    if writer is None:
        raise FileError(f"{path}: a plan is saved as {', '.join(WRITERS)}")
    text = writer(plan, str(path))
    staged = path.with_name(f".{path.name}.new")
    try:
        with staged.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        staged.replace(path)
    except OSError as error:
        staged.unlink(missing_ok=True)
        raise FileError(f"{path}: {error.strerror}") from error
