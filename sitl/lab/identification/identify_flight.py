"""From a log to what it tells of an airframe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from sitl import Airframe
from sitl.lab.identification.flight_log import LogConventions, read_flight
from sitl.lab.identification.output_error import refined
from sitl.lab.identification.path_reconstruction import reconstructed
from sitl.lab.identification.regression import FitProblem, solved
from sitl.lab.identification.result import Identification, identification
from sitl.lab.identification.sensor_record import SensorRecord
from sitl.lab.identification.stretches import usable_stretches
from sitl.lab.identification.unknowns import unknowns_of, with_values

OFTEN_ENOUGH = 90.0  # commands a second


def identify(
    log: Path,
    base: Airframe,
    *,
    known: Mapping[str, float] | None = None,
    channels: tuple[int, ...] | None = None,
    hover_frame: bool = True,
) -> Identification:
    """Identify an airframe from a log.

    Args:
        log: A telemetry log.
        base: The set to begin from.
        known: Constants that are known, by field.
        channels: Outputs of left motor, right motor, left elevon and right elevon, from 1; negative: reversed.
        hover_frame: Whether attitude and IMU are of the hover frame, or of that of forward flight.

    Raises:
        SitlError: The log cannot be read, lacks something, or has no flight in it; or a known key is none.
    """
    unknowns_of(base, known)  # a wrong key is said before the log is read
    return identify_record(read_flight(log, LogConventions(channels, base, hover_frame)), base, known=known)


def identify_record(
    record: SensorRecord, base: Airframe, *, known: Mapping[str, float] | None = None
) -> Identification:
    """The same of what was read already."""
    unknowns = unknowns_of(base, known)
    begin = with_values(base, known or {})
    paths = [reconstructed(stretch, base.g) for stretch in usable_stretches(record, base)]
    problem = FitProblem(paths, begin, unknowns)
    with np.errstate(all="ignore"):  # a step too far gives no number, and is not taken
        solution = refined(problem, solved(problem))
    found = identification(paths, problem, solution, begin, record.sources)
    if record.commands.rate >= OFTEN_ENOUGH:
        return found
    often = f"commands at {record.commands.rate:.0f} Hz"
    note = f"{often}: what lies between them is guessed, and the intervals are too narrow"
    return replace(found, remarks=(note, *found.remarks))
