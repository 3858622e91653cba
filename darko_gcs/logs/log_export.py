"""A log in other programs' formats: CSV and Parquet tables, a KML path, MCAP for Foxglove."""

from __future__ import annotations

import base64
import csv
import io
import json
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darko_gcs.errors import GroundError
from darko_gcs.logs.log_selection import Selection, Span
from protocol.errors import FileError
from protocol.flight_log.flight_clock import times_since_boot
from protocol.tlog import TlogReader, message_name
from protocol.tools.command_line import json_values
from protocol.wire.message import Source

_UNKNOWN_ALTITUDE = 1e6  # beyond it a field is not an altitude [m]


def as_csv(selection: Selection) -> bytes:
    """A table with a heading, its first column the time [s]."""
    times, columns = selection.table()
    text = io.StringIO(newline="")
    rows = csv.writer(text)
    rows.writerow(("time", *selection.names))
    rows.writerows(zip(times.tolist(), *(column.tolist() for column in columns), strict=True))
    return text.getvalue().encode()


def as_parquet(selection: Selection) -> bytes:
    """The same table as Parquet.

    Raises:
        GroundError: Pyarrow is not installed.
    """
    _require("pyarrow", "Parquet")
    import pyarrow as pa  # noqa: PLC0415 - an optional dependency
    from pyarrow import parquet  # noqa: PLC0415

    times, columns = selection.table()
    data = io.BytesIO()
    parquet.write_table(pa.table(dict(zip(("time", *selection.names), (times, *columns), strict=True))), data)
    return data.getvalue()


def as_kml(reader: TlogReader, name: str, source: Source, span: Span) -> bytes:
    """A vehicle's path as a line over the map.

    Raises:
        GroundError: Simplekml is not installed.
        FileError: The log has no GLOBAL_POSITION_INT of it within the span.
    """
    _require("simplekml", "KML")
    import simplekml  # noqa: PLC0415 - an optional dependency

    rows, fields = reader.rows("GLOBAL_POSITION_INT", source), reader.columns("GLOBAL_POSITION_INT", source)
    lat, lon, alt = (fields[key].astype(float) * scale for key, scale in (("lat", 1e-7), ("lon", 1e-7), ("alt", 1e-3)))
    times = times_since_boot(reader, source)[rows]
    kept = np.flatnonzero(span.of(times) & ((lat != 0.0) | (lon != 0.0)) & (abs(alt) < _UNKNOWN_ALTITUDE))
    kept = kept[np.argsort(times[kept], kind="stable")]
    if not len(kept):
        raise FileError(f"{name}: no GLOBAL_POSITION_INT in this log, or none in the time that was asked for")
    document = simplekml.Kml(name=name)
    line = document.newlinestring(name=f"vehicle {source[0]}/{source[1]}")
    line.coords = list(zip(lon[kept].tolist(), lat[kept].tolist(), alt[kept].tolist(), strict=True))
    line.altitudemode = simplekml.AltitudeMode.absolute
    return str(document.kml()).encode()


def as_mcap(
    reader: TlogReader, name: str, source: Source, messages: Sequence[str], span: Span, *, alone: bool = False
) -> bytes:
    """Messages as JSON, a channel for each message of each source.

    Args:
        reader: The log.
        name: What errors call it.
        source: The vehicle.
        messages: Names of the messages; all where there are none.
        span: Of the vehicle's time.
        alone: Only messages of the vehicle's system.

    Raises:
        GroundError: Mcap is not installed.
        FileError: The log has none of the messages.
    """
    _require("mcap", "MCAP")
    from mcap.writer import Writer  # noqa: PLC0415 - an optional dependency

    data = io.BytesIO()
    writer = Writer(data)
    writer.start(profile="", library="darko")
    count = 0
    for message, sender, rows in _channels(reader, source, messages, span, alone=alone):
        columns = reader.columns(message, sender)
        schema = json.dumps({"type": "object", "properties": {field: {} for field in columns}}).encode()
        number = writer.register_schema(message, "jsonschema", schema)
        channel = writer.register_channel(f"/{sender[0]}/{sender[1]}/{message}", "json", number)
        wanted = np.isin(reader.rows(message, sender), rows)
        values = {field: _plain(column[wanted]) for field, column in columns.items()}
        for k, row in enumerate(rows.tolist()):
            at = (reader.clock.start_usec + round(float(reader.clock.playing[row]) * 1e6)) * 1000
            body = json.dumps({field: column[k] for field, column in values.items()}, allow_nan=False).encode()
            writer.add_message(channel, log_time=at, publish_time=at, data=body, sequence=k)
            count += 1
    writer.finish()  # type: ignore[no-untyped-call]
    if not count:
        raise FileError(f"{name}: none of the messages that were asked for are in this log")
    return data.getvalue()


def _channels(
    reader: TlogReader, vehicle: Source, messages: Sequence[str], span: Span, *, alone: bool
) -> list[tuple[str, Source, NDArray[np.int64]]]:
    """Message, source and records of each channel."""
    within = span.of(times_since_boot(reader, vehicle)) & reader.known
    if alone:
        within &= reader.systems == vehicle[0]
    kinds = np.unique(np.stack((reader.ids, reader.systems, reader.components), axis=1)[within], axis=0)
    found = []
    for number, system, component in kinds.tolist():
        message = message_name(number)
        if not messages or message in messages:
            rows = reader.rows(message, (system, component))
            found.append((message, (system, component), rows[within[rows]]))
    return found


def _plain(column: NDArray[Any]) -> list[Any]:
    """Values as JSON has them: what is no number is null, bytes are text."""
    if column.dtype.kind == "S":
        return [_text(value) for value in column.tolist()]
    values: list[Any] = column.tolist()
    return list(json_values(values)) if column.dtype.kind == "f" else values


def _text(value: bytes) -> str:
    try:
        return value.decode("utf-8")
    except UnicodeDecodeError:
        return base64.b64encode(value).decode()


def _require(package: str, what: str) -> None:
    if find_spec(package) is None:
        raise GroundError(f"{what} needs {package}: pip install 'darko[logs]'")
