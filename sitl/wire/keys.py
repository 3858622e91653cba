"""The vehicle's signing keys: from the command line, from the last run, and what is kept for the next."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Mapping
from pathlib import Path
from typing import Any

from protocol.errors import FileError
from protocol.keyring import KeyRecord, Keyring, Verdict
from protocol.signing import KEY_SIZE, MOST, NO_KEY, load_key
from protocol.whole_file import write_whole
from sitl.errors import SitlError
from sitl.memory import MemoryFaultError

__all__ = ["KeyFile", "RefusalReport", "is_loopback", "open_keyring", "read_key_option"]

LOOPBACK = "127.0.0.1"
EVERY = "*"  # in the file: the key of all links without their own
REPORT_EVERY = 30.0  # [s]


class KeyFile:
    """``signing.json`` of a state folder, readable by its owner alone; replaced whole, so a crash tears nothing."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "signing.json"

    def load(self) -> KeyRecord:
        """What the last run kept; nothing if there was none.

        Raises:
            MemoryFaultError: The file is there and cannot be understood.
        """
        if not self.path.exists():
            return KeyRecord()
        try:
            table: Any = json.loads(self.path.read_text(encoding="utf-8"))
            record = KeyRecord({_peer(name): bytes.fromhex(key) for name, key in table["keys"].items()}, table["time"])
            is_sound = all(len(key) == KEY_SIZE and key != NO_KEY for key in record.keys.values())
            is_sound = is_sound and type(record.timestamp) is int and 0 <= record.timestamp <= MOST
        except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            detail = getattr(error, "strerror", None) or "not a table of keys and a time"
            raise MemoryFaultError(f"{self.path}: {detail} (delete the file to start without a key)") from error
        if not is_sound:
            raise MemoryFaultError(f"{self.path}: a key or the time is out of range (delete the file to start without)")
        return record

    def save(self, record: KeyRecord) -> None:
        """Replace what is kept.

        Raises:
            MemoryFaultError: It cannot be written; the old file stays.
        """
        table = {"keys": {_name(peer): key.hex() for peer, key in record.keys.items()}, "time": record.timestamp}
        try:
            write_whole(self.path, json.dumps(table, indent=1).encode("ascii"), mode=0o600)
        except FileError as error:
            raise MemoryFaultError(f"signing key and time not kept: {error}") from error


def read_key_option(text: str) -> tuple[Hashable, bytes]:
    """``--signing-key``: a key or its file, behind ``PORT=`` for the peer on that local port alone.

    Raises:
        SitlError: It is no key.
    """
    port, separator, rest = text.partition("=")
    is_own = bool(separator) and port.isdecimal() and int(port) <= 65535
    try:
        return ((LOOPBACK, int(port)), load_key(rest)) if is_own else (None, load_key(text))
    except FileError as error:
        raise SitlError(str(error)) from error


def is_loopback(peer: Hashable) -> bool:
    """True for a UDP address that only programs of this machine can have."""
    return isinstance(peer, tuple) and bool(peer) and str(peer[0]).startswith("127.")


def open_keyring(file: KeyFile, given: Mapping[Hashable, bytes], *, timestamp: int, now: float) -> Keyring:
    """The keys ``given``, or else those that were kept; timestamps go on where the last run left them.

    Keys that are given are for this run: the file keeps its own, unless a peer changes them by SETUP_SIGNING.

    Args:
        file: Of the state folder.
        given: Keys of the command line, by peer; None for all others.
        timestamp: The wall clock [10 us since 2015].
        now: The link's steady clock at the same moment [s].

    Raises:
        MemoryFaultError: What was kept cannot be understood.
    """
    kept = file.load()

    def keep(record: KeyRecord) -> None:
        is_changed = dict(record.keys) != dict(given or kept.keys)
        file.save(record if is_changed else KeyRecord(kept.keys, record.timestamp))

    return Keyring(
        given or kept.keys, timestamp=timestamp, now=now, floor=kept.timestamp, is_private=is_loopback, keep=keep
    )


class RefusalReport:
    """Says how many frames were refused, seldom: a flood of them must not flood the operator."""

    def __init__(self, keyring: Keyring, say: Callable[[str], None]) -> None:
        self._keyring, self._say = keyring, say
        self._told, self._next = 0, float("-inf")

    def handle_timer(self, now: float) -> None:
        """Say it if there is something new and the last time is long enough ago."""
        refused = self._keyring.refused
        if refused == self._told or now < self._next:
            return
        self._told, self._next = refused, now + REPORT_EVERY
        counts = self._keyring.counts
        kinds = [verdict for verdict in Verdict if verdict.is_refused]
        self._say("Refused so far: " + ", ".join(f"{counts[kind]} {kind.value}" for kind in kinds if kind in counts))


def _name(peer: Hashable) -> str:
    return ":".join(map(str, peer)) if isinstance(peer, tuple) else EVERY


def _peer(name: str) -> Hashable:
    host, _, port = name.rpartition(":")
    return None if name == EVERY else (host, int(port))
