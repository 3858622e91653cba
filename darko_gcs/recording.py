"""Where flights are recorded."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from platformdirs import user_data_path

from darko_gcs.errors import GroundError
from protocol.errors import FileError
from protocol.tlog import TlogWriter

__all__ = ["default_folder", "start_recording"]


def default_folder() -> Path:
    """The user's folder of recorded flights."""
    return user_data_path("darko") / "logs"


def start_recording(folder: Path) -> tuple[TlogWriter, Path]:
    """A new log in a folder, named by the time it began (UTC).

    Raises:
        GroundError: If the folder or the file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GroundError(f"recordings cannot be kept in {folder}: {error.strerror}") from error
    stamp = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    path, count = folder / f"{stamp}.tlog", 1
    while path.exists():
        count += 1
        path = folder / f"{stamp}-{count}.tlog"
    try:
        return TlogWriter.open(path), path
    except FileError as error:
        raise GroundError(str(error)) from error
