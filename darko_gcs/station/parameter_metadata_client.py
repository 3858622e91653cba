"""Fetches the descriptions of a vehicle's parameters from the vehicle itself, over MAVFTP.

https://mavlink.io/en/services/component_metadata.html: COMPONENT_METADATA names the general file, which names the file
of the parameters. Both are JSON, perhaps compressed (.xz). Files that are not on the vehicle are not fetched.
"""

from __future__ import annotations

import json
import lzma
import math
from collections.abc import Mapping
from typing import Any

from darko_gcs.state.parameter_metadata import MAX_PARAMETERS, ParameterMetadata
from darko_gcs.state.text import printable
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.errors import FileError, LocalProtocolError
from protocol.events import Event, FileFailed, FileReceived
from protocol.wire.message import Message

METADATA_TYPE_PARAMETER = 1  # COMP_METADATA_TYPE_PARAMETER
VEHICLE_FILE = "mftp://"
WORD_BITS = 32  # of a mask
MAX_NAMED_VALUES = 256  # of one parameter; more are ignored
MAX_FILE_SIZE = 4_000_000  # of a file, unpacked [byte]
MAX_UNPACKING_MEMORY = 64_000_000  # [byte]


class ParameterMetadataClient:
    """Asks a vehicle once for the metadata of its parameters; ``known`` is empty until it has answered.

    Args:
        endpoint: The ground station's; hand in the vehicle's messages and the endpoint's events.
    """

    def __init__(self, endpoint: GroundEndpoint) -> None:
        self._endpoint = endpoint
        self._awaited_path = ""  # of the file under way
        self._is_asked = False
        self.known: Mapping[str, ParameterMetadata] = {}
        self.file = b""  # that they came from, as the vehicle sent it

    def request(self, now: float) -> None:
        """Begin, unless the answer is known or under way.

        Raises:
            LocalProtocolError: No vehicle has been found.
        """
        if not self._is_asked and not self.known:
            message = float(mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA)
            self._endpoint.command(mavlink.MAV_CMD_REQUEST_MESSAGE, message, now=now)
            self._is_asked = True

    def forget(self) -> None:
        """Start again: after a restart, the vehicle may run another program."""
        self._awaited_path, self._is_asked, self.known = "", False, {}

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the vehicle: COMPONENT_METADATA names the general file."""
        if message.get_type() == "COMPONENT_METADATA" and self._is_asked and not self._awaited_path and not self.known:
            self._read(_path_on_vehicle(message.uri), now)

    def follow(self, event: Event, now: float) -> str:
        """Take an event of the endpoint. Returns a text for the operator if something failed, else ""."""
        if isinstance(event, FileFailed | FileReceived) and event.path == self._awaited_path != "":
            self._awaited_path = ""
            if isinstance(event, FileFailed):
                return f"No parameter descriptions: {event.reason.lower()}"
            try:
                self._take(event, now)
            except FileError as error:
                return f"No parameter descriptions: {event.path}: {error}"
        return ""

    def _take(self, event: FileReceived, now: float) -> None:
        content = _json_object(event.data)
        if "metadataTypes" in content:
            self._read(parameter_file_path(content), now)
        else:
            self.known, self.file = parse_parameter_file(content), event.data

    def _read(self, path: str, now: float) -> None:
        if path:
            try:
                self._endpoint.read_file(path, now)
            except LocalProtocolError:
                return  # MAVFTP cannot ask for such a path
            self._awaited_path = path


def parameter_file_path(general: Mapping[str, Any]) -> str:
    """Path on the vehicle of its parameter file, from the general file; "" if that is not on the vehicle."""
    entries = general.get("metadataTypes")
    for entry in entries if isinstance(entries, list) else []:
        if isinstance(entry, dict) and entry.get("type") == METADATA_TYPE_PARAMETER:
            return _path_on_vehicle(entry.get("uri"))
    return ""


def read_parameter_file(data: bytes) -> dict[str, ParameterMetadata]:
    """Metadata by parameter name, from a file as a vehicle sends it.

    Raises:
        FileError: It is no such file.
    """
    return parse_parameter_file(_json_object(data))


def parse_parameter_file(content: Mapping[str, Any]) -> dict[str, ParameterMetadata]:
    """Metadata by parameter name; entries and fields that do not follow the schema are ignored.

    Raises:
        FileError: The file has no list of parameters.
    """
    listed = content.get("parameters")
    if not isinstance(listed, list):
        raise FileError("no list 'parameters'")
    named = (e for e in listed[:MAX_PARAMETERS] if isinstance(e, dict) and isinstance(e.get("name"), str))
    return {entry["name"]: _metadata(entry) for entry in named}


def _metadata(entry: Mapping[str, Any]) -> ParameterMetadata:
    return ParameterMetadata(
        text=_text(entry.get("shortDesc")),
        unit=_text(entry.get("units")),
        minimum=_number(entry.get("min")),
        maximum=_number(entry.get("max")),
        default=_number(entry.get("default")),
        is_integer=_text(entry.get("type")).lower().startswith(("int", "uint")),
        needs_reboot=entry.get("rebootRequired") is True,
        long_text=_text(entry.get("longDesc")),
        values=_named(entry.get("values"), "value"),
        bits=tuple((int(bit), name) for bit, name in _named(entry.get("bitmask"), "index") if bit in range(WORD_BITS)),
    )


def _named(rows: object, key: str) -> tuple[tuple[float, str], ...]:
    """Numbers with their names, from rows of ``key`` and "description"."""
    listed = [row for row in rows[:MAX_NAMED_VALUES] if isinstance(row, dict)] if isinstance(rows, list) else []
    found = ((_number(row.get(key)), _text(row.get("description"))) for row in listed)
    return tuple((number, name) for number, name in found if name and math.isfinite(number))


def _json_object(data: bytes) -> dict[str, Any]:
    """The JSON object in a file.

    Raises:
        FileError: The file is not JSON, not an object, or too long.
    """
    try:
        content = json.loads(_unpacked(data))
    except (lzma.LZMAError, ValueError, RecursionError) as error:
        raise FileError(f"not JSON: {error}") from error
    if not isinstance(content, dict):
        raise FileError("not a JSON object")
    return content


def _unpacked(data: bytes) -> bytes:
    if data[:1] != b"\xfd":  # first byte of .xz
        return data
    return lzma.LZMADecompressor(memlimit=MAX_UNPACKING_MEMORY).decompress(data, MAX_FILE_SIZE)


def _path_on_vehicle(uri: object) -> str:
    if not isinstance(uri, str) or not uri.startswith(VEHICLE_FILE):
        return ""
    path = uri.removeprefix(VEHICLE_FILE)
    return path.partition("]")[2] if "[;" in uri else path  # "[;comp=1]" names the component


def _text(value: object) -> str:
    return printable(value) if isinstance(value, str) else ""


def _number(value: object) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return math.nan
    try:
        return float(value)
    except OverflowError:  # integers in JSON have no limit
        return math.nan
