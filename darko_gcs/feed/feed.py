"""Interface between a screen and a source of snapshots."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Protocol

from darko_gcs.state.field_history import ChartSource
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.traffic import Traffic
from darko_gcs.station.fleet import Fleet
from darko_gcs.station.station import Station


class Feed(Protocol):
    """A vehicle on the link, or a recording."""

    @property
    def snapshot(self) -> Snapshot:
        """The newest snapshot."""

    @property
    def now(self) -> float:
        """Its clock [s]."""

    @property
    def snapshot_now(self) -> float:
        """The same instant by the clock of the snapshot's times [s]."""

    @property
    def station(self) -> Station | None:
        """The station that talks to the vehicle; None for a recording."""

    @property
    def fleet(self) -> Fleet | None:
        """All vehicles on the link; None for a recording."""

    @property
    def traffic(self) -> Traffic:
        """Every message that was heard, of all vehicles."""

    @property
    def history(self) -> ChartSource:
        """The vehicle's messages, for charts."""

    @property
    def restart(self) -> Callable[[], Awaitable[None]] | None:
        """Starts our own vehicle process again; None if there is none."""

    async def open(self) -> None:
        """Begin."""

    async def close(self) -> None:
        """End, and release everything."""

    def note(self, text: str) -> None:
        """Put a text into the recording that is being made, if one is."""

    def advance(self, elapsed: float) -> None:
        """Let time pass for the feed [s]."""
