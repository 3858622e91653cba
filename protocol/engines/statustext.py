"""STATUSTEXT longer than one message (https://mavlink.io/en/messages/common.html#STATUSTEXT)."""

from protocol.codec import Message
from protocol.dialect import mavlink

__all__ = ["split_text"]

_CHUNK = 50  # bytes in one STATUSTEXT


def split_text(severity: int, text: str, number: int) -> list[Message]:
    """One message, or several with the id ``number`` (1..65535) that tells receivers to join them."""
    data = text.encode()
    chunks = [data[at : at + _CHUNK] for at in range(0, len(data), _CHUNK)] or [b""]
    if len(chunks[-1]) == _CHUNK and len(chunks) > 1:
        chunks.append(b"")  # a chunk that is not full ends the text
    number = number if len(chunks) > 1 else 0
    return [mavlink.MAVLink_statustext_message(severity, c, number, seq) for seq, c in enumerate(chunks)]
