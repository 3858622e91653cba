"""Vehicles of a log, and the choice of the one that is asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.tlog import TlogReader
from protocol.wire.message import Source

__all__ = ["chosen_vehicle", "of_vehicle", "others_note", "stations", "vehicles"]


def vehicles(reader: TlogReader) -> list[Source]:
    """(system, component) of each vehicle that sent a HEARTBEAT."""
    return [source for source in _sources(reader, reader.rows("HEARTBEAT")) if _is_vehicle(reader, source)]


def stations(reader: TlogReader) -> list[Source]:
    """Other sources that sent a HEARTBEAT."""
    return [source for source in _sources(reader, reader.rows("HEARTBEAT")) if not _is_vehicle(reader, source)]


def chosen_vehicle(reader: TlogReader, name: str, system: int | None = None) -> Source:
    """A vehicle of a log.

    Args:
        reader: The log.
        name: What errors call it.
        system: System id; None: the first vehicle.

    Raises:
        FileError: There is none, or none with this id.
    """
    found = vehicles(reader)
    if not found:
        raise FileError(f"{name}: no vehicle sent a HEARTBEAT in this log")
    chosen = [source for source in found if system in {None, source[0]}]
    if not chosen:
        raise FileError(f"{name}: no vehicle {system} in this log; it has {_listed(found)}")
    return chosen[0]


def of_vehicle(reader: TlogReader, name: str, system: int) -> TlogReader:
    """The log without other vehicles than the one with a system id; errors as of ``chosen_vehicle``."""
    taken = chosen_vehicle(reader, name, system)
    others = [source[0] for source in vehicles(reader) if source[0] != taken[0]]
    return reader.only(~np.isin(reader.systems, others))


def others_note(reader: TlogReader, taken: Source) -> str:
    """Note that names the vehicle taken of several; empty if the log has no other."""
    others = [source for source in vehicles(reader) if source != taken]
    if not others:
        return ""
    return f"vehicle {taken[0]}/{taken[1]} is taken; the log also has {_listed(others)} (--vehicle ID)"


def _listed(found: Sequence[Source]) -> str:
    return ("vehicle " if len(found) == 1 else "vehicles ") + ", ".join(f"{one}/{two}" for one, two in found)


def _sources(reader: TlogReader, rows: NDArray[np.int64]) -> list[Source]:
    pairs = np.stack((reader.systems[rows], reader.components[rows]), axis=1)
    return [(int(system), int(component)) for system, component in np.unique(pairs, axis=0)]


def _is_vehicle(reader: TlogReader, source: Source) -> bool:
    kinds = reader.columns("HEARTBEAT", source)["autopilot"]
    return bool(np.any(kinds != mavlink.MAV_AUTOPILOT_INVALID))
