"""What the engines tell their owner. Plain frozen records: match on their class, do not subclass them."""

import math
from dataclasses import dataclass

from protocol.codec import Message
from protocol.engines.base import Peer
from protocol.keyring import KeyState
from protocol.plans.mission import MissionItem

__all__ = [
    "CommandCancelRequested",
    "CommandDone",
    "CommandProgress",
    "CommandRefused",
    "CommandRequested",
    "ControlRequested",
    "CurrentItemRequested",
    "CurrentItemSet",
    "Event",
    "FileFailed",
    "FileListed",
    "FileProgress",
    "FileReceived",
    "FileSummed",
    "LogEraseRequested",
    "LogFailed",
    "LogProgress",
    "LogReceived",
    "LogsListed",
    "MessageReceived",
    "MessageRequested",
    "MissionCleared",
    "MissionDownloaded",
    "MissionFailed",
    "MissionProgress",
    "MissionReceived",
    "MissionRefused",
    "MissionUploaded",
    "OperatorChanged",
    "OperatorRefused",
    "OperatorRequested",
    "ParameterChanged",
    "ParameterConfirmed",
    "ParameterFailed",
    "ParameterReceived",
    "ParameterRefused",
    "ParametersComplete",
    "RemoteLog",
    "SetpointReceived",
    "SigningChanged",
    "VehicleFound",
    "VehicleLost",
    "VehicleRestarted",
    "VehicleReturned",
]


class Event:
    """Base of all events, for annotations."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class VehicleFound(Event):
    """The first HEARTBEAT of an autopilot arrived."""

    system: int
    component: int


@dataclass(frozen=True, slots=True)
class VehicleLost(Event):
    """No HEARTBEAT for ``age`` seconds."""

    age: float


@dataclass(frozen=True, slots=True)
class VehicleReturned(Event):
    """HEARTBEAT again, after a silence of ``gap`` seconds."""

    gap: float


@dataclass(frozen=True, slots=True)
class VehicleRestarted(Event):
    """Its time since boot began again: what was asked of it before is forgotten there."""


@dataclass(frozen=True, slots=True)
class CommandProgress(Event):
    """The vehicle is working on a command; ``progress`` in percent, 255 when it does not say."""

    request: int
    command: int
    progress: int


@dataclass(frozen=True, slots=True)
class CommandDone(Event):
    """A command came to its end; ``result`` is a MAV_RESULT, or None when no answer came."""

    request: int
    command: int
    result: int | None
    reason: str


@dataclass(frozen=True, slots=True)
class CommandRequested(Event):
    """A ground station asks the vehicle for a command: answer with ``acknowledge(request, result)``.

    ``params`` are param1..param7. From a COMMAND_INT, x and y are already in degrees (global frames) or
    metres (local frames). ``frame`` is its MAV_FRAME, None for a COMMAND_LONG.
    """

    request: int
    command: int
    params: tuple[float, ...]
    frame: int | None
    peer: Peer

    def param(self, number: int, default: float = math.nan) -> float:
        """param1..param7; clients leave a parameter out as NaN or as 0: both give the default."""
        value = self.params[number - 1]
        return default if math.isnan(value) or value == 0.0 else value


@dataclass(frozen=True, slots=True)
class CommandCancelRequested(Event):
    """Who asked for a command that is in progress wants it stopped: ``acknowledge(request, CANCELLED)`` if it is."""

    request: int
    command: int
    peer: Peer


@dataclass(frozen=True, slots=True)
class CommandRefused(Event):
    """A command was answered with ``result`` (MAV_RESULT) before anybody saw it: unknown, or running already."""

    command: int
    result: int
    peer: Peer


@dataclass(frozen=True, slots=True)
class MessageRequested(Event):
    """A peer asked for one message (MAV_CMD_REQUEST_MESSAGE, already acknowledged): send it ``to=peer``."""

    message_id: int
    index: float  # param2 of the request: which instance, meaning depends on the message
    peer: Peer | None  # None: to everyone


@dataclass(frozen=True, slots=True)
class MissionProgress(Event):
    """``done`` of ``total`` items of a transfer; ``direction`` is "upload" or "download"."""

    direction: str
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class MissionUploaded(Event):
    """The vehicle accepted a plan of ``count`` items."""

    count: int
    kind: int = 0  # MAV_MISSION_TYPE: flight plan, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionDownloaded(Event):
    """The vehicle's plan, complete."""

    items: tuple[MissionItem, ...]
    kind: int = 0  # MAV_MISSION_TYPE: flight plan, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionReceived(Event):
    """A complete, valid plan replaced the old one of its type on the vehicle."""

    items: tuple[MissionItem, ...]
    kind: int = 0  # MAV_MISSION_TYPE: flight plan, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionRefused(Event):
    """An upload ended without a new plan: the old one stays. ``result`` is a MAV_MISSION_RESULT."""

    result: int
    reason: str
    kind: int = 0  # MAV_MISSION_TYPE: flight plan, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionCleared(Event):
    """The vehicle holds no plan of this type any more (both roles)."""

    kind: int = 0  # MAV_MISSION_TYPE: flight plan, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionFailed(Event):
    """A transfer came to nothing; ``operation`` is upload, download, clear or set_current.

    ``result`` is the vehicle's MAV_MISSION_RESULT, None when it did not answer or answered out of turn.
    """

    operation: str
    result: int | None
    reason: str
    kind: int = 0  # MAV_MISSION_TYPE: flight plan, fence or rally points


@dataclass(frozen=True, slots=True)
class CurrentItemSet(Event):
    """The vehicle confirmed the mission item asked for."""

    seq: int


@dataclass(frozen=True, slots=True)
class CurrentItemRequested(Event):
    """A ground station wants the mission to go on at item ``seq`` (which exists)."""

    seq: int


@dataclass(frozen=True, slots=True)
class ParameterReceived(Event):
    """The vehicle told one parameter; ``type`` is a MAV_PARAM_TYPE, integers are exact."""

    name: str
    value: float
    type: int
    index: int
    count: int


@dataclass(frozen=True, slots=True)
class ParametersComplete(Event):
    """All ``count`` parameters have arrived."""

    count: int


@dataclass(frozen=True, slots=True)
class ParameterConfirmed(Event):
    """The vehicle holds the value that was set."""

    name: str
    value: float


@dataclass(frozen=True, slots=True)
class ParameterFailed(Event):
    """A parameter could not be set, or (empty name) the list could not be fetched."""

    name: str
    reason: str


@dataclass(frozen=True, slots=True)
class ParameterChanged(Event):
    """A ground station changed a parameter of the vehicle."""

    name: str
    value: float


@dataclass(frozen=True, slots=True)
class ParameterRefused(Event):
    """The vehicle kept a parameter as it was."""

    name: str
    value: float | None  # the value that was refused; None: the parameter itself was
    reason: str


@dataclass(frozen=True, slots=True)
class OperatorChanged(Event):
    """Another ground station (system id) is in control of the vehicle now; 0: every one may steer it."""

    system: int
    why: str


@dataclass(frozen=True, slots=True)
class OperatorRefused(Event):
    """A peer wanted to steer while ground station ``holder`` is in control; it has its answer."""

    peer: Peer
    holder: int


@dataclass(frozen=True, slots=True)
class OperatorRequested(Event):
    """A peer wants control; the ground station ``holder`` that has it was told."""

    peer: Peer
    holder: int


@dataclass(frozen=True, slots=True)
class ControlRequested(Event):
    """The vehicle tells this ground station, which is in control, that another one asks for control."""

    system: int


@dataclass(frozen=True, slots=True)
class SetpointReceived(Event):
    """SET_POSITION_TARGET_LOCAL_NED or _GLOBAL_INT, SET_ATTITUDE_TARGET or SET_ACTUATOR_CONTROL_TARGET."""

    message: Message
    peer: Peer


@dataclass(frozen=True, slots=True)
class SigningChanged(Event):
    """What became of a signing key that a peer proposed, in words for the operator."""

    state: KeyState
    text: str


@dataclass(frozen=True, slots=True)
class MessageReceived(Event):
    """A message for this vehicle that no engine takes: the owner may answer it."""

    message: Message
    peer: Peer


@dataclass(frozen=True, slots=True)
class FileListed(Event):
    """A folder of the vehicle: names and sizes in bytes, None for a folder in it."""

    path: str
    entries: tuple[tuple[str, int | None], ...]


@dataclass(frozen=True, slots=True)
class FileProgress(Event):
    """``done`` of ``total`` bytes of a file have arrived."""

    path: str
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class FileReceived(Event):
    """A file of the vehicle, complete."""

    path: str
    data: bytes


@dataclass(frozen=True, slots=True)
class FileSummed(Event):
    """The vehicle told the checksum of a file (``protocol.engines.ftp.crc32``)."""

    path: str
    crc: int


@dataclass(frozen=True, slots=True)
class FileFailed(Event):
    """A listing, a download or a checksum came to nothing; ``error`` is a MAV_FTP_ERR, None without an answer."""

    path: str
    error: int | None
    reason: str


@dataclass(frozen=True, slots=True)
class RemoteLog:
    """A log as the vehicle lists it."""

    number: int
    time_utc: int  # when it began, since 1970 [s]; 0: not known
    size: int  # bytes


@dataclass(frozen=True, slots=True)
class LogsListed(Event):
    """The vehicle's logs, all of them."""

    logs: tuple[RemoteLog, ...]


@dataclass(frozen=True, slots=True)
class LogProgress(Event):
    """``done`` of ``total`` bytes of a log have arrived."""

    done: int
    total: int


@dataclass(frozen=True, slots=True)
class LogReceived(Event):
    """A log, complete."""

    log: RemoteLog
    data: bytes


@dataclass(frozen=True, slots=True)
class LogFailed(Event):
    """A list or a log came to nothing."""

    reason: str


@dataclass(frozen=True, slots=True)
class LogEraseRequested(Event):
    """A ground station wants the vehicle's logs deleted."""
