"""The vehicle's signing keys: from the command line or from the last run, and stored for the next."""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any

from protocol.errors import FileError
from protocol.tools.files import write_atomically
from protocol.tools.option_values import is_loopback
from protocol.wire.signing import KEY_SIZE, MAX_TIMESTAMP, NO_KEY, KeyRecord, Keyring, load_key
from sitl.errors import SitlError
from sitl.tools.persistence import StateFolderError

__all__ = ["KeyFile", "open_keyring", "read_key_option"]

LOOPBACK = "127.0.0.1"
EVERY_LINK = "*"  # in the file: the key of all links without a key of their own


class KeyFile:
    """``signing.json`` of a state folder, readable only by its owner; it is replaced atomically."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "signing.json"

    def load(self) -> KeyRecord:
        """Keys and timestamp that the last run stored; no keys if there was none.

        Raises:
            StateFolderError: The file is damaged.
        """
        if not self.path.exists():
            return KeyRecord()
        try:
            table: Any = json.loads(self.path.read_text(encoding="utf-8"))
            record = KeyRecord({_peer(name): bytes.fromhex(key) for name, key in table["keys"].items()}, table["time"])
            is_sound = all(len(key) == KEY_SIZE and key != NO_KEY for key in record.keys.values())
            is_sound = is_sound and type(record.timestamp) is int and 0 <= record.timestamp <= MAX_TIMESTAMP
        except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            detail = getattr(error, "strerror", None) or "not a table of keys and a time"
            raise StateFolderError(f"{self.path}: {detail} (delete the file to start without a key)") from error
        if not is_sound:
            raise StateFolderError(f"{self.path}: a key or the time is out of range (delete the file to start without)")
        return record

    def save(self, record: KeyRecord) -> None:
        """Replace what is stored.

        Raises:
            StateFolderError: It cannot be written; the old file remains.
        """
        table = {"keys": {_name(peer): key.hex() for peer, key in record.keys.items()}, "time": record.timestamp}
        try:
            write_atomically(self.path, json.dumps(table, indent=1).encode("ascii"), mode=0o600)
        except FileError as error:
            raise StateFolderError(f"signing key and time not saved: {error}") from error


def read_key_option(text: str) -> tuple[Hashable, bytes]:
    """A key of ``--signing-key`` and whom it is for: None, or with ``PORT=`` only the peer on that local port.

    Raises:
        SitlError: It is neither a key nor a file with one.
    """
    port, separator, rest = text.partition("=")
    is_own = bool(separator) and port.isdecimal() and int(port) <= 65535
    try:
        return ((LOOPBACK, int(port)), load_key(rest)) if is_own else (None, load_key(text))
    except FileError as error:
        raise SitlError(str(error)) from error


def open_keyring(file: KeyFile, given: Mapping[Hashable, bytes], *, timestamp: int, now: float) -> Keyring:
    """The keys ``given``, or else the stored ones; timestamps continue those of the last run.

    Keys that are given are for this run only: the file keeps its own, unless a peer changes them by SETUP_SIGNING.

    Args:
        file: Of the state folder.
        given: Keys of the command line, by peer; None for all others.
        timestamp: The wall clock [10 us since 2015].
        now: The link's steady clock at the same moment [s].

    Raises:
        StateFolderError: The file is damaged.
    """
    stored = file.load()

    def save(record: KeyRecord) -> None:
        is_changed = dict(record.keys) != dict(given or stored.keys)
        file.save(record if is_changed else KeyRecord(stored.keys, record.timestamp))

    return Keyring(
        given or stored.keys, timestamp=timestamp, now=now, floor=stored.timestamp, is_private=is_loopback, keep=save
    )


def _name(peer: Hashable) -> str:
    return ":".join(map(str, peer)) if isinstance(peer, tuple) else EVERY_LINK


def _peer(name: str) -> Hashable:
    host, _, port = name.rpartition(":")
    return None if name == EVERY_LINK else (host, int(port))
