"""Selection of a recording's frames that are sent on to a ground station."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.tlog import TlogReader


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
