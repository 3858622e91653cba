"""Events of parameters, on both sides."""

from __future__ import annotations

from dataclasses import dataclass

from protocol.events.event import Event

__all__ = [
    "ParameterChanged",
    "ParameterConfirmed",
    "ParameterFailed",
    "ParameterReceived",
    "ParameterRefused",
    "ParametersComplete",
]


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
