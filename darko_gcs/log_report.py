"""What is in a log, written out: lines for a person, JSON for a program."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

from darko_gcs.flight_summary import Decision, Flight, Period, Summary
from darko_gcs.words import printable

__all__ = ["as_json", "as_text"]

_FIRST_DATE = 946_684_800_000_000  # 2000-01-01 [us]: an earlier time is no date but a simulation's clock
_LONGEST = 20  # pieces of damage, jumps and mode changes shown to a person


def as_json(summary: Summary, name: str) -> str:
    """The log's file and every field of its summary, by its name there; NaN is null."""
    return json.dumps(_plain({"file": name, **asdict(summary)}), indent=2)


def as_text(summary: Summary, name: str, texts: int = 10) -> str:
    """A summary for a person.

    Args:
        summary: What is in the log.
        name: The log's file.
        texts: How many of the last status texts to show.
    """
    return "\n".join(_lines(summary, name, texts))


def _lines(summary: Summary, name: str, texts: int) -> Iterator[str]:
    yield f"{name}: {summary.records:,} messages in {_clock(summary.duration)} ({summary.size:,} bytes)"
    yield from _recording(summary)
    for flight in summary.flights:
        yield ""
        yield from _flight(flight)
    yield from _damage(summary)
    yield from _last_texts(summary, texts)
    yield ""
    yield f"{'message':<32} {'from':>7} {'count':>9} {'Hz':>8}"
    for message in summary.messages:
        source = f"{message.system}/{message.component}"
        yield f"{message.name:<32} {source:>7} {message.count:>9,} {message.rate:>8.2f}"


def _recording(summary: Summary) -> Iterator[str]:
    if summary.start_usec >= _FIRST_DATE:
        start = datetime.fromtimestamp(summary.start_usec / 1e6, UTC)
        yield f"recorded from {start:%Y-%m-%d %H:%M:%S} UTC"
    else:
        yield "recorded on a simulation's clock"
    signed = f", {summary.signed:,} signed (not verified)" if summary.signed else ""
    yield f"MAVLink 1: {summary.version_1:,}, MAVLink 2: {summary.version_2:,}{signed}"
    if summary.unknown:
        yield f"{summary.unknown:,} messages are not in the dialect: their checksums cannot be verified"
    if summary.clock_steps:
        times = "once, by" if summary.clock_steps == 1 else f"{summary.clock_steps} times, by up to"
        yield f"the recording clock went back {times} {_clock(summary.clock_back)}"
    if summary.stations:
        yield "other stations: " + ", ".join(f"{system}/{component}" for system, component in summary.stations)


def _flight(flight: Flight) -> Iterator[str]:
    yield f"vehicle {flight.system}/{flight.component}: {flight.type}, autopilot {flight.autopilot}"
    yield from _history("modes", flight.modes)
    yield from _history("armed", flight.armed, nothing="never")
    figures = (
        ("flown", flight.distance, "m"),
        ("height up to", flight.height, "m"),
        ("speed up to", flight.speed, "m/s"),
    )
    told = [f"{what} {value:.1f} {unit}" for what, value, unit in figures if value is not None]
    if told:
        yield "  " + ", ".join(told)
    if flight.cross_track_rms is not None:
        yield f"  off the path {flight.cross_track_rms:.1f} m rms, at most {flight.cross_track_max:.1f} m"
    yield from _history("vtol", flight.vtol, nothing=None)
    yield from _by_law(flight)
    if flight.decisions:
        yield "  decisions:"
    for decision in flight.decisions[:_LONGEST]:
        yield f"    {_clock(decision.time)} {_decision(decision)}"
    yield from _rest(flight.decisions, "decisions")
    if flight.jumps:
        yield "  jumps:"
    for jump in flight.jumps[:_LONGEST]:
        v = "" if math.isnan(jump.v) else f" at V = {jump.v:.4g}"
        change = f"{jump.law_from} -> {jump.law_to}"
        yield f"    {_clock(jump.time)} jump {jump.number} {printable(jump.name)}: {change}, {jump.reason}{v}"
    yield from _rest(flight.jumps, "jumps")


def _by_law(flight: Flight) -> Iterator[str]:
    """Time and energy of each law."""
    laws = list(dict.fromkeys((*flight.laws, *flight.energy)))
    if laws:
        yield f"  {'law':<24} {'time':>8} {'energy':>10}"
    for law in laws:
        energy = f"{flight.energy[law]:8.0f} J" if law in flight.energy else f"{'-':>8}  "
        yield f"    {law:<22} {_clock(flight.laws.get(law, 0.0)):>8} {energy}".rstrip()


def _decision(d: Decision) -> str:
    leg = "leg" if d.seq is None else f"leg to {d.seq}"
    ways = ", ".join(
        f"{name} {time:.1f} s {energy:.0f} J" if math.isfinite(time) else f"{name} impossible"
        for name, time, energy in (
            ("hover", d.hover_time, d.hover_energy),
            ("forward", d.forward_time, d.forward_energy),
        )
    )
    return f"{leg}, {d.distance:.0f} m, climb {round(d.climb, 0) + 0.0:+.0f} m: {d.way}, {d.reason} ({ways})"


def _history(what: str, periods: tuple[Period, ...], nothing: str | None = "unknown") -> Iterator[str]:
    """Periods, one a line; where there are none, ``nothing``, or no line at all."""
    if not periods and nothing is None:
        return
    yield f"  {what}:" + ("" if periods else f" {nothing}")
    for period in periods[:_LONGEST]:
        name = "" if period.name == what else f"  {period.name}"
        yield f"    {_clock(period.start)} to {_clock(period.end)}{name}"
    yield from _rest(periods, "more")


def _damage(summary: Summary) -> Iterator[str]:
    yield ""
    if not summary.damage:
        yield "no damage"
        return
    lost = sum(piece.length for piece in summary.damage)
    yield f"damage: {lost:,} bytes in {len(summary.damage):,} places belong to no message"
    for piece in summary.damage[:_LONGEST]:
        yield f"  at {piece.offset:,}: {piece.length:,} bytes, {piece.what}"
    yield from _rest(summary.damage, "places")


def _last_texts(summary: Summary, count: int) -> Iterator[str]:
    shown = summary.texts[len(summary.texts) - min(count, len(summary.texts)) :]
    if shown:
        yield ""
        yield f"last {len(shown)} of {len(summary.texts)} status texts"
    for text in shown:
        yield f"  {_clock(text.time)} {text.system}/{text.component} {text.severity}: {printable(text.text)}"


def _rest(things: tuple[Any, ...], what: str) -> Iterator[str]:
    if len(things) > _LONGEST:
        yield f"    and {len(things) - _LONGEST:,} {what}"


def _clock(seconds: float) -> str:
    """Minutes and seconds, with hours when there are any."""
    minutes, rest = divmod(round(seconds, 1), 60.0)
    hours, minutes = divmod(int(minutes), 60)
    return f"{hours}:{minutes:02d}:{rest:04.1f}" if hours else f"{minutes}:{rest:04.1f}"


def _plain(value: object) -> object:
    """JSON has no NaN."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
