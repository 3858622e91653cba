"""Splits a text into STATUSTEXT messages (https://mavlink.io/en/messages/common.html#STATUSTEXT)."""

from protocol.dialect import mavlink
from protocol.wire.message import Message

__all__ = ["split_text"]

_TEXT_SIZE = 50  # bytes in one STATUSTEXT


def split_text(severity: int, text: str, number: int) -> list[Message]:
    """One message, or several that share the id ``number`` (1..65535) so that receivers join them."""
    data = text.encode()
    chunks = [data[at : at + _TEXT_SIZE] for at in range(0, len(data), _TEXT_SIZE)] or [b""]
    if len(chunks[-1]) == _TEXT_SIZE and len(chunks) > 1:
        chunks.append(b"")  # a chunk that is not full ends the text
    number = number if len(chunks) > 1 else 0
    return [
        mavlink.MAVLink_statustext_message(severity=severity, text=chunk, id=number, chunk_seq=seq)
        for seq, chunk in enumerate(chunks)
    ]
