"""Events of file and log transfers, on both sides."""

from __future__ import annotations

from dataclasses import dataclass

from protocol.events.event import Event

__all__ = [
    "FileFailed",
    "FileProgress",
    "FileReceived",
    "LogEraseRequested",
    "LogFailed",
    "LogProgress",
    "LogReceived",
    "LogsListed",
    "RemoteLog",
]


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
