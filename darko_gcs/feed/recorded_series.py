"""Height and V of a recorded flight over its records, and where it took off."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darko_gcs.state.values import uses_forward_v
from protocol.dialect import mavlink
from protocol.tlog import TlogReader
from protocol.wire.message import Source

CLEAR_HEIGHT = 1.0  # above where it stood: it has taken off [m]
FLYING = (mavlink.MAV_LANDED_STATE_TAKEOFF, mavlink.MAV_LANDED_STATE_IN_AIR)


class Series(NamedTuple):
    """One quantity over the records that tell it, shape (n,) each."""

    rows: NDArray[np.int64]
    values: NDArray[np.float64]


def height_series(reader: TlogReader, source: Source) -> Series:
    """Height in the local frame, or above home where there is none [m]."""
    rows = reader.rows("LOCAL_POSITION_NED", source)
    if len(rows):
        return Series(rows, -reader.columns("LOCAL_POSITION_NED", source)["z"].astype(np.float64))
    rows = reader.rows("GLOBAL_POSITION_INT", source)
    return Series(rows, reader.columns("GLOBAL_POSITION_INT", source)["relative_alt"] / 1e3)


def v_series(reader: TlogReader, source: Source) -> Series:
    """V of the hover law or of the forward law, whichever the law in force goes by."""
    columns = reader.columns("DARKO_HYBRID_STATE", source)
    forward = np.array([uses_forward_v(law) for law in columns["law"].tolist()], dtype=bool)
    values = np.where(forward, columns["v_forward"], columns["v_hover"]).astype(np.float64)
    return Series(reader.rows("DARKO_HYBRID_STATE", source), values)


def take_off_row(reader: TlogReader, source: Source) -> int:
    """The record at which the vehicle has taken off: it says so, or it is clear of where it stood; else the first."""
    rows = reader.rows("EXTENDED_SYS_STATE", source)
    states = reader.columns("EXTENDED_SYS_STATE", source)["landed_state"]
    stood = np.flatnonzero(states == mavlink.MAV_LANDED_STATE_ON_GROUND)
    if len(stood):
        flying = rows[np.isin(states, FLYING) & (np.arange(len(states)) > stood[0])]
        return int(flying[0]) if len(flying) else 0
    height = height_series(reader, source)
    clear = height.rows[height.values > height.values[0] + CLEAR_HEIGHT] if len(height.rows) else height.rows
    return int(clear[0]) if len(clear) else 0
