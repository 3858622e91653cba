"""MAVLink 2 signatures: keys, timestamps, and the 13 bytes behind a signed frame.

A signed frame has bit 0 of its incompatibility flags set and ends in a link id (1 byte), a timestamp (6 bytes, least
significant first, in units of 10 us since 2015-01-01 UTC) and the first 6 bytes of
SHA-256(key, header with its 0xFD, payload, checksum, link id, timestamp).
Specification: https://mavlink.io/en/guide/message_signing.html. ``protocol.wire.keyring`` decides which frames are
accepted.
"""

import hmac
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.tools.files import decode_text
from protocol.wire.framing import CHECKSUM_SIZE, HEADER_V2, MAGIC_V2, SIGNATURE_SIZE, SIGNED_FLAG, message_id

__all__ = [
    "KEY_SIZE",
    "MAX_TIMESTAMP",
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
NO_KEY = bytes(KEY_SIZE)  # in SETUP_SIGNING: signing ends
TICKS_PER_SECOND = 100_000  # of the timestamp
MAX_TIMESTAMP = (1 << 48) - 1  # greatest timestamp

_DIGEST_SIZE = 6  # [bytes] of the signature's 13
_EPOCH = 1_420_070_400  # 2015-01-01 UTC [s since 1970]
_MAX_KEY_FILE = 4096  # [bytes] a key file is small: any larger file was named by mistake


class Signature(NamedTuple):
    """Link id and timestamp at the end of a signed frame."""

    link: int  # 0..255, chosen by the sender
    timestamp: int  # [10 us since 2015]


def timestamp_at(unix_time: float) -> int:
    """Signing timestamp [10 us since 2015] of a time [s since 1970]; 0 before 2015."""
    return min(max(round((unix_time - _EPOCH) * TICKS_PER_SECOND), 0), MAX_TIMESTAMP)


def load_key(text: str) -> bytes:
    """The 32-byte key in ``text``: 64 hexadecimal digits, or the path of a key file.

    A key file holds the 64 digits, with optional white space around them, or the 32 bytes themselves.

    Raises:
        FileError: ``text`` is neither; the message is one line and never quotes a key.
    """
    digits = _hexadecimal(text)
    if digits is not None:
        return _checked_key(digits, "signing key")
    path = Path(text)
    try:
        with path.open("rb") as file:
            content = file.read(_MAX_KEY_FILE)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        shown = f"{text[:40]}..." if len(text) > 43 else text
        raise FileError(f"signing key: neither 64 hexadecimal digits nor a readable file: {shown}: {reason}") from error
    digits = content if len(content) == KEY_SIZE else _hexadecimal(_text(content))
    if digits is None:
        raise FileError(f"signing key: {path}: neither 64 hexadecimal digits nor 32 bytes")
    return _checked_key(digits, f"signing key: {path}")


def _text(content: bytes) -> str:
    try:
        return decode_text(content).strip()
    except UnicodeError:
        return ""


def is_signed(frame: bytes | bytearray) -> bool:
    """True for a version 2 frame that carries a signature, right or wrong."""
    return len(frame) > SIGNATURE_SIZE and frame[0] == MAGIC_V2 and bool(frame[2] & SIGNED_FLAG)


def is_secret(frame: bytes | bytearray) -> bool:
    """True for a frame with a key in it (SETUP_SIGNING): it must never be recorded or forwarded."""
    is_v2 = len(frame) >= HEADER_V2 and frame[0] == MAGIC_V2
    return is_v2 and message_id(frame) == mavlink.MAVLINK_MSG_ID_SETUP_SIGNING


def sign_frame(frame: bytes, key: bytes, signature: Signature) -> bytes:
    """The signed copy of an unsigned version 2 frame: flag set, checksum computed anew, signature appended.

    Raises:
        LocalProtocolError: The frame is not an unsigned version 2 frame of the dialect.
    """
    kind = mavlink.mavlink_map.get(message_id(frame))
    if frame[0] != MAGIC_V2 or frame[2] & SIGNED_FLAG or kind is None:
        raise LocalProtocolError("only unsigned MAVLink 2 frames of the dialect can be signed")
    signed = bytearray(frame[:-CHECKSUM_SIZE])
    signed[2] |= SIGNED_FLAG
    signed += mavlink.x25crc(signed[1:] + bytes([kind.crc_extra])).crc.to_bytes(CHECKSUM_SIZE, "little")
    signed += bytes([signature.link]) + signature.timestamp.to_bytes(6, "little")
    return bytes(signed + sha256(key + signed).digest()[:_DIGEST_SIZE])


def signature_of(frame: bytes | bytearray) -> Signature:
    """Link id and timestamp of a signed frame, as it claims them."""
    return Signature(frame[-SIGNATURE_SIZE], int.from_bytes(frame[-SIGNATURE_SIZE + 1 : -_DIGEST_SIZE], "little"))


def verify(frame: bytes | bytearray, key: bytes) -> bool:
    """True if the frame was signed with ``key``; its timestamp is not checked."""
    digest = sha256(key + frame[:-_DIGEST_SIZE]).digest()[:_DIGEST_SIZE]
    return hmac.compare_digest(digest, bytes(frame[-_DIGEST_SIZE:]))


def _hexadecimal(text: str) -> bytes | None:
    if len(text) != 2 * KEY_SIZE or not text.isascii():
        return None
    try:
        return bytes.fromhex(text)
    except ValueError:
        return None


def _checked_key(key: bytes, what: str) -> bytes:
    if key == NO_KEY or len(key) != KEY_SIZE:
        raise FileError(f"{what}: a key of zeros means that there is no key")
    return key
