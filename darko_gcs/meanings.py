"""What a vehicle's parameters mean, in its own words: parameter metadata, fetched over MAVFTP.

https://mavlink.io/en/services/component_metadata.html: COMPONENT_METADATA names the general file, which names the file
of the parameters; both are JSON, perhaps compressed (.xz). Other places than the vehicle's own files are not asked.
"""

from __future__ import annotations

import json
import lzma
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from darko_gcs.words import printable
from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.endpoint import GroundEndpoint
from protocol.errors import FileError, LocalProtocolError
from protocol.events import Event, FileFailed, FileReceived

__all__ = ["MOST", "UNKNOWN", "Meaning", "MeaningsClient", "read_meanings", "read_parameter_path"]

PARAMETER_METADATA = 1  # COMP_METADATA_TYPE_PARAMETER
SCHEME = "mftp://"
LARGEST = 4_000_000  # bytes of a file, unpacked
MOST = 5000  # parameters
REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE
COMPONENT_METADATA = mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA


class Meaning(NamedTuple):
    """One parameter as the vehicle describes it; NaN: it does not say."""

    text: str = ""
    unit: str = ""
    minimum: float = math.nan
    maximum: float = math.nan
    default: float = math.nan
    is_whole: bool = False
    needs_reboot: bool = False

    @property
    def bounds(self) -> str:
        """The range in words; empty without one."""
        if math.isnan(self.minimum) and math.isnan(self.maximum):
            return ""
        low, high = ("" if math.isnan(end) else f"{end:g}" for end in (self.minimum, self.maximum))
        return f"{low}..{high}"

    def complaint(self, value: float) -> str | None:
        """Why it cannot be this value, or None."""
        if self.is_whole and value != int(value):
            return f"{value:g} is not a whole number"
        if value < self.minimum or value > self.maximum:  # false for what is not said
            return f"{value:g} is not within {self.bounds} {self.unit}".rstrip()
        return None


UNKNOWN = Meaning()


class MeaningsClient:
    """Asks a vehicle once for what its parameters mean; ``known`` is empty until it has answered.

    Args:
        endpoint: The ground station's; messages and events are to be handed in.
    """

    def __init__(self, endpoint: GroundEndpoint) -> None:
        self._endpoint = endpoint
        self._awaited = ""  # path of the file under way
        self._asked = False
        self.known: Mapping[str, Meaning] = {}

    def request(self, now: float) -> None:
        """Begin, unless the answer is known or under way.

        Raises:
            LocalProtocolError: No vehicle has been found.
        """
        if not self._asked and not self.known:
            self._endpoint.command(REQUEST, float(COMPONENT_METADATA), now=now)
            self._asked = True

    def forget(self) -> None:
        """Another program may run on the vehicle now."""
        self._awaited, self._asked, self.known = "", False, {}

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the vehicle: COMPONENT_METADATA names the general file."""
        if message.get_type() == "COMPONENT_METADATA" and self._asked and not self._awaited and not self.known:
            self._read(_path(message.uri), now)

    def follow(self, event: Event, now: float) -> str:
        """Take an event of the endpoint; what the operator should know of it, or nothing."""
        if isinstance(event, FileFailed | FileReceived) and event.path == self._awaited != "":
            self._awaited = ""
            if isinstance(event, FileFailed):
                return f"Descriptions of the parameters: {event.reason.lower()}"
            try:
                self._take(event, now)
            except FileError as error:
                return f"Descriptions of the parameters: {event.path}: {error}"
        return ""

    def _take(self, event: FileReceived, now: float) -> None:
        content = _content(event.data)
        if "metadataTypes" in content:
            self._read(read_parameter_path(content), now)
        else:
            self.known = read_meanings(content)

    def _read(self, path: str, now: float) -> None:
        if path:
            try:
                self._endpoint.read_file(path, now)
            except LocalProtocolError:
                return  # a path that cannot be asked for leads nowhere
            self._awaited = path


def read_parameter_path(general: Mapping[str, Any]) -> str:
    """Path on the vehicle of its parameter metadata, from the general file; empty if that is not on the vehicle."""
    entries = general.get("metadataTypes")
    for entry in entries if isinstance(entries, list) else []:
        if isinstance(entry, dict) and entry.get("type") == PARAMETER_METADATA:
            return _path(entry.get("uri"))
    return ""


def read_meanings(content: Mapping[str, Any]) -> dict[str, Meaning]:
    """Meanings by name, from a file of parameter metadata; what is not as the schema has it is passed over.

    Raises:
        FileError: It lists no parameters.
    """
    listed = content.get("parameters")
    if not isinstance(listed, list):
        raise FileError("it has no list 'parameters'")
    named = (entry for entry in listed[:MOST] if isinstance(entry, dict) and isinstance(entry.get("name"), str))
    return {entry["name"]: _meaning(entry) for entry in named}


def _meaning(entry: Mapping[str, Any]) -> Meaning:
    return Meaning(
        _text(entry.get("shortDesc")),
        _text(entry.get("units")),
        _number(entry.get("min")),
        _number(entry.get("max")),
        _number(entry.get("default")),
        _text(entry.get("type")).lower().startswith(("int", "uint")),
        entry.get("rebootRequired") is True,
    )


def _content(data: bytes) -> dict[str, Any]:
    """The JSON object of a file.

    Raises:
        FileError: It is none, or longer than is reasonable.
    """
    try:
        plain = lzma.LZMADecompressor(memlimit=64_000_000).decompress(data, LARGEST) if data[:1] == b"\xfd" else data
        content = json.loads(plain)
    except (lzma.LZMAError, ValueError, RecursionError) as error:
        raise FileError(f"no JSON: {error}") from error
    if not isinstance(content, dict):
        raise FileError("it is no JSON object")
    return content


def _path(uri: object) -> str:
    if not isinstance(uri, str) or not uri.startswith(SCHEME):
        return ""
    return uri.removeprefix(SCHEME).partition("]")[2] if "[;" in uri else uri.removeprefix(SCHEME)


def _text(value: object) -> str:
    return printable(value) if isinstance(value, str) else ""


def _number(value: object) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return math.nan
    try:
        return float(value)
    except OverflowError:  # JSON has no largest integer
        return math.nan
