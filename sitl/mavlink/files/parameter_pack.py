"""Parameters and plans as single files in ArduPilot's layouts, which MAVProxy's ``param ftp`` and ``wp ftp`` read.

With one file a client needs no request per parameter or item. All numbers are little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from itertools import takewhile

from protocol.dialect import mavlink
from protocol.engines.table_values import Parameter
from protocol.plans.plan import MissionItem

__all__ = ["pack_parameters", "pack_plan"]

PARAMETER_MAGIC, PARAMETER_MAGIC_WITH_DEFAULTS = 0x671B, 0x671C  # first word of a file
PLAN_MAGIC = 0x763D
HAS_DEFAULT = 0x10  # in the type of a parameter: its default follows its value
MAX_SHARED = 15  # characters in common with the name before, in four bits

_TYPES = {  # MAV_PARAM_TYPE -> number in the file, layout; the file has no unsigned types
    mavlink.MAV_PARAM_TYPE_INT8: (1, "b"),
    mavlink.MAV_PARAM_TYPE_UINT8: (2, "h"),
    mavlink.MAV_PARAM_TYPE_INT16: (2, "h"),
    mavlink.MAV_PARAM_TYPE_UINT16: (3, "i"),
    mavlink.MAV_PARAM_TYPE_INT32: (3, "i"),
    mavlink.MAV_PARAM_TYPE_REAL32: (4, "f"),
}


def pack_parameters(
    parameters: Sequence[Parameter], defaults: Mapping[str, float] | None = None, *, start: int = 0, count: int = 0
) -> bytes:
    """``@PARAM/param.pck``.

    Args:
        parameters: The table.
        defaults: Values by name; those that differ from the present values are written too.
        start: First parameter.
        count: How many; 0: all that follow.
    """
    chosen = sorted(parameters, key=lambda parameter: parameter.name)  # neighbours then share most of their names
    chosen = chosen[start : start + count] if count else chosen[start:]
    magic = PARAMETER_MAGIC if defaults is None else PARAMETER_MAGIC_WITH_DEFAULTS
    data, last = [struct.pack("<HHH", magic, len(chosen), len(parameters))], ""
    for parameter in chosen:
        kind, layout = _TYPES.get(parameter.type, _TYPES[mavlink.MAV_PARAM_TYPE_REAL32])
        default = (defaults or {}).get(parameter.name, parameter.value)
        values = [parameter.value] if default == parameter.value else [parameter.value, default]
        shared = min(_shared(last, parameter.name), MAX_SHARED, len(parameter.name) - 1)
        rest = parameter.name[shared:].encode("ascii")
        flags = HAS_DEFAULT if len(values) > 1 else 0
        data.append(bytes([kind | flags, shared | len(rest) - 1 << 4]) + rest)
        data.append(struct.pack(f"<{len(values)}{layout}", *(v if layout == "f" else int(v) for v in values)))
        last = parameter.name
    return b"".join(data)


def pack_plan(items: Iterable[MissionItem], mission_type: int) -> bytes:
    """``@MISSION/*.dat``: the payload of each MISSION_ITEM_INT, untrimmed."""
    payloads = [_payload(item, seq, mission_type) for seq, item in enumerate(items)]
    return struct.pack("<HHHHH", PLAN_MAGIC, mission_type, 0, 0, len(payloads)) + b"".join(payloads)


def _shared(one: str, other: str) -> int:
    """Number of leading characters that two names have in common."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False)))


def _payload(item: MissionItem, seq: int, mission_type: int) -> bytes:
    message = item.to_message(seq, 0, 0)
    message.mission_type = mission_type
    return bytes(message.unpacker.pack(*(getattr(message, name) for name in message.ordered_fieldnames)))
