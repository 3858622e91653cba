"""The base of the dialect's messages.

``mavlink.py``, which ``scripts/build_dialect.py`` generates, has a class for each message, with its fields as
attributes and two methods that move all of them at once, to a payload and back.
"""

from __future__ import annotations

from struct import Struct
from typing import Any, ClassVar

_MAGIC_V1 = 0xFE  # first byte of a frame of version 1


class DialectMessage:
    """One message. Its names are pymavlink's, as far as they are needed, so that messages of either can be read.

    Attributes:
        id: Number of the message.
        msgname: Its name.
        fieldnames: Fields as the definition and the constructor list them; texts are kept up to their first zero.
        ordered_fieldnames: Fields as they are on the wire.
        fieldtypes: Types of ``fieldnames``.
        orders: For each of ``fieldnames`` where it is in ``ordered_fieldnames``.
        lengths: Values of each of ``ordered_fieldnames`` in the payload.
        array_lengths: Elements of each of ``ordered_fieldnames``; 0 for a single number.
        native_format: Types of ``ordered_fieldnames`` by struct's letters, behind the byte order.
        unpacker: The payload with its extensions, untrimmed.
        crc_extra: Of the definition; a frame's checksum covers it.
        WIRE: Low 16 and high 8 bits of ``id``, ``crc_extra``, size of the untrimmed payload: looked up at once.
    """

    id: int  # of the class; some messages have a field of this name, too
    msgname: ClassVar[str]
    fieldnames: ClassVar[list[str]]
    ordered_fieldnames: ClassVar[list[str]]
    fieldtypes: ClassVar[list[str]]
    fielddisplays_by_name: ClassVar[dict[str, str]]
    fieldenums_by_name: ClassVar[dict[str, str]]
    fieldunits_by_name: ClassVar[dict[str, str]]
    orders: ClassVar[list[int]]
    lengths: ClassVar[list[int]]
    array_lengths: ClassVar[list[int]]
    native_format: ClassVar[bytearray]
    unpacker: ClassVar[Struct]
    crc_extra: ClassVar[int]
    WIRE: ClassVar[tuple[int, int, bytes, int]]
    _msgbuf = b""
    _signed = False

    def __init_subclass__(cls) -> None:
        cls.WIRE = cls.id & 0xFFFF, cls.id >> 16, bytes((cls.crc_extra,)), cls.unpacker.size

    def pack_fields(self) -> bytes:
        """The untrimmed payload.

        Raises:
            struct.error, TypeError, OverflowError, AttributeError, IndexError: A field does not fit its type.
        """
        raise NotImplementedError

    def unpack_fields(self, data: bytes, at: int) -> None:
        """Set the fields by an untrimmed payload that begins at index ``at``."""
        raise NotImplementedError

    def get_type(self) -> str:
        """Name of the message."""
        return self.msgname

    def get_msgId(self) -> int:
        """Number of the message; a field may have the name ``id``."""
        return type(self).id

    def get_fieldnames(self) -> list[str]:
        """Names of the fields."""
        return self.fieldnames

    def get_msgbuf(self) -> bytes:
        """The frame that it was decoded from; empty if it was made here."""
        return self._msgbuf

    def get_signed(self) -> bool:
        """True if it came in a correctly signed frame."""
        return self._signed

    def get_seq(self) -> int:
        """Sequence number of its frame; 0 without one, as the following."""
        return self._header_byte(4, 2)

    def get_srcSystem(self) -> int:
        """System that sent it."""
        return self._header_byte(5, 3)

    def get_srcComponent(self) -> int:
        """Component that sent it."""
        return self._header_byte(6, 4)

    def to_dict(self) -> dict[str, Any]:
        """Its name as ``mavpackettype``, and its fields."""
        return {"mavpackettype": self.msgname} | {name: getattr(self, name) for name in self.fieldnames}

    def __str__(self) -> str:
        return f"{self.msgname} {{{', '.join(f'{name} : {getattr(self, name)}' for name in self.fieldnames)}}}"

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._msgbuf == other._msgbuf and self.to_dict() == other.to_dict()

    __hash__ = None  # type: ignore[assignment]  # its fields may change

    def _header_byte(self, at: int, at_v1: int) -> int:
        frame = self._msgbuf
        return frame[at_v1 if frame[0] == _MAGIC_V1 else at] if frame else 0
