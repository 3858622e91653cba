"""Signing at the ground station: its keyring, the link's state, and our key for a vehicle that has none."""

from __future__ import annotations

import math
import time
from collections.abc import Hashable
from pathlib import Path

from platformdirs import user_data_path

from darko_gcs.errors import GroundError
from darko_gcs.state.values import SigningState
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.errors import FileError
from protocol.tools.files import write_atomically
from protocol.wire.message import Message, Source, source_of
from protocol.wire.signing import MAX_TIMESTAMP, Keyring, is_signed, load_key, timestamp_at

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


KEY_RETRY_TIME = 15.0  # between two keys sent [s]; a vehicle waits 10 s for a frame signed with a new key


class SigningClient:
    """Watches the signatures of one endpoint's vehicle.

    The owner of the link sets ``is_private``: True while the vehicle is reached over loopback, None before it is heard.

    Args:
        endpoint: The ground station's.
        give_key: Send our key to a vehicle that does not sign. Only over loopback: SETUP_SIGNING carries the key
            readable, and a signature hides nothing.
    """

    def __init__(self, endpoint: GroundEndpoint, *, give_key: bool = False) -> None:
        self.is_private: bool | None = None
        self._endpoint, self._give_key = endpoint, give_key
        self._vehicle_signs = False
        self._next_key = -math.inf  # when the key may be sent again [s]

    @property
    def state(self) -> SigningState:
        """The state to show to the operator."""
        if self._endpoint.keyring.is_on:
            return SigningState.SIGNED if self._unsigned_vehicle() is None else SigningState.UNSIGNED_VEHICLE
        if self._vehicle_signs:
            return SigningState.NO_KEY
        return SigningState.OPEN if self.is_private is False else SigningState.PRIVATE

    def receive(self, message: Message) -> None:
        """Take an accepted message."""
        if source_of(message) == self._endpoint.vehicle:
            self._vehicle_signs = is_signed(message.get_msgbuf())

    def handle_timer(self, now: float) -> str:
        """Send the key if wanted, needed and safe. Returns a text for the operator, or ""."""
        vehicle, key = self._unsigned_vehicle(), self._endpoint.keyring.key(None)
        if not self._give_key or vehicle is None or key is None or now < self._next_key:
            return ""
        self._next_key = now + KEY_RETRY_TIME
        if not self.is_private:
            return "Signing key NOT sent: others could read it on this link. Give it over loopback, or by hand"
        self._endpoint.send_key(key, self._endpoint.keyring.next_timestamp(), vehicle)
        return f"Signing key sent to {vehicle[0]}/{vehicle[1]} over loopback"

    def _unsigned_vehicle(self) -> Source | None:
        """A vehicle that does not sign as it should, unless a vehicle that does is present."""
        return None if self._endpoint.is_present else self._endpoint.unsigned_vehicle
