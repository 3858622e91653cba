"""The summary of a log as text for a person and as JSON for a program."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

from darko_gcs.state.text import format_time, printable, v_text
from protocol.flight_log.flight_clock import SAME_RATE
from protocol.flight_log.flight_summary import TELEMETRY_LOG, LoggedDecision, LoggedFlight, LogSummary, Period
from protocol.flight_log.flown_legs import LEGS_TITLE, leg_costs, leg_name, leg_parts
from protocol.names import cause_words, law_words, leg_words
from protocol.tools.command_line import json_values

_MIN_DATE = 946_684_800_000_000  # 2000-01-01; an earlier time is that of a simulation's clock [us since 1970]
_DAY = 86400.0  # [s]
_MAX_ROWS = 20  # of each list in the text


def summary_as_json(summary: LogSummary, name: str) -> str:
    """Name of the log's file and every field of its summary, under its own name; NaN is null."""
    return json.dumps(json_values({"ok": True, "file": name, **asdict(summary)}), indent=2)


def summary_as_text(summary: LogSummary, name: str, texts: int = 10) -> str:
    """The summary for a person.

    Args:
        summary: Of the log.
        name: Of the log's file.
        texts: Number of status texts to show, the last ones.
    """
    return "\n".join(_lines(summary, name, texts))


def _lines(summary: LogSummary, name: str, texts: int) -> Iterator[str]:
    yield f"{name}: {summary.records:,} messages in {format_time(summary.duration)} ({summary.size:,} bytes)"
    yield from _recording(summary)
    if summary.flights:
        yield "times count from the first message on, here and for --from, --to and --at"
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


def _recording(summary: LogSummary) -> Iterator[str]:
    if summary.start_usec >= _MIN_DATE:
        start = datetime.fromtimestamp(summary.start_usec / 1e6, UTC)
        yield f"recorded from {start:%Y-%m-%d %H:%M:%S} UTC"
    else:
        yield "recorded on a simulation's clock" if summary.format == TELEMETRY_LOG else "recorded at a time not known"
    if summary.format == TELEMETRY_LOG:
        signed = f", {summary.signed:,} signed (not verified)" if summary.signed else ""
        yield f"MAVLink 1: {summary.version_1:,}, MAVLink 2: {summary.version_2:,}{signed}"
    else:
        yield f"{summary.format}, told as MAVLink messages"
    if summary.byte_order == "little":
        yield "time stamps are little-endian, as early ground stations wrote them"
    if summary.unknown:
        yield f"messages outside the dialect: {summary.unknown:,} (their checksums cannot be verified)"
    if summary.clock_steps:
        times = "once, by" if summary.clock_steps == 1 else f"{summary.clock_steps} times, by up to"
        yield f"the recording clock went back {times} {format_time(summary.clock_back)}"
    if summary.clock_set_forward:
        times = "once, by" if summary.clock_set_forward == 1 else f"{summary.clock_set_forward} times, by up to"
        yield f"the recording clock was set forward {times} {_leap(summary.clock_forward)}, which are no time of flight"
    if summary.stations:
        listed = ", ".join(f"{system}/{component}" for system, component in summary.stations)
        yield f"no vehicles: {listed} (stations and others; the one that recorded is among them if it sent)"


def _leap(seconds: float) -> str:
    return format_time(seconds) if seconds < 2 * _DAY else f"{seconds / _DAY:,.0f} days"


def _autopilot_words(flight: LoggedFlight) -> str:
    """The autopilot; a DarkO announces another one's number, whose modes it has."""
    return f"DarkO with {flight.autopilot}'s modes" if flight.laws else f"autopilot {flight.autopilot}"


def _flight(flight: LoggedFlight) -> Iterator[str]:
    yield f"vehicle {flight.system}/{flight.component}: {flight.type}, {_autopilot_words(flight)}"
    if abs(flight.clock_rate - 1.0) > SAME_RATE:
        yield (
            f"  its clock ran {flight.clock_rate:.3g} times as fast as the recorder's: times from here on are the "
            "vehicle's"
        )
    yield from _history("modes", flight.modes)
    yield from _history("armed", flight.armed, nothing="never")
    figures = (
        ("flown", flight.distance, "m"),
        ("maximum height", flight.height, "m"),
        ("maximum speed", flight.speed, "m/s"),
    )
    known = [f"{what} {value:.1f} {unit}" for what, value, unit in figures if value is not None]
    if known:
        yield "  " + ", ".join(known)
    if flight.cross_track_rms is not None:
        yield f"  cross-track error {flight.cross_track_rms:.1f} m rms, maximum {flight.cross_track_max:.1f} m"
    yield from _history("vtol", flight.vtol, nothing=None)
    yield from _by_law(flight)
    if flight.decisions:
        yield "  decisions:"
    for decision in flight.decisions[:_MAX_ROWS]:
        yield f"    {format_time(decision.time)} {_decision(decision)}"
    yield from _rest(flight.decisions, "decisions")
    yield from _legs(flight)
    if flight.jumps:
        yield "  jumps:"
    for jump in flight.jumps[:_MAX_ROWS]:
        v = "" if math.isnan(jump.v) else f", V {v_text(jump.v)}"
        cause = cause_words(jump.law_from, jump.law_to, jump.reason)
        change = f"{law_words(jump.law_from)} to {law_words(jump.law_to)}"
        yield f"    {format_time(jump.time)} jump {jump.number}: {change}: {cause}{v}"
    yield from _rest(flight.jumps, "jumps")


def _legs(flight: LoggedFlight) -> Iterator[str]:
    """Legs flown, beside what no flight needs less than."""
    if not flight.legs:
        return
    yield f"  {LEGS_TITLE}:"
    for leg in flight.legs[:_MAX_ROWS]:
        yield f"    {format_time(leg.time)} {leg_name(leg)}: {leg_costs(leg)}"
        if leg.parts:
            yield f"      {leg_parts(leg)}"
    yield from _rest(flight.legs, "legs")


def _by_law(flight: LoggedFlight) -> Iterator[str]:
    """Time and energy in each law."""
    laws = list(dict.fromkeys((*flight.laws, *flight.energy)))
    if laws:
        yield f"  {'law':<24} {'time':>8} {'energy':>10}"
    for law in laws:
        energy = f"{flight.energy[law]:8.0f} J" if law in flight.energy else f"{'-':>8}  "
        yield f"    {law_words(law):<22} {format_time(flight.laws.get(law, 0.0)):>8} {energy}".rstrip()


def _decision(d: LoggedDecision) -> str:
    leg = "leg" if d.seq is None else f"leg to {d.seq}"
    alternatives = ", ".join(
        f"{name} {time:.1f} s {energy:.0f} J" if math.isfinite(time) else f"{name} impossible"
        for name, time, energy in (
            ("hover", d.hover_time, d.hover_energy),
            ("forward", d.forward_time, d.forward_energy),
        )
    )
    where = f"{leg}, {d.distance:.0f} m, climb {round(d.climb, 0) + 0.0:+.0f} m"
    return f"{where}: {leg_words(d.way, d.reason)} ({alternatives})"


def _history(what: str, periods: tuple[Period, ...], nothing: str | None = "unknown") -> Iterator[str]:
    """Periods, one per line; without any, ``nothing``, or no line if that is None."""
    if not periods and nothing is None:
        return
    yield f"  {what}:" + ("" if periods else f" {nothing}")
    for period in periods[:_MAX_ROWS]:
        name = "" if period.name == what else f"  {period.name}"
        yield f"    {format_time(period.start)} to {format_time(period.end)}{name}"
    yield from _rest(periods, "more")


def _damage(summary: LogSummary) -> Iterator[str]:
    yield ""
    if not summary.damage:
        yield "no damage"
        return
    lost = sum(piece.length for piece in summary.damage)
    places = "1 place" if len(summary.damage) == 1 else f"{len(summary.damage):,} places"
    yield f"damage: {lost:,} bytes outside messages, in {places}"
    for piece in summary.damage[:_MAX_ROWS]:
        yield f"  at {piece.offset:,}: {piece.length:,} bytes, {piece.what}"
    yield from _rest(summary.damage, "places")


def _last_texts(summary: LogSummary, count: int) -> Iterator[str]:
    shown = summary.texts[len(summary.texts) - min(count, len(summary.texts)) :]
    if shown:
        yield ""
        yield f"last {len(shown)} of {len(summary.texts)} status texts"
    for text in shown:
        yield f"  {format_time(text.time)} {text.system}/{text.component} {text.severity}: {printable(text.text)}"


def _rest(things: tuple[Any, ...], what: str) -> Iterator[str]:
    if len(things) > _MAX_ROWS:
        yield f"    and {len(things) - _MAX_ROWS:,} {what}"
