"""Opens the ground station's keyring: the key of ``--signing-key``, and the signing time saved by earlier runs."""

from __future__ import annotations

import time
from collections.abc import Hashable
from pathlib import Path

from platformdirs import user_data_path

from darko_gcs.errors import GroundError
from protocol.errors import FileError
from protocol.tools.files import write_atomically
from protocol.wire.signing import MAX_TIMESTAMP, Keyring, load_key, timestamp_at

_NO_TIME = "no signing time (delete the file to start without)"


class SigningTimeFile:
    """The last signing timestamp, saved for the next start: no earlier one is used or accepted again. Holds no key.

    Ground stations that run side by side share the file, so its timestamp only grows.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def load(self) -> int:
        """The timestamp [10 us since 2015]; 0 without a file.

        Raises:
            FileError: The file cannot be read, or holds no timestamp.
        """
        try:
            text = self.path.read_text(encoding="ascii").strip()
        except FileNotFoundError:
            return 0
        except (OSError, ValueError) as error:
            raise FileError(f"{self.path}: {getattr(error, 'strerror', None) or _NO_TIME}") from error
        if not text.isdecimal() or int(text) > MAX_TIMESTAMP:
            raise FileError(f"{self.path}: {_NO_TIME}")
        return int(text)

    def save(self, timestamp: int) -> None:
        """Save a timestamp [10 us since 2015], unless the file holds a later one.

        Raises:
            FileError: The file cannot be written.
        """
        later = max(timestamp, self.load())
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"{self.path.parent}: cannot be created: {error.strerror}") from error
        write_atomically(self.path, str(later).encode("ascii"))


def open_keyring(text: str | None, *, give_key: bool = False, time_file: Path | None = None) -> Keyring:
    """The keyring with the key of ``--signing-key``; without a key nothing is signed.

    Frames signed before this start are not accepted. The signing time continues from that of the last run, even if
    the wall clock was set back since.

    Args:
        text: The key, or the path of its file.
        give_key: True if the key is to be given to a vehicle.
        time_file: Where the signing time is saved [the user's data folder].

    Raises:
        GroundError: The text is no key, there is no key to give, or the saved time cannot be read.
    """
    if give_key and text is None:
        raise GroundError("--give-key needs --signing-key: there is no key to give")
    try:
        keys: dict[Hashable, bytes] = {} if text is None else {None: load_key(text)}
        file = SigningTimeFile(time_file or user_data_path("darko") / "gcs" / "signing-time")
        started = max(timestamp_at(time.time()), file.load() if keys else 0)
    except FileError as error:
        raise GroundError(str(error)) from error
    return Keyring(
        keys, timestamp=started, now=time.monotonic(), floor=started, keep=lambda record: file.save(record.timestamp)
    )
