"""Parameters of the vehicle: their descriptions, fetched over MAVFTP and kept on disk, and changes that are judged.

https://mavlink.io/en/services/component_metadata.html: COMPONENT_METADATA names the general file, which names the file
of the parameters. Both are JSON, perhaps compressed (.xz). Files that are not on the vehicle are not fetched.

A vehicle may echo a value and refuse it then; and it may refuse a value that fits once others of the same file are
set. So what is refused is tried once more after the others.
"""

from __future__ import annotations

import contextlib
import json
import lzma
import math
import re
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from darko_gcs.state.message_log import add_line
from darko_gcs.state.number_ranges import fault_words
from darko_gcs.state.parameters import (
    MAX_PARAMETERS,
    ChangeState,
    ParameterChange,
    ParameterMetadata,
    number_text,
    same_value,
)
from darko_gcs.state.reduce_events import reduce_event
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import printable, reason_text
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.errors import FileError, LocalProtocolError
from protocol.events import Event, FileFailed, FileReceived, ParameterConfirmed, ParameterFailed
from protocol.tools.files import write_atomically
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


class KnownParameters:
    """Parameters that this project's vehicle told last, as it sent them.

    Args:
        file: Where it is kept.
    """

    def __init__(self, file: Path) -> None:
        self._file = file

    def keep(self, data: bytes) -> None:
        """Keep a parameter file. A disk that fails costs the names in recordings, nothing else."""
        with contextlib.suppress(FileError, OSError):
            self._file.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(self._file, data)

    def load(self) -> Mapping[str, ParameterMetadata]:
        """By parameter name; empty if nothing is kept, or it cannot be read."""
        try:
            return read_parameter_file(self._file.read_bytes())
        except (FileError, OSError):
            return {}


REFUSAL_TIME = 0.5  # after an answer, in which a value may still be refused, and the vehicle says why [s]
MAX_OPEN_CHANGES = 10  # that wait for an answer at a time

Answer = ParameterConfirmed | ParameterFailed


class ParameterChanges:
    """The changes of one operator; where each stands is in the snapshot's ``parameter_changes``.

    Args:
        endpoint: Sends them; hand in its events.
    """

    def __init__(self, endpoint: GroundEndpoint) -> None:
        self._endpoint = endpoint
        self._queue: deque[tuple[str, float]] = deque()
        self._open: set[str] = set()
        self._answers: dict[str, tuple[Answer, float]] = {}  # not judged yet, and since when [s]
        self._refused: dict[str, float] = {}  # the first time: tried again after the others
        self._repeated: set[str] = set()
        self._has_set = False  # one since all were done

    def request(self, s: Snapshot, wanted: Mapping[str, float], now: float) -> Snapshot:
        """Begin to set parameters. Returns the snapshot with these changes waiting."""
        for name, value in wanted.items():
            self._forget(name)
            self._queue.append((name, value))
        waiting = {name: ParameterChange(value) for name, value in wanted.items()}
        return self._send(
            s._replace(parameters=s.parameters._replace(changes={**s.parameters.changes, **waiting})), now
        )

    def take(self, event: Event, now: float) -> bool:
        """Take an event of the endpoint. Returns True if it is an answer, which ``handle_timer`` reports."""
        if not isinstance(event, ParameterConfirmed | ParameterFailed) or event.name not in self._open:
            return False
        self._open.discard(event.name)
        self._answers[event.name] = (event, now)
        return True

    def handle_timer(self, s: Snapshot, now: float) -> Snapshot:
        """Judge the answers that are old enough and send what is next."""
        for name, (answer, since) in tuple(self._answers.items()):
            if now - since >= REFUSAL_TIME:
                del self._answers[name]
                s = self._judge(s, answer, since, now)
        if self._refused and not (self._queue or self._open or self._answers):
            self._queue.extend(self._refused.items())
            self._repeated, self._refused = set(self._refused), {}
        return self._send(s, now)

    def _judge(self, s: Snapshot, answer: Answer, since: float, now: float) -> Snapshot:
        name, change = answer.name, s.parameters.changes[answer.name]
        if isinstance(answer, ParameterConfirmed):
            kept = s.parameters.values.get(name, answer.value)
            if same_value(kept, answer.value):
                self._has_set = True
                return reduce_event(_with_change(s, name, ParameterChange(change.value, ChangeState.SET)), answer, now)
            line = f"Parameter {name} stays {number_text(kept)}: the vehicle refused {number_text(answer.value)}"
        else:
            line = f"Parameter {name}: {reason_text(answer.reason)}"
        reason = _words_about(s, name, since) or change.reason
        if self._may_repeat(name):
            self._refused[name] = change.value
            return _with_change(s, name, change._replace(reason=reason))  # vehicles say the same only once in a while
        reason = reason or line.partition(": ")[2]
        s = _with_change(s, name, change._replace(state=ChangeState.REFUSED, reason=reason))
        return add_line(s, now, mavlink.MAV_SEVERITY_WARNING, line)

    def _may_repeat(self, name: str) -> bool:
        return name not in self._repeated and bool(self._has_set or self._queue or self._open or self._answers)

    def _send(self, s: Snapshot, now: float) -> Snapshot:
        while self._queue and len(self._open) < MAX_OPEN_CHANGES:
            name, value = self._queue.popleft()
            try:
                self._endpoint.set_parameter(name, value, now)
            except LocalProtocolError as error:
                refused = ParameterChange(value, ChangeState.REFUSED, fault_words(error))
                s = add_line(_with_change(s, name, refused), now, mavlink.MAV_SEVERITY_WARNING, refused.reason)
            else:
                self._open.add(name)
        if not (self._queue or self._open or self._answers or self._refused):
            self._has_set, self._repeated = False, set()
        return s

    def _forget(self, name: str) -> None:
        """An earlier change of the parameter is replaced."""
        self._queue = deque(pair for pair in self._queue if pair[0] != name)
        self._open.discard(name)
        self._answers.pop(name, None)
        self._refused.pop(name, None)
        self._repeated.discard(name)


def _with_change(s: Snapshot, name: str, change: ParameterChange) -> Snapshot:
    return s._replace(parameters=s.parameters._replace(changes={**s.parameters.changes, name: change}))


def _words_about(s: Snapshot, name: str, since: float) -> str:
    """Text of the vehicle about a parameter since about a time; empty if there is none."""
    recent = (line.text for line in reversed(s.log.lines) if line.time >= since - REFUSAL_TIME)
    return next(
        (text for text in recent if name in re.findall(r"\w+", text) and not text.startswith(f"Parameter {name}")), ""
    )
