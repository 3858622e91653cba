"""Events: records that the engines hand to their owner. Match on their class; do not subclass them.

There is one module for each service, but every event is imported from ``protocol.events``.
May import: ``protocol.message``, ``protocol.plans`` and ``protocol.keyring``; no engine.
"""

from protocol.events.command_events import (
    CommandCancelRequested,
    CommandDone,
    CommandProgress,
    CommandRefused,
    CommandRequested,
    ControlRequested,
    OperatorChanged,
    OperatorRefused,
    OperatorRequested,
)
from protocol.events.event import Event
from protocol.events.file_events import (
    FileFailed,
    FileProgress,
    FileReceived,
    LogEraseRequested,
    LogFailed,
    LogProgress,
    LogReceived,
    LogsListed,
    RemoteLog,
)
from protocol.events.flight_plan_events import FlightPlanFailed, FlightPlanReceived
from protocol.events.link_events import (
    MessageReceived,
    MessageRequested,
    PoseReceived,
    SetpointReceived,
    SigningChanged,
    VehicleFound,
    VehicleLost,
    VehicleRestarted,
    VehicleReturned,
)
from protocol.events.mission_events import (
    CurrentItemRequested,
    CurrentItemSet,
    MissionCleared,
    MissionDownloaded,
    MissionFailed,
    MissionProgress,
    MissionReceived,
    MissionRefused,
    MissionUploaded,
)
from protocol.events.parameter_events import (
    ParameterChanged,
    ParameterConfirmed,
    ParameterFailed,
    ParameterReceived,
    ParameterRefused,
    ParametersComplete,
)

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
    "FileProgress",
    "FileReceived",
    "FlightPlanFailed",
    "FlightPlanReceived",
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
    "PoseReceived",
    "RemoteLog",
    "SetpointReceived",
    "SigningChanged",
    "VehicleFound",
    "VehicleLost",
    "VehicleRestarted",
    "VehicleReturned",
]
