"""Downloads the logs that the vehicle has recorded itself."""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from darko_gcs.errors import GroundError, LinkError
from darko_gcs.feed.links import UdpLink
from darko_gcs.scripting.link_session import POLL_PERIOD, VEHICLE_TIMEOUT, open_link
from darko_gcs.station.keyring_setup import open_keyring
from darko_gcs.station.station import Station
from protocol.errors import FileError, LocalProtocolError
from protocol.events import Event, LogFailed, LogProgress, LogReceived, LogsListed, RemoteLog
from protocol.tools.files import write_atomically

LAST_LOG, ALL_LOGS = "last", "all"  # words of the command line

EventType = TypeVar("EventType", bound=Event)


@dataclass(frozen=True)
class DownloadedLogs:
    """The vehicle's logs, and the files of those that were downloaded."""

    logs: tuple[RemoteLog, ...]
    files: dict[int, Path]  # by the number of the log


async def download_logs(args: argparse.Namespace) -> DownloadedLogs:
    """List the vehicle's logs and download the chosen ones.

    Args:
        args: Options of ``darko-gcs log fetch``.

    Raises:
        GroundError: If the link, the vehicle, a log or a file fails; the message says which.
    """
    station = Station(keyring=open_keyring(args.signing_key), vehicle=args.vehicle, system=args.id)
    async with open_link(station, args.host, args.port) as link:
        download = _Download(link)
        await download.find_vehicle()
        logs = await download.list_logs()
        chosen = [] if args.list else choose_logs(args.which, logs)
        files = {log.number: save_log(args.to, log, await download.fetch(log)) for log in chosen}
        return DownloadedLogs(logs, files)


def file_name(log: RemoteLog) -> str:
    """Name of a downloaded log: its number on the vehicle, and its start time (UTC) if known."""
    stamp = datetime.fromtimestamp(log.time_utc, UTC).strftime("-%Y%m%d-%H%M%S") if log.time_utc else ""
    return f"vehicle-{log.number:04}{stamp}.tlog"


class _Download:
    def __init__(self, link: UdpLink) -> None:
        self._link, self._endpoint = link, link.station.endpoint
        self._events: list[Event] = []
        self._reported_tenths = -1  # of the log under way

    async def find_vehicle(self) -> None:
        deadline = self._link.now + VEHICLE_TIMEOUT
        while self._endpoint.vehicle is None:
            if self._link.now > deadline:
                raise LinkError(f"no vehicle heard within {VEHICLE_TIMEOUT:g} s")
            await asyncio.sleep(POLL_PERIOD)

    async def list_logs(self) -> tuple[RemoteLog, ...]:
        self._endpoint.list_logs(self._link.now)
        return (await self._wait_for(LogsListed, "the list of logs")).logs

    async def fetch(self, log: RemoteLog) -> bytes:
        self._reported_tenths = -1
        try:
            self._endpoint.fetch_log(log, self._link.now)
        except LocalProtocolError as error:
            raise GroundError(str(error)) from error
        return (await self._wait_for(LogReceived, f"log {log.number}")).data

    async def _wait_for(self, kind: type[EventType], what: str) -> EventType:
        while True:
            self._events += self._link.station.events()
            while self._events:
                event = self._events.pop(0)
                if isinstance(event, kind):
                    return event
                if isinstance(event, LogFailed):
                    raise LinkError(f"{what}: {event.reason}")
                if isinstance(event, LogProgress):
                    self._report(what, event)
            await asyncio.sleep(POLL_PERIOD)

    def _report(self, what: str, progress: LogProgress) -> None:
        tenths = 10 * progress.done // max(progress.total, 1)
        if tenths > self._reported_tenths:
            self._reported_tenths = tenths
            print(f"darko-gcs: {what}: {progress.done} of {progress.total} bytes", file=sys.stderr, flush=True)


def choose_logs(which: Sequence[str], logs: Sequence[RemoteLog]) -> list[RemoteLog]:
    """The logs that the command line names.

    Args:
        which: Numbers, "last" or "all".
        logs: The vehicle's logs.

    Raises:
        GroundError: The vehicle has no such log; the message lists those it has.
    """
    if ALL_LOGS in which:
        return list(logs)
    by_name = {str(log.number): log for log in logs} | ({LAST_LOG: logs[-1]} if logs else {})
    unknown = [name for name in which if name not in by_name]
    if unknown:
        available = ", ".join(name for name in by_name if name != LAST_LOG) or "none"
        raise GroundError(f"no log {unknown[0]} on the vehicle; available: {available}")
    return list({by_name[name].number: by_name[name] for name in which}.values())


def save_log(folder: Path, log: RemoteLog, data: bytes) -> Path:
    """Write a log, whole or not at all, under a name that no file has.

    Raises:
        GroundError: The file cannot be written.
    """
    path, count = folder / file_name(log), 1
    while path.exists():
        count += 1
        path = folder / f"{Path(file_name(log)).stem}-{count}.tlog"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(path, data)
    except OSError as error:
        raise GroundError(f"{path}: cannot be written: {error.strerror}") from error
    except FileError as error:
        raise GroundError(str(error)) from error
    return path
