"""Sends what a replay plays to another ground station, while the operator wants it."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from darko_gcs.errors import LinkError
from darko_gcs.feed.links import Address, OutwardAddress, UdpSocket
from protocol.dialect import mavlink
from protocol.tlog import TlogReader
from protocol.tools.option_values import is_loopback


@dataclass(frozen=True, kw_only=True)
class PlayedFrames:
    """The frames of a log that are sent, and how many are not.

    Attributes:
        rows: Their records, ascending, shape (n,).
        times: Playing time of each [s], shape (n,).
        duration: Of the whole log [s].
        left_out: Frames that are not sent, by reason.
    """

    rows: NDArray[np.int64]
    times: NDArray[np.float64]
    duration: float
    left_out: dict[str, int] = field(default_factory=dict)

    @property
    def words(self) -> str:
        """Counts of the frames that are sent and left out, in words."""
        parts = [f"{count} {reason}" for reason, count in self.left_out.items() if count]
        return f"{len(self.rows)} frames in {self.duration:.1f} s" + (
            f"; left out: {', '.join(parts)}" if parts else ""
        )


def played_frames(reader: TlogReader, vehicle: int | None = None) -> PlayedFrames:
    """The frames that a station may take for a vehicle's; with a system id, those of this vehicle alone.

    Signed ones are left out: their signatures are old, and a station that checks them would refuse them. Frames of
    ground stations are left out: they are no telemetry, and their commands must not come out of a recording.
    """
    times = reader.clock.playing
    secret = reader.ids == mavlink.MAVLINK_MSG_ID_SETUP_SIGNING
    of_stations = np.isin(_sources(reader), _stations(reader)) & ~secret
    signed = reader.signed & ~of_stations & ~secret
    of_others = np.zeros(len(reader), dtype=np.bool_)
    if vehicle is not None:
        of_others = (reader.systems != vehicle) & ~(secret | signed | of_stations)
    rows = np.flatnonzero(~(secret | signed | of_stations | of_others))
    return PlayedFrames(
        rows=rows,
        times=times[rows],
        duration=reader.clock.duration,
        left_out={
            "signed": int(signed.sum()),
            "of ground stations": int(of_stations.sum()),
            **({} if vehicle is None else {"of other vehicles": int(of_others.sum())}),
            "with a signing key": int(secret.sum()),
            "bytes of damage": sum(piece.length for piece in reader.damage),
        },
    )


def _sources(reader: TlogReader) -> NDArray[np.int64]:
    """Sender of each record, as one number."""
    return reader.systems.astype(np.int64) << 8 | reader.components


def _stations(reader: TlogReader) -> NDArray[np.int64]:
    """Senders that said in a heartbeat that they are ground stations, or have a ground station's component id."""
    rows = reader.rows("HEARTBEAT")
    told = rows[reader.columns("HEARTBEAT")["type"] == mavlink.MAV_TYPE_GCS]
    own = reader.components == mavlink.MAV_COMP_ID_MISSIONPLANNER
    return np.unique(_sources(reader)[np.concatenate((told, np.flatnonzero(own)))])


class ReplayOutput:
    """Frames of a log, one a datagram, byte for byte; answers are not heeded.

    Args:
        reader: The log.
        address: Where the other station listens.

    Attributes:
        sent: Frames sent.
    """

    def __init__(self, reader: TlogReader, address: OutwardAddress) -> None:
        self._reader, self._address = reader, address
        self._rows: frozenset[int] = frozenset()  # records that are sent
        self._socket: UdpSocket | None = None
        self._to: Address = ("", 0)
        self.sent = 0

    @property
    def words(self) -> str:
        """Present destination; empty while nothing is sent."""
        return "" if self._socket is None else self.address_words

    @property
    def address_words(self) -> str:
        """The address to which it would send."""
        return f"{self._address.place}:{self._address.number}"

    async def start(self) -> None:
        """Send what is played from now on.

        Raises:
            LinkError: The log has nothing to send, or there is no way to the address.
        """
        frames = played_frames(self._reader)
        if not len(frames.rows):
            raise LinkError(f"nothing to send: {frames.words}")
        self._rows = frozenset(frames.rows.tolist())
        place, number = self._address.place, self._address.number
        try:
            found = await asyncio.get_running_loop().getaddrinfo(place, number, family=2)  # IPv4, as darko-sitl
            self._to = (str(found[0][4][0]), number)
            local = "127.0.0.1" if is_loopback(self._to) else "0.0.0.0"  # noqa: S104 - the other one is elsewhere
            self._socket = await UdpSocket.bind(local, 0, lambda _: None)
        except (OSError, UnicodeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise LinkError(f"cannot send to {self._address.words}: {reason}") from error

    def stop(self) -> None:
        """Send no more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def send(self, rows: range) -> None:
        """Send these records, if it is on; those that are no vehicle's are left out."""
        if self._socket is None:
            return
        for row in rows:
            if row in self._rows:
                self._socket.sendto(self._reader.frame(row), self._to)
                self.sent += 1
