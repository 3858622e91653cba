"""Files that the vehicle serves by MAVLink FTP: its parameters, the metadata of its component, its logs."""

from __future__ import annotations

import json
import lzma
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib.metadata import version
from itertools import takewhile
from typing import Any, NamedTuple
from urllib.parse import parse_qsl

from protocol.dialect import mavlink
from protocol.engines.file_transfer import BytesFile, Entry, File, LogStore, crc32
from protocol.engines.table_values import Parameter
from protocol.plans.plan import MissionItem
from sitl.vehicle.parameters import PARAMETERS, BoundParameter, Configuration

# Parameters and plans as single files in ArduPilot's layouts, which MAVProxy's ``param ftp`` and ``wp ftp`` read.
#
# With one file a client needs no request per parameter or item. All numbers are little-endian.

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


# Files that describe the vehicle to ground stations, which build their parameter pages from them.
#
# https://mavlink.io/en/services/component_metadata.html; the files conform to general.schema.json and
# parameter.schema.json of MAVLink's definitions.


FOLDER = "component_metadata"
GENERAL, PARAMETER = "general.json.xz", "parameter.json.xz"
GENERAL_URI = f"mftp:///{FOLDER}/{GENERAL}"
PARAMETER_METADATA = 1  # COMP_METADATA_TYPE_PARAMETER, newer than the generator's definitions


class ParameterPage(NamedTuple):
    """Group and page of a parameter in ground stations."""

    group: str
    category: str


PAGES = {  # by the field of Configuration
    "settings": ParameterPage("Flight", "Standard"),
    "tuning": ParameterPage("Hybrid controller", "Developer"),
    "world": ParameterPage("Simulated world", "Developer"),
}


@cache
def default_values() -> dict[str, float]:
    """The parameters of a vehicle with an empty state folder, by name."""
    return {name: parameter.value_in(Configuration()) for name, parameter in PARAMETERS.items()}


@cache
def metadata_files() -> dict[str, bytes]:
    """The files of ``FOLDER`` by name, each as JSON and compressed; the same on every start of one version."""
    parameters = _json({"version": 3, "parameters": [_described(parameter) for parameter in PARAMETERS.values()]})
    compressed = _compressed(parameters)
    general = _json(
        {
            "version": 1,
            "vendorName": "DarkO",
            "modelName": "DarkO tail-sitter (simulated)",
            "firmwareVersion": version("darko"),
            "metadataTypes": [
                {"type": PARAMETER_METADATA, "uri": f"mftp:///{FOLDER}/{PARAMETER}", "fileCrc": crc32(compressed)}
            ],
        }
    )
    plain = {GENERAL.removesuffix(".xz"): general, PARAMETER.removesuffix(".xz"): parameters}
    return plain | {GENERAL: _compressed(general), PARAMETER: compressed}


def general_crc() -> int:
    """Checksum of the general file, by which clients tell whether their copy is up to date."""
    return crc32(metadata_files()[GENERAL])


def _described(parameter: BoundParameter) -> dict[str, Any]:
    metadata, page = parameter.metadata, PAGES[parameter.group]
    units = {"units": metadata.unit} if metadata.unit else {}
    values = {"values": [{"value": number, "description": name} for number, name in metadata.values]}
    return {
        "name": metadata.name,
        "type": "Int32" if parameter.is_integer else "Float",
        "shortDesc": metadata.text,
        **units,
        **(values if metadata.values else {}),
        "min": metadata.bounds[0],
        "max": metadata.bounds[1],
        "default": default_values()[metadata.name],
        "group": page.group,
        "category": page.category,
    }


def _json(content: dict[str, Any]) -> bytes:
    return json.dumps(content, separators=(",", ":"), allow_nan=False).encode()


def _compressed(data: bytes) -> bytes:
    return lzma.compress(data, check=lzma.CHECK_CRC32)  # the only check that small decoders know


# The files on offer over MAVLink FTP. They are not the disk's own tree: names are looked up, never joined to paths.
#
# ``@PARAM/param.pck``, ``@MISSION/{mission,fence,rally}.dat``, ``component_metadata/``, ``logs/``.


LOGS = "logs"
PLANS = {
    "mission.dat": mavlink.MAV_MISSION_TYPE_MISSION,
    "fence.dat": mavlink.MAV_MISSION_TYPE_FENCE,
    "rally.dat": mavlink.MAV_MISSION_TYPE_RALLY,
}

MakeContent = Callable[[Mapping[str, str]], bytes]  # from the query in a file's path


class VehicleFiles:
    """Files made from the vehicle's state when they are opened, and the logs of recorded flights.

    Args:
        parameters: Gives the parameter table with its present values.
        plan: Gives the items of a MAV_MISSION_TYPE.
        logs: The logs.
    """

    def __init__(
        self,
        parameters: Callable[[], Sequence[Parameter]],
        plan: Callable[[int], Sequence[MissionItem]],
        logs: LogStore,
    ) -> None:
        self._parameters, self._plan, self._logs = parameters, plan, logs
        self._made: dict[str, dict[str, MakeContent]] = {
            "@PARAM": {"param.pck": self._pack_parameters},
            "@MISSION": {name: self._plan_maker(kind) for name, kind in PLANS.items()},
            FOLDER: {name: _constant(data) for name, data in metadata_files().items()},
        }

    def entries(self, path: str) -> Sequence[Entry]:
        """The content of a folder.

        Raises:
            OSError: There is no such folder.
        """
        parts, _ = _split(path)
        if not parts:
            return [Entry(name, None) for name in (*self._made, LOGS)]
        folder, *rest = parts
        if not rest and folder == LOGS:
            return [Entry(log.name, log.size) for log in self._logs.logs()]
        if not rest and folder in self._made:
            return [Entry(name, len(make({}))) for name, make in self._made[folder].items()]
        self._require_no_file(parts)
        raise FileNotFoundError(path)

    def open(self, path: str) -> File:
        """A file as it is now.

        Raises:
            OSError: There is no such file.
        """
        parts, query = _split(path)
        if not parts or parts in ([LOGS], *([folder] for folder in self._made)):
            raise IsADirectoryError(path)
        if len(parts) == 2 and parts[0] == LOGS:
            return self._logs.open(parts[1])
        make = self._made.get(parts[0], {}).get(parts[1]) if len(parts) == 2 else None
        if make is None:
            raise FileNotFoundError(path)
        return BytesFile(make(query))

    def _require_no_file(self, parts: list[str]) -> None:
        """Raise NotADirectoryError if a path names a file, to tell it from a path that names nothing."""
        folder, name = parts[0], parts[1] if len(parts) == 2 else ""
        if name in self._made.get(folder, {}) or (folder == LOGS and name in {log.name for log in self._logs.logs()}):
            raise NotADirectoryError(name)

    def _pack_parameters(self, query: Mapping[str, str]) -> bytes:
        defaults = default_values() if query.get("withdefaults") == "1" else None
        return pack_parameters(
            self._parameters(), defaults, start=_count(query.get("start")), count=_count(query.get("count"))
        )

    def _plan_maker(self, kind: int) -> MakeContent:
        return lambda _query: pack_plan(self._plan(kind), kind)


def _constant(data: bytes) -> MakeContent:
    return lambda _query: data


def _split(path: str) -> tuple[list[str], dict[str, str]]:
    """Names and query of a path, with or without a leading slash."""
    names, _, query = path.partition("?")
    return [name for name in names.split("/") if name not in {"", "."}], dict(parse_qsl(query))


def _count(text: str | None) -> int:
    return int(text) if text is not None and text.isdecimal() else 0
