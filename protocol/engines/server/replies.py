"""Texts and answers of several servers: STATUSTEXT, COMMAND_ACK, MISSION_ACK, PARAM_ERROR, DARKO_PLAN_FILE_ACK."""

from __future__ import annotations

from protocol.dialect import mavlink
from protocol.names import MAX_NAME_LENGTH
from protocol.wire.message import Message, Peer, target_fields


def command_ack(peer: Peer, command: int, result: int, *, progress: int = 0, detail: int = 0) -> Message:
    """A COMMAND_ACK with a MAV_RESULT; ``detail`` is result_param2."""
    return mavlink.MAVLink_command_ack_message(
        command=command, result=result, progress=progress, result_param2=detail, **target_fields(peer)
    )


def mission_ack(peer: Peer, result: int, kind: int, *, opaque_id: int = 0) -> Message:
    """A MISSION_ACK with a MAV_MISSION_RESULT for a plan of MAV_MISSION_TYPE ``kind``."""
    return mavlink.MAVLink_mission_ack_message(
        **target_fields(peer), type=result, mission_type=kind, opaque_id=opaque_id
    )


def param_error(peer: Peer, name: str, index: int, error: int) -> Message:
    """A PARAM_ERROR with a MAV_PARAM_ERROR, about a name or an index that the peer sent."""
    return mavlink.MAVLink_param_error_message(
        **target_fields(peer), param_id=raw_name(name), param_index=index, error=error
    )


def raw_name(name: str) -> bytes:
    """A received name as it is sent back."""
    return name.encode("ascii", errors="replace")[:MAX_NAME_LENGTH]


def plan_file_ack(peer: Peer, crc: int, offset: int, result: int, text: bytes = b"") -> Message:
    """A DARKO_PLAN_FILE_ACK with a MAV_RESULT, about a piece of the file with this checksum."""
    return mavlink.MAVLink_darko_plan_file_ack_message(
        **target_fields(peer), crc=crc, offset=offset, result=result, text=text[:200]
    )


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
