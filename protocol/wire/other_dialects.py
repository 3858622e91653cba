"""Messages of other vehicles, by a dialect of pymavlink: frames that our own dialect does not know."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cached_property

from protocol.errors import LocalProtocolError
from protocol.wire.message import Message

PACKAGE = "pymavlink.dialects.v20"
EVERY_DIALECT = "all"


def dialect_names() -> tuple[str, ...]:
    """The dialects that pymavlink has."""
    return tuple(module.name for module in pkgutil.iter_modules(importlib.import_module(PACKAGE).__path__))


class OtherDialect:
    """A dialect, loaded by the first frame that needs it: ``all`` takes some tenths of a second.

    Args:
        name: Of pymavlink's.

    Raises:
        LocalProtocolError: Pymavlink has no such dialect.
    """

    def __init__(self, name: str = EVERY_DIALECT) -> None:
        if name not in (known := dialect_names()):
            raise LocalProtocolError(f"pymavlink has no dialect {name}; it has {', '.join(known)}")
        self.name = name

    def knows(self, number: int) -> bool:
        """Whether it has a message of this id."""
        return number in self._module.mavlink_map

    def decode(self, frame: bytes) -> Message | None:
        """The message of a frame; None if its checksum is wrong."""
        try:
            return self._decoder.decode(bytearray(frame))
        except self._module.MAVError:
            return None

    @cached_property
    def _module(self) -> Message:
        return importlib.import_module(f"{PACKAGE}.{self.name}")

    @cached_property
    def _decoder(self) -> Message:
        return self._module.MAVLink(None)
