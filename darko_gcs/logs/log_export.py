"""Quantities of a log, selected by name and time: plotted, or written in other programs' formats."""

from __future__ import annotations

import base64
import csv
import io
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darko_gcs.errors import GroundError
from darko_gcs.state.text import format_time
from protocol.errors import FileError
from protocol.flight_log.field_expressions import pieces, quantity, with_gaps
from protocol.flight_log.flight_clock import times_in_log
from protocol.flight_log.flight_summary import chosen_vehicle
from protocol.tlog import TlogReader, message_name
from protocol.tools.command_line import json_values
from protocol.wire.message import Source

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Span:
    """Times in a log, since its first record [s]."""

    begin: float = -np.inf
    end: float = np.inf

    def of(self, times: Floats) -> NDArray[np.bool_]:
        """Whether each time lies within the span."""
        within: NDArray[np.bool_] = (times >= self.begin) & (times <= self.end)
        return within


@dataclass(frozen=True, slots=True)
class Selection:
    """Quantities of a log."""

    times: tuple[Floats, ...]  # of each quantity [s], shape (n,)
    values: tuple[Floats, ...]  # shape (n,)
    names: tuple[str, ...]
    units: tuple[str, ...]  # of the values; empty where they are not known
    source: Source  # the vehicle's (system, component)

    def by_unit(self) -> list[Selection]:
        """A selection for each unit: degrees and metres have no scale in common."""
        found = []
        for unit in dict.fromkeys(self.units):
            at = [k for k, own in enumerate(self.units) if own == unit]
            found.append(
                Selection(
                    times=tuple(self.times[k] for k in at),
                    values=tuple(self.values[k] for k in at),
                    names=tuple(self.names[k] for k in at),
                    units=(unit,) * len(at),
                    source=self.source,
                )
            )
        return found

    def figures(self) -> list[dict[str, Any]]:
        """Of each quantity its span, its least and its greatest value, for a program."""
        return [
            {
                "field": name,
                "unit": unit,
                "count": len(times),
                "from": float(times[0]),
                "to": float(times[-1]),
                "min": _least(np.min, values),
                "max": _least(np.max, values),
            }
            for times, values, name, unit in zip(self.times, self.values, self.names, self.units, strict=True)
        ]


def _least(function: Callable[[Floats], float], values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(function(known)) if len(known) else math.nan


def selected(
    reader: TlogReader,
    name: str,
    expressions: Sequence[str],
    span: Span,
    vehicle: int | None = None,
    *,
    is_table: bool = False,
) -> Selection:
    """Quantities of one of the log's vehicles within a span, each in the order of its times.

    Args:
        reader: The log.
        name: What errors call it.
        expressions: Of fields.
        span: Of the vehicle's time.
        vehicle: System id; None: the first vehicle.
        is_table: All at the times of the first one, NaN where their messages lacked; else each at its own times.

    Raises:
        FileError: The log has no such vehicle, an expression cannot be used, or nothing lies within the span.
    """
    source = chosen_vehicle(reader, name, vehicle)
    clock = times_in_log(reader, source)
    times, values, names, units = [], [], [], []
    message = None  # of the first one
    for text in expressions:
        found = quantity(reader, text, source, clock)
        within = span.of(clock[found.rows])
        if not within.any():
            raise FileError(f"{name}: {text} has no value from {_clock_words(span)}; {_told(clock[found.rows])}")
        if is_table:
            found = quantity(reader, text, source, clock, message)
            message, within = found.message, span.of(clock[found.rows])
        order = np.argsort(clock[found.rows][within], kind="stable")  # a late message stands where it was made
        times.append(clock[found.rows][within][order])
        values.append(found.values[within][order])
        names.append(found.name)
        units.append(found.unit)
    return Selection(tuple(times), tuple(values), tuple(names), tuple(units), source)


def _clock_words(span: Span) -> str:
    """A span as the options have it."""
    begin = format_time(span.begin) if math.isfinite(span.begin) else "the beginning"
    return f"{begin} to {format_time(span.end) if math.isfinite(span.end) else 'the end'}"


def _told(times: Floats) -> str:
    """Words of the times at which there are values."""
    if not len(times):
        return "the log has none"
    return f"the log has some from {format_time(float(times.min()))} to {format_time(float(times.max()))}"


PICTURES = (".png", ".svg", ".pdf")


def text_plot(selection: Selection, width: int, height: int) -> str:
    """A plot made of characters.

    Args:
        selection: What to draw.
        width: [columns].
        height: [lines].

    Raises:
        GroundError: Plotext is not installed.
    """
    if find_spec("plotext") is None:
        raise GroundError("plots in the terminal need plotext: pip install 'darko[plots]'")
    import plotext  # noqa: PLC0415 - only plots need it

    plotext.clear_figure()
    plotext.theme("clear")
    plotext.plot_size(width, height)
    for times, values, name, unit in zip(
        selection.times, selection.values, selection.names, selection.units, strict=True
    ):
        label: str | None = f"{name} [{unit}]" if unit else name
        for piece in pieces(times):
            plotext.plot(times[piece].tolist(), values[piece].tolist(), label=label)
            label = None  # one entry for all pieces
    plotext.xlabel("time [s]")
    return str(plotext.uncolorize(plotext.build()))


def save_picture(selections: Sequence[Selection], path: Path, title: str) -> None:
    """Write a picture of one chart for each selection and unit; the suffix of the path chooses the format.

    Raises:
        GroundError: Matplotlib is not installed, the suffix names no format, or the file cannot be written.
    """
    if path.suffix not in PICTURES:
        raise GroundError(f"{path}: the name must end in {', '.join(PICTURES)}")
    if find_spec("matplotlib") is None:
        raise GroundError("pictures need matplotlib: pip install 'darko[plots]'")
    from matplotlib.figure import Figure  # noqa: PLC0415 - two seconds that only pictures need

    charts = [part for selection in selections for part in selection.by_unit()]
    page = Figure(figsize=(9.0, 3.0 + 1.5 * len(charts)), layout="constrained")
    axes = page.subplots(len(charts), 1, sharex=True, squeeze=False)[:, 0]
    for axis, chart in zip(axes, charts, strict=True):
        for times, values, name in zip(chart.times, chart.values, chart.names, strict=True):
            axis.plot(*with_gaps(times, values), label=name, linewidth=1.0)
        axis.set(ylabel=f"[{chart.units[0]}]" if chart.units[0] else "as expressed")
        axis.grid(alpha=0.3)
        axis.legend()
    axes[0].set(title=title)
    axes[-1].set(xlabel="time [s]")
    try:
        page.savefig(path, dpi=150)
    except OSError as error:
        raise GroundError(f"{path}: cannot be written: {error.strerror}") from error


_UNKNOWN_ALTITUDE = 1e6  # beyond it a field is not an altitude [m]


def as_csv(selection: Selection) -> bytes:
    """A table, as of ``is_table``, with a heading, its first column the time [s]."""
    times, columns = selection.times[0], selection.values
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

    times, columns = selection.times[0], selection.values
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
    times = times_in_log(reader, source)[rows]
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
    within = span.of(times_in_log(reader, vehicle)) & reader.known
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
