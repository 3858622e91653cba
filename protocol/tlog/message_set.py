"""Messages that a log may hold: those of our dialect, and for logs of other autopilots those of pymavlink's ``all``.

The second set takes a tenth of a second to load: it is loaded when a log holds a message that the dialect has not.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.wire.message import Message
from protocol.wire.message_frames import read_frame


class MessageTable:
    """Messages by id, as arrays.

    Args:
        messages: Message classes by id.
    """

    def __init__(self, messages: dict[int, Message]) -> None:
        size = max(messages) + 2  # the last slot is that of all larger ids
        self._known = np.zeros(size, dtype=np.bool_)
        self._extra = np.zeros(size, dtype=np.uint8)
        for number, message in messages.items():
            self._known[number], self._extra[number] = True, message.crc_extra

    def knows(self, ids: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Whether each id is in the table, shape (n,)."""
        known: NDArray[np.bool_] = self._known[self._slots(ids)]
        return known

    def crc_extra(self, ids: NDArray[np.int32]) -> NDArray[np.uint8]:
        """CRC_EXTRA of each id that is in the table, shape (n,)."""
        extra: NDArray[np.uint8] = self._extra[self._slots(ids)]
        return extra

    def _slots(self, ids: NDArray[np.int32]) -> NDArray[np.int32]:
        return np.minimum(ids, len(self._known) - 1)


@cache
def dialect_table() -> MessageTable:
    """The messages of the dialect."""
    return MessageTable(mavlink.mavlink_map)


@cache
def whole_table() -> MessageTable:
    """The messages of the dialect, and those of other autopilots that it has not."""
    return MessageTable(_other_messages() | mavlink.mavlink_map)


def message_class(number: int) -> Message | None:
    """The class of a message id; None if it is not known."""
    return mavlink.mavlink_map.get(number) or _other_messages().get(number)


def message_name(number: int) -> str:
    """Name of a message id; unknown ones are called ``UNKNOWN_n``, as in pymavlink."""
    known = message_class(number)
    return str(known.msgname) if known is not None else f"UNKNOWN_{number}"


def message_named(name: str) -> Message:
    """The class of a message.

    Raises:
        LocalProtocolError: There is no such message.
    """
    known = _dialect_names().get(name) or _other_names().get(name)
    if known is None:
        raise LocalProtocolError(f"the dialect has no message {name!r}")
    return known


def decode(frame: bytes, number: int) -> Message:
    """The message of a frame whose checksum is right and whose id is known."""
    kind = mavlink.mavlink_map.get(number)
    return _other_decoder().decode(bytearray(frame)) if kind is None else read_frame(kind, frame)


@cache
def _other_decoder() -> Message:
    return _all_dialects().MAVLink(None)


@cache
def _other_messages() -> dict[int, Message]:
    return {n: known for n, known in _all_dialects().mavlink_map.items() if n not in mavlink.mavlink_map}


def _all_dialects() -> Message:
    from pymavlink.dialects.v20 import all as all_dialects  # noqa: PLC0415 - see above

    return all_dialects


@cache
def _dialect_names() -> dict[str, Message]:
    return {known.msgname: known for known in mavlink.mavlink_map.values()}


@cache
def _other_names() -> dict[str, Message]:
    return {known.msgname: known for known in _other_messages().values()}
