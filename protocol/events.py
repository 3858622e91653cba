"""Events: records that the engines hand to their owner. Match on their class; do not subclass them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.plans.plan import MissionItem
from protocol.wire.message import Message, Peer
from protocol.wire.signing import KeyState


class Event:
    """Base of all events, for annotations."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class VehicleFound(Event):
    """The first HEARTBEAT of an autopilot has arrived."""

    system: int
    component: int


@dataclass(frozen=True, slots=True)
class VehicleLost(Event):
    """No HEARTBEAT for ``age`` seconds."""

    age: float


@dataclass(frozen=True, slots=True)
class VehicleReturned(Event):
    """HEARTBEAT again, after ``gap`` seconds of silence."""

    gap: float


@dataclass(frozen=True, slots=True)
class VehicleRestarted(Event):
    """The vehicle's time since boot started anew: it no longer knows earlier requests."""


@dataclass(frozen=True, slots=True)
class MessageReceived(Event):
    """A message for this vehicle that no engine handles: the owner may answer it."""

    message: Message
    peer: Peer


@dataclass(frozen=True, slots=True)
class PredictionRequested(Event):
    """A peer asks with DARKO_LEGS_REQUEST what legs would take: answer with DARKO_LEGS_PREDICTION."""

    message: Message
    peer: Peer


@dataclass(frozen=True, slots=True)
class PoseReceived(Event):
    """A pose of the vehicle as somebody else measured it."""

    message: Message
    peer: Peer


@dataclass(frozen=True, slots=True)
class MessageRequested(Event):
    """A peer requested one message (MAV_CMD_REQUEST_MESSAGE, already acknowledged): send it to ``peer``."""

    message_id: int
    index: float  # param2 of the request: which instance; its meaning depends on the message
    peer: Peer | None  # None: to everyone


@dataclass(frozen=True, slots=True)
class SetpointReceived(Event):
    """SET_POSITION_TARGET_LOCAL_NED or _GLOBAL_INT, SET_ATTITUDE_TARGET or SET_ACTUATOR_CONTROL_TARGET."""

    message: Message
    peer: Peer


@dataclass(frozen=True, slots=True)
class SigningChanged(Event):
    """The state of a signing key that a peer proposed, with a text for the operator."""

    state: KeyState
    text: str


@dataclass(frozen=True, slots=True)
class CommandProgress(Event):
    """The vehicle is executing a command; ``progress`` in percent, 255 if unknown."""

    request: int
    command: int
    progress: int


@dataclass(frozen=True, slots=True)
class CommandDone(Event):
    """A command has ended; ``result`` is a MAV_RESULT, None if no answer came."""

    request: int
    command: int
    result: int | None
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandRequested(Event):
    """A ground station sent the vehicle a command: answer with ``acknowledge(request, result)``.

    ``params`` are param1..param7. Those of a COMMAND_INT have x and y in degrees (global frames) or metres (local
    frames). ``frame`` is its MAV_FRAME, None for a COMMAND_LONG.
    """

    request: int
    command: int
    params: tuple[float, ...]
    frame: int | None
    peer: Peer

    def param(self, number: int, default: float = math.nan) -> float:
        """Parameter 1..7. Clients leave a parameter out as NaN or as 0: both mean the default."""
        value = self.params[number - 1]
        return default if math.isnan(value) or value == 0.0 else value


@dataclass(frozen=True, slots=True)
class CommandCancelRequested(Event):
    """The sender of a command in progress cancels it: answer ``acknowledge(request, CANCELLED)`` once it is stopped."""

    request: int
    command: int
    peer: Peer


@dataclass(frozen=True, slots=True)
class CommandRefused(Event):
    """The engine refused a command with ``result`` (MAV_RESULT): it is unknown, already running, or too frequent.

    Or a parameter is out of its range; then ``reason`` is a sentence about it.
    """

    command: int
    result: int
    peer: Peer
    reason: str = ""


@dataclass(frozen=True, slots=True)
class OperatorChanged(Event):
    """Another ground station (system id) controls the vehicle now; 0: every station may."""

    system: int
    why: str


@dataclass(frozen=True, slots=True)
class OperatorRefused(Event):
    """A peer tried to control the vehicle while ground station ``holder`` is in control; it was answered."""

    peer: Peer
    holder: int


@dataclass(frozen=True, slots=True)
class OperatorRequested(Event):
    """A peer asks for control; the ground station ``holder``, which has it, was notified."""

    peer: Peer
    holder: int


@dataclass(frozen=True, slots=True)
class ControlRequested(Event):
    """The vehicle notifies this ground station, which is in control, that another one asks for control."""

    system: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterReceived(Event):
    """One parameter of the vehicle has arrived; ``type`` is a MAV_PARAM_TYPE, integers are exact."""

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
    """The vehicle confirmed the value that was set."""

    name: str
    value: float


@dataclass(frozen=True, slots=True)
class ParameterFailed(Event):
    """A parameter could not be set, or (empty name) the list could not be downloaded."""

    name: str
    reason: str


@dataclass(frozen=True, slots=True)
class ParameterChanged(Event):
    """A ground station changed a parameter of the vehicle."""

    name: str
    value: float


@dataclass(frozen=True, slots=True)
class ParameterRefused(Event):
    """The vehicle refused a change of a parameter."""

    name: str
    value: float | None  # the refused value; None: the parameter itself was refused
    reason: str


@dataclass(frozen=True, slots=True)
class MissionProgress(Event):
    """``done`` of ``total`` items of a transfer; ``direction`` is "upload" or "download"."""

    direction: str
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class MissionUploaded(Event):
    """The vehicle accepted a plan of ``count`` items, or (``is_partial``) so many new items in its mission."""

    count: int
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points
    is_partial: bool = False


@dataclass(frozen=True, slots=True)
class MissionDownloaded(Event):
    """The vehicle's complete plan has arrived."""

    items: tuple[MissionItem, ...]
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionReceived(Event):
    """A complete, valid plan has replaced the old one of its type on the vehicle."""

    items: tuple[MissionItem, ...]
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points
    is_partial: bool = False  # only some items were written; the others and the length stayed


@dataclass(frozen=True, slots=True)
class MissionRefused(Event):
    """An upload ended without a new plan; the old one stays. ``result`` is a MAV_MISSION_RESULT."""

    result: int
    reason: str
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionCleared(Event):
    """The vehicle holds no plan of this type any more (on both sides)."""

    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionFailed(Event):
    """A transfer failed; ``operation`` is upload, download, clear or set_current.

    ``result`` is the vehicle's MAV_MISSION_RESULT, None if it did not answer or answered out of turn.
    """

    operation: str
    result: int | None
    reason: str
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points


@dataclass(frozen=True, slots=True)
class CurrentItemSet(Event):
    """The vehicle confirmed the requested mission item."""

    seq: int


@dataclass(frozen=True, slots=True)
class CurrentItemRequested(Event):
    """A ground station asks the mission to continue at item ``seq`` (which exists)."""

    seq: int


@dataclass(frozen=True, slots=True)
class FlightPlanReceived(Event):
    """All entries of the vehicle's flight plan have arrived."""

    plan_id: int
    entries: int


@dataclass(frozen=True, slots=True)
class FlightPlanFailed(Event):
    """The flight plan could not be downloaded."""

    reason: str


@dataclass(frozen=True, slots=True)
class FlightPlanUploaded(Event):
    """A ground station sent the vehicle the file of a flight plan: answer with ``FlightPlanFileServer.answer``."""

    data: bytes
    peer: Peer


@dataclass(frozen=True, slots=True)
class FlightPlanAnswered(Event):
    """The vehicle has loaded the plan that it was sent (empty text), or says why not."""

    text: str


@dataclass(frozen=True, slots=True)
class FileProgress(Event):
    """``done`` of ``total`` bytes of a file have arrived."""

    path: str
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class FileReceived(Event):
    """A file of the vehicle has arrived completely."""

    path: str
    data: bytes


@dataclass(frozen=True, slots=True)
class FileFailed(Event):
    """A download failed; ``error`` is a MAV_FTP_ERR, None without an answer."""

    path: str
    error: int | None
    reason: str


@dataclass(frozen=True, slots=True)
class RemoteLog:
    """A log in the vehicle's list."""

    number: int
    time_utc: int  # when it began, since 1970 [s]; 0: unknown
    size: int  # bytes


@dataclass(frozen=True, slots=True)
class LogsListed(Event):
    """The complete list of the vehicle's logs."""

    logs: tuple[RemoteLog, ...]


@dataclass(frozen=True, slots=True)
class LogProgress(Event):
    """``done`` of ``total`` bytes of a log have arrived."""

    done: int
    total: int


@dataclass(frozen=True, slots=True)
class LogReceived(Event):
    """A log has arrived completely."""

    log: RemoteLog
    data: bytes


@dataclass(frozen=True, slots=True)
class LogFailed(Event):
    """The list or a log could not be downloaded."""

    reason: str


@dataclass(frozen=True, slots=True)
class LogEraseRequested(Event):
    """A ground station asks the vehicle to delete its logs."""
