"""Events of the link: vehicles that appear and disappear, messages that no engine handles, signing keys."""

from __future__ import annotations

from dataclasses import dataclass

from protocol.events.event import Event
from protocol.wire.keyring import KeyState
from protocol.wire.message import Message, Peer

__all__ = [
    "MessageReceived",
    "MessageRequested",
    "PoseReceived",
    "PredictionRequested",
    "SetpointReceived",
    "SigningChanged",
    "VehicleFound",
    "VehicleLost",
    "VehicleRestarted",
    "VehicleReturned",
]


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
