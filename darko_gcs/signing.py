"""Signatures as the operator meets them: the state of the link in a word, and the key for a vehicle without one."""

from __future__ import annotations

import time
from collections.abc import Hashable
from enum import Enum
from pathlib import Path

from platformdirs import user_data_path

from darko_gcs.errors import GroundError
from protocol.codec import Message, Source, source_of
from protocol.endpoint import GroundEndpoint
from protocol.errors import FileError
from protocol.keyring import Keyring
from protocol.signing import MOST, load_key, timestamp_at
from protocol.whole_file import write_whole

__all__ = ["Signing", "SigningDesk", "TimeFile", "is_loopback", "open_keyring"]

SIGNED_FLAG = 0x01  # of a frame's incompatibility flags
_NO_TIME = "no signing time (delete the file to start without)"
GIVE_AGAIN = 15.0  # [s] a vehicle holds a key for 10 s until a frame signed with it arrives


class Signing(Enum):
    """What signatures say about the link."""

    PRIVATE = "unsigned, loopback"  # nobody else can reach it
    OPEN = "unsigned"
    SIGNED = "signed"
    NO_KEY = "signed by the vehicle, no key here"
    UNSIGNED_VEHICLE = "the vehicle does not sign with our key"


class SigningDesk:
    """Watches one endpoint.

    ``is_private`` is for the owner of the link to set: true while the vehicle is reached by loopback, None before.

    Args:
        endpoint: The ground station's.
        give: Whether a vehicle that does not sign is given our key, over loopback and no other link: SETUP_SIGNING
            carries it in clear, and a signature hides nothing.
    """

    def __init__(self, endpoint: GroundEndpoint, *, give: bool = False) -> None:
        self.is_private: bool | None = None
        self._endpoint, self._give = endpoint, give
        self._vehicle_signs = False
        self._next = float("-inf")

    @property
    def state(self) -> Signing:
        """What the operator is shown."""
        if self._endpoint.keyring.is_on:
            return Signing.SIGNED if self._unsigned_vehicle() is None else Signing.UNSIGNED_VEHICLE
        if self._vehicle_signs:
            return Signing.NO_KEY
        return Signing.OPEN if self.is_private is False else Signing.PRIVATE

    def receive(self, message: Message) -> None:
        """Take a message that is believed."""
        if source_of(message) == self._endpoint.vehicle:
            self._vehicle_signs = bool(message.get_header().incompat_flags & SIGNED_FLAG)

    def handle_timer(self, now: float) -> str:
        """Give the key where that is wanted, needed and safe; what the operator should know of it, or nothing."""
        vehicle, key = self._unsigned_vehicle(), self._endpoint.keyring.key(None)
        if not self._give or vehicle is None or key is None or now < self._next:
            return ""
        self._next = now + GIVE_AGAIN
        if not self.is_private:
            return "Signing key NOT sent: it would cross this link in clear. Give it over loopback, or by hand"
        self._endpoint.send_key(key, self._endpoint.keyring.next_timestamp(), vehicle)
        return f"Signing key sent to {vehicle[0]}/{vehicle[1]} over loopback"

    def _unsigned_vehicle(self) -> Source | None:
        """One that does not sign as it should; beside a vehicle that does, it is a stranger and nobody's concern."""
        return None if self._endpoint.is_present else self._endpoint.unsigned_vehicle


def is_loopback(host: str) -> bool:
    """True for an address that only this machine's own programs can have."""
    return host.startswith("127.") or host == "::1"


class TimeFile:
    """The timestamp up to which nothing is used or believed again, kept for the next start; no key is in it.

    Ground stations that run side by side share it: it only ever grows.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def load(self) -> int:
        """The timestamp [10 us since 2015]; 0 if none was kept.

        Raises:
            FileError: The file is there and holds none.
        """
        try:
            text = self.path.read_text(encoding="ascii").strip()
        except FileNotFoundError:
            return 0
        except (OSError, ValueError) as error:
            raise FileError(f"{self.path}: {getattr(error, 'strerror', None) or _NO_TIME}") from error
        if not text.isdecimal() or int(text) > MOST:
            raise FileError(f"{self.path}: {_NO_TIME}")
        return int(text)

    def save(self, timestamp: int) -> None:
        """Keep a timestamp, if it is later than what is kept.

        Raises:
            FileError: It cannot be written.
        """
        later = max(timestamp, self.load())
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"{self.path.parent}: cannot be made: {error.strerror}") from error
        write_whole(self.path, str(later).encode("ascii"))


def open_keyring(text: str | None, *, give: bool = False, kept: Path | None = None) -> Keyring:
    """The key of ``--signing-key``; without one nothing is signed. What was signed before now is not believed.

    Time goes on where the last ground station left it, should the wall clock have been set back since.

    Args:
        text: The key or its file.
        give: Whether it is to be given away.
        kept: Where the time of the last run is kept [the user's data folder].

    Raises:
        GroundError: It is no key, there is none to ``give``, or what was kept is no time.
    """
    if give and text is None:
        raise GroundError("--give-key needs --signing-key: there is no key to give")
    try:
        keys: dict[Hashable, bytes] = {} if text is None else {None: load_key(text)}
        file = TimeFile(kept or user_data_path("darko") / "gcs" / "signing-time")
        started = max(timestamp_at(time.time()), file.load() if keys else 0)
    except FileError as error:
        raise GroundError(str(error)) from error
    return Keyring(
        keys, timestamp=started, now=time.monotonic(), floor=started, keep=lambda record: file.save(record.timestamp)
    )
