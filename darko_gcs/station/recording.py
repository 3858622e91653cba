"""Opens the log that a flight is recorded in."""

from __future__ import annotations

from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from platformdirs import user_data_path

from darko_gcs.errors import GroundError
from protocol.errors import FileError
from protocol.tlog import TlogWriter


class Recording(TlogWriter):
    """A log in a file that is removed at the end if nothing was heard or sent."""

    path: Path | None = None

    def close(self) -> None:
        """Flush and close the file; remove it if it is empty.

        Raises:
            FileError: The file has just failed.
        """
        super().close()
        if self.path is not None and not self.written and not self.failed:
            with suppress(OSError):
                self.path.unlink()


def default_folder() -> Path:
    """The user's folder of recorded flights."""
    return user_data_path("darko") / "logs"


def start_recording(folder: Path) -> tuple[Recording, Path]:
    """A new log in a folder, named by its start time (UTC), and its path.

    Raises:
        GroundError: If the folder or the file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GroundError(f"cannot record in {folder}: {error.strerror}") from error
    stamp = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    path, count = folder / f"{stamp}.tlog", 1
    try:
        while not _created(path):
            count += 1
            path = folder / f"{stamp}-{count}.tlog"
        recording = Recording.open(path)
    except OSError as error:
        raise GroundError(f"{path}: cannot be written: {error.strerror}") from error
    except FileError as error:
        raise GroundError(str(error)) from error
    recording.path = path
    return recording, path


def _created(path: Path) -> bool:
    """Create a new file; false if it exists: a clock set back or a second ground station may give a name twice."""
    try:
        path.touch(exist_ok=False)
    except FileExistsError:
        return False
    return True
