"""One mission item, as it travels in MISSION_ITEM_INT (https://mavlink.io/en/services/mission.html)."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from protocol import units
from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.mav_frames import is_global_frame
from protocol.wire.message import Message

__all__ = ["MissionItem"]

_WIRE = struct.Struct("<HB5f2i?")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MissionItem:
    """One item of a plan; NaN means "default" and stays NaN.

    Two items are equal if their fields have the same bits on the wire (float32, NaN equal to the same NaN). ``current``
    marks where a vehicle is, not what the item is, so it is not compared.

    Raises:
        LocalProtocolError: A field does not fit its type on the wire.
    """

    command: int  # MAV_CMD
    frame: int  # MAV_FRAME
    params: tuple[float, float, float, float]
    x: int  # latitude [degE7] in global frames, x [1e-4 m] in local ones
    y: int  # longitude [degE7] in global frames, y [1e-4 m] in local ones
    z: float  # altitude [m] in global frames (up), z [m] in local ones (down)
    autocontinue: bool = True
    current: bool = False

    def __post_init__(self) -> None:
        if len(self.params) != 4:
            raise LocalProtocolError(f"a mission item has 4 params, not {len(self.params)}")
        try:
            self.wire_image()
        except (struct.error, OverflowError, TypeError) as error:
            raise LocalProtocolError(f"mission item {self} does not fit the wire: {error}") from error

    def __eq__(self, other: object) -> bool:
        return self.wire_image() == other.wire_image() if isinstance(other, MissionItem) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.wire_image())

    def wire_image(self) -> bytes:
        """The item's fields as bytes: float32 and the integers of the wire."""
        return _WIRE.pack(self.command, self.frame, *self.params, self.z, self.x, self.y, bool(self.autocontinue))

    def to_message(
        self, seq: int, target_system: int, target_component: int, *, current: bool | None = None, kind: int = 0
    ) -> Message:
        """MISSION_ITEM_INT number ``seq`` of a plan; ``kind`` is its MAV_MISSION_TYPE."""
        is_current = self.current if current is None else current
        param1, param2, param3, param4 = self.params
        return mavlink.MAVLink_mission_item_int_message(
            target_system=target_system,
            target_component=target_component,
            seq=seq,
            frame=self.frame,
            command=self.command,
            current=int(is_current),
            autocontinue=int(self.autocontinue),
            param1=param1,
            param2=param2,
            param3=param3,
            param4=param4,
            x=self.x,
            y=self.y,
            z=self.z,
            mission_type=kind,
        )

    @classmethod
    def from_message(cls, message: Message) -> MissionItem:
        """The item in a MISSION_ITEM_INT, or in the older MISSION_ITEM with its position in floats.

        Raises:
            LocalProtocolError: The floats of a MISSION_ITEM are not a position; the message names the parameter.
        """
        x, y = message.x, message.y
        if message.get_type() == "MISSION_ITEM":
            x, y = (_to_wire(message.frame, number, value) for number, value in ((5, x), (6, y)))
        return cls(
            command=message.command,
            frame=message.frame,
            params=(message.param1, message.param2, message.param3, message.param4),
            x=x,
            y=y,
            z=message.z,
            autocontinue=bool(message.autocontinue),
            current=bool(message.current),
        )


def _to_wire(frame: int, number: int, value: float) -> int:
    """A position's parameter of a MISSION_ITEM as a MISSION_ITEM_INT has it; NaN leaves it open."""
    if math.isnan(value):
        return units.UNKNOWN_INT32
    try:
        return units.to_e7(value) if is_global_frame(frame) else units.local_e4(value)
    except LocalProtocolError:
        raise LocalProtocolError(f"param{number} is {value:g}, which is no position") from None
