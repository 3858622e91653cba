"""Fetching the vehicle's own logs without a screen."""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from darko_gcs.errors import GroundError, LinkError
from darko_gcs.link import Link
from darko_gcs.signing import open_keyring
from darko_gcs.station import Station
from protocol.errors import FileError, LocalProtocolError
from protocol.events import Event, LogFailed, LogProgress, LogReceived, LogsListed, RemoteLog
from protocol.whole_file import write_whole

__all__ = ["Fetched", "fetch_logs", "file_name"]

POLL = 0.01  # [s]
HEARD_WITHIN = 30.0  # [s] a vehicle is waited for
LAST, ALL = "last", "all"

E = TypeVar("E", bound=Event)


@dataclass(frozen=True)
class Fetched:
    """What the vehicle has, and what of it was downloaded where."""

    logs: tuple[RemoteLog, ...]
    files: dict[int, Path]  # by the log's number


async def fetch_logs(args: argparse.Namespace) -> Fetched:
    """List the vehicle's logs and download the chosen ones.

    Raises:
        GroundError: If the link, the vehicle, a log or a file fails; the message says which.
    """
    async with AsyncExitStack() as stack:
        link = Link(Station(keyring=open_keyring(args.signing_key), vehicle=args.vehicle))
        stack.push_async_callback(link.close)
        await link.open(args.host, args.port)
        fetcher = _Fetcher(link)
        await fetcher.find_vehicle(HEARD_WITHIN)
        logs = await fetcher.list()
        chosen = [] if args.list else _choose(args.which, logs)
        files = {log.number: _save(args.to, log, await fetcher.fetch(log)) for log in chosen}
        return Fetched(logs, files)


def file_name(log: RemoteLog) -> str:
    """What a downloaded log is called: its number on the vehicle, and when it began (UTC) if that is known."""
    stamp = datetime.fromtimestamp(log.time_utc, UTC).strftime("-%Y%m%d-%H%M%S") if log.time_utc else ""
    return f"vehicle-{log.number:04}{stamp}.tlog"


class _Fetcher:
    def __init__(self, link: Link) -> None:
        self._link, self._endpoint = link, link.station.endpoint
        self._events: list[Event] = []
        self._told = -1  # tenths of a log that were said

    async def find_vehicle(self, limit: float) -> None:
        until = self._link.now + limit
        while self._endpoint.vehicle is None:
            if self._link.now > until:
                raise LinkError(f"no vehicle heard within {limit:g} s")
            await asyncio.sleep(POLL)

    async def list(self) -> tuple[RemoteLog, ...]:
        self._endpoint.list_logs(self._link.now)
        return (await self._end(LogsListed, "the list of logs")).logs

    async def fetch(self, log: RemoteLog) -> bytes:
        self._told = -1
        try:
            self._endpoint.fetch_log(log, self._link.now)
        except LocalProtocolError as error:
            raise GroundError(str(error)) from error
        return (await self._end(LogReceived, f"log {log.number}")).data

    async def _end(self, kind: type[E], what: str) -> E:
        while True:
            self._events += self._link.station.events()
            while self._events:
                event = self._events.pop(0)
                if isinstance(event, kind):
                    return event
                if isinstance(event, LogFailed):
                    raise LinkError(f"{what}: {event.reason}")
                if isinstance(event, LogProgress):
                    self._say(what, event)
            await asyncio.sleep(POLL)

    def _say(self, what: str, progress: LogProgress) -> None:
        tenth = 10 * progress.done // max(progress.total, 1)
        if tenth > self._told:
            self._told = tenth
            print(f"darko-gcs: {what}: {progress.done} of {progress.total} bytes", file=sys.stderr, flush=True)


def _choose(which: Sequence[str], logs: Sequence[RemoteLog]) -> list[RemoteLog]:
    if ALL in which:
        return list(logs)
    by_name = {str(log.number): log for log in logs} | ({LAST: logs[-1]} if logs else {})
    unknown = [name for name in which if name not in by_name]
    if unknown:
        there = ", ".join(name for name in by_name if name != LAST) or "none"
        raise GroundError(f"no log {unknown[0]} on the vehicle: there are {there}")
    return list({by_name[name].number: by_name[name] for name in which}.values())


def _save(folder: Path, log: RemoteLog, data: bytes) -> Path:
    """Write a log under a name that is free; it is there whole or not at all."""
    path, count = folder / file_name(log), 1
    while path.exists():
        count += 1
        path = folder / f"{Path(file_name(log)).stem}-{count}.tlog"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(path, data)
    except OSError as error:
        raise GroundError(f"{path}: cannot be written: {error.strerror}") from error
    except FileError as error:
        raise GroundError(str(error)) from error
    return path
