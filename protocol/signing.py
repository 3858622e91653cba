"""MAVLink 2 signatures: keys, timestamps, and the 13 bytes behind a signed frame.

A signed frame has bit 0 of its incompatibility flags set and ends in a link id (1 byte), a timestamp (6 bytes, least
significant first, in units of 10 us since 2015-01-01 UTC) and the first 6 bytes of
SHA-256(key, header with its 0xFD, payload, checksum, link id, timestamp).
Specification: https://mavlink.io/en/guide/message_signing.html. Who is believed, and when, is ``protocol.keyring``.
"""

import hmac
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError

__all__ = [
    "KEY_SIZE",
    "MOST",
    "NO_KEY",
    "TICKS_PER_SECOND",
    "Signature",
    "is_secret",
    "is_signed",
    "load_key",
    "sign_frame",
    "signature_of",
    "timestamp_at",
    "verify",
]

KEY_SIZE = 32  # [bytes]
NO_KEY = bytes(KEY_SIZE)  # on the wire: signing is to end
TICKS_PER_SECOND = 100_000  # of the timestamp
MOST = (1 << 48) - 1  # greatest timestamp

_V2, _SIGNED = 0xFD, 0x01
_BLOCK, _DIGEST = 13, 6  # link id, timestamp and digest; the digest alone
_EPOCH = 1_420_070_400  # 2015-01-01 UTC [s since 1970]
_CRC = 2
_LARGEST_FILE = 4096  # a key file is small: anything else was not meant


class Signature(NamedTuple):
    """What stands behind a signed frame."""

    link: int  # 0..255, chosen by the sender
    timestamp: int  # [10 us since 2015]


def timestamp_at(unix_time: float) -> int:
    """Signing timestamp [10 us since 2015] of a time [s since 1970]; 0 before 2015."""
    return min(max(round((unix_time - _EPOCH) * TICKS_PER_SECOND), 0), MOST)


def load_key(text: str) -> bytes:
    """The 32-byte key that ``text`` is, as 64 hexadecimal digits, or that the file it names holds.

    A key file holds the 64 digits, with white space around them, or the 32 bytes as they are.

    Raises:
        FileError: It is neither; one line that never quotes a key.
    """
    digits = _hexadecimal(text)
    if digits is not None:
        return _useful(digits, "signing key")
    path = Path(text)
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST_FILE)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        shown = f"{text[:40]}..." if len(text) > 43 else text
        raise FileError(f"signing key: neither 64 hexadecimal digits nor a readable file: {shown}: {reason}") from error
    digits = _hexadecimal(content.decode("latin-1").strip())
    if digits is None and len(content) == KEY_SIZE:
        digits = content
    if digits is None:
        raise FileError(f"signing key: {path}: neither 64 hexadecimal digits nor 32 bytes")
    return _useful(digits, f"signing key: {path}")


def is_signed(frame: bytes | bytearray) -> bool:
    """True for a version 2 frame that carries a signature, right or wrong."""
    return len(frame) > _BLOCK and frame[0] == _V2 and bool(frame[2] & _SIGNED)


def is_secret(frame: bytes | bytearray) -> bool:
    """True for a frame with a key in it (SETUP_SIGNING): never to be recorded, nor forwarded."""
    return len(frame) > 9 and frame[0] == _V2 and int.from_bytes(frame[7:10], "little") == _SETUP


def sign_frame(frame: bytes, key: bytes, signature: Signature) -> bytes:
    """An unsigned version 2 frame of the dialect, signed: its flag set, its checksum anew.

    Raises:
        LocalProtocolError: The frame is no unsigned version 2 frame of the dialect.
    """
    kind = mavlink.mavlink_map.get(int.from_bytes(frame[7:10], "little"))
    if frame[0] != _V2 or frame[2] & _SIGNED or kind is None:
        raise LocalProtocolError("only unsigned MAVLink 2 frames of the dialect can be signed")
    signed = bytearray(frame[:-_CRC])
    signed[2] |= _SIGNED
    signed += mavlink.x25crc(signed[1:] + bytes([kind.crc_extra])).crc.to_bytes(_CRC, "little")
    signed += bytes([signature.link]) + signature.timestamp.to_bytes(6, "little")
    return bytes(signed + sha256(key + signed).digest()[:_DIGEST])


def signature_of(frame: bytes | bytearray) -> Signature:
    """Link id and timestamp of a signed frame, as it claims them."""
    return Signature(frame[-_BLOCK], int.from_bytes(frame[-_BLOCK + 1 : -_DIGEST], "little"))


def verify(frame: bytes | bytearray, key: bytes) -> bool:
    """True if the holder of ``key`` signed the frame; says nothing of its age."""
    digest = sha256(key + frame[:-_DIGEST]).digest()[:_DIGEST]
    return hmac.compare_digest(digest, bytes(frame[-_DIGEST:]))


_SETUP = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING


def _hexadecimal(text: str) -> bytes | None:
    if len(text) != 2 * KEY_SIZE or not text.isascii():
        return None
    try:
        return bytes.fromhex(text)
    except ValueError:
        return None


def _useful(key: bytes, what: str) -> bytes:
    if key == NO_KEY or len(key) != KEY_SIZE:
        raise FileError(f"{what}: a key of zeros stands for no key")
    return key
