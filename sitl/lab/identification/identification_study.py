"""Identification as a study: results as text, plot and airframe file."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from sitl import SitlError, load_airframe
from sitl.lab.identification import flown_log
from sitl.lab.identification.flown_log import Excitation
from sitl.lab.identification.identify_flight import identify
from sitl.lab.identification.regression import RESIDUAL_AXES
from sitl.lab.identification.result import SHOT, Identification, Row
from sitl.lab.identification.unknowns import ADVANCE, value_of
from sitl.model.airframe_files import ALL_UNITS, PROPELLER_KEYS, RULES, ParameterSet, available
from sitl.model.propeller_files import PropellerError, PropellerFactors, load_propeller
from sitl.tools.plotting import blank_page, check_plot_path, save_page

# An identification as text and as plain data.

MASS = "mass: no flight tells it apart from the forces, which all go with it; {m:g} kg is {whose} (--mass)"


def as_text(found: Identification, name: str, mass_given: bool) -> str:
    """Tables of what was found, what is left, and what could not be told."""
    told, of = found.directions
    wind, spread = found.nuisance.wind, found.nuisance_interval
    lines = [
        f"{found.seconds:.0f} s of flight, up to {found.fastest:.1f} m/s through the air: {', '.join(found.sources)}",
        f"wind {wind[0]:+.2f} north, {wind[1]:+.2f} west, {wind[2]:+.2f} up m/s, "
        f"within {spread.wind[0]:.2g}, {spread.wind[1]:.2g}, {spread.wind[2]:.2g}, gusts about {found.gust:.1g}; "
        f"inputs act {1e3 * found.nuisance.delay:+.1f} ms late, within {1e3 * spread.delay:.2g}",
        "",
        *_table("what they do together", name, found.effects),
        "",
        *_table("parameters, for that mass", name, found.parameters),
        "",
        f"{'residual rms':<34}{name:>12}{'estimated':>12}",
    ]
    units = ("m/s2",) * 3 + ("rad/s",) * 3
    for axis, unit, before, after in zip(RESIDUAL_AXES, units, found.before, found.after, strict=True):
        lines.append(f"{axis:<34}{before:12.4g}{after:12.4g}  {unit}")
    for what, unit, before, after in zip(
        ("position", "velocity", "attitude", "body rates"), ("m", "m/s", "deg", "rad/s"), *found.replay, strict=True
    ):
        lines.append(f"{f'{what} after {SHOT:g} s of replay':<34}{before:12.4g}{after:12.4g}  {unit}")
    whose = "what you gave" if mass_given else f"that of {name}"
    lines += ["", f"told: {told} of {of} independent combinations of the parameters. Not told:"]
    lines += [f"  {one}" for one in (MASS.format(m=found.base.m, whose=whose), *found.untold)]
    lines += [f"note: {remark}" for remark in found.remarks]
    return "\n".join(lines)


def _table(title: str, name: str, rows: Sequence[Row]) -> Iterator[str]:
    yield f"{title:<50}{name:>12}{'estimated':>12}{'+/- 95 %':>11}  {'unit':<11}{'ratio':>6}"
    for row in rows:
        label = f"{row.key:<11}{row.name}" if row.key else row.name
        ratio = f"{row.estimate / row.before:6.3f}" if row.before else f"{'-':>6}"
        mark = "" if row.told else "  not told"
        yield (f"{label:<50}{row.before:12.4g}{row.estimate:12.4g}{row.interval:11.2g}  {row.unit:<11}{ratio}{mark}")


def as_data(found: Identification) -> dict[str, Any]:
    """Numbers and words alone, ready for JSON."""
    return {
        "sources": list(found.sources),
        "seconds": found.seconds,
        "fastest": found.fastest,
        "mass": found.base.m,
        "wind": found.nuisance.wind.tolist(),
        "wind_interval": found.nuisance_interval.wind.tolist(),
        "gust": found.gust,
        "delay": found.nuisance.delay,
        "delay_interval": found.nuisance_interval.delay,
        "accelerometer_bias": found.nuisance.bias.tolist(),
        "gyro_bias": found.gyro_bias.tolist(),
        "effects": [_row(row) for row in found.effects],
        "parameters": [_row(row) for row in found.parameters],
        "combinations_told": found.directions[0],
        "combinations": found.directions[1],
        "not_told": ["mass", *found.untold],
        "notes": list(found.remarks),
        "residuals": {
            axis: {"before": float(b), "after": float(e)}
            for axis, b, e in zip(RESIDUAL_AXES, found.before, found.after, strict=True)
        },
        "replay": {"seconds": SHOT, "before": found.replay[0]._asdict(), "after": found.replay[1]._asdict()},
    }


def _row(row: Row) -> dict[str, Any]:
    ratio = row.estimate / row.before if row.before else None
    told = bool(row.told) and math.isfinite(row.interval)
    return row._asdict() | {"ratio": ratio, "told": told}


# Residuals over the flight, before and after the identification.


MAX_CURVE_POINTS = 4000  # of a curve


def save_residual_plot(found: Identification, name: str, path: Path) -> None:
    """Draw one panel per axis.

    Raises:
        SitlError: Matplotlib is missing, or the file cannot be written.
    """
    page = blank_page(12.0, 9.0)
    every = max(1, len(found.time) // MAX_CURVE_POINTS)
    for number, axis in enumerate(RESIDUAL_AXES):
        panel = page.add_subplot(3, 2, 2 * (number % 3) + number // 3 + 1)
        for values, label, colour in zip(found.residuals, (name, "estimated"), ("tab:orange", "tab:blue"), strict=True):
            panel.plot(found.time[::every], values[::every, number], linewidth=0.6, label=label, color=colour)
        panel.set_title(axis)
        panel.set_ylabel("m/s²" if number < 3 else "rad/s")
        largest = float(np.abs(found.residuals[0][:, number]).max())
        panel.set_ylim(-largest, largest)
    page.axes[0].legend(loc="upper right")
    for panel in page.axes[2::3]:
        panel.set_xlabel("time [s]")
    save_page(page, path, 120)


# An identified airframe as a file that ``--airframe`` takes.


Entries: TypeAlias = dict[str, tuple[float | str, str]]  # values and sources by key of the file

FILE_DIGITS = 6
TORQUE_STEP = 1.02
FACTOR_OF = dict(zip(("k_f", "k_m", ADVANCE, "S_p"), PropellerFactors._fields, strict=True))


def write_airframe(
    found: Identification, base: ParameterSet, known: Mapping[str, float], flight: str, path: Path
) -> None:
    """Write the file and see that it loads.

    Args:
        found: What was identified.
        base: The set it began from; a set of a file of its own is written in full.
        known: What the user told, by field.
        flight: Name of the log, for the sources.
        path: Of the file.

    Raises:
        SitlError: It cannot be written, or no vehicle could fly on it.
    """
    shipped = base.name in available() and load_airframe(base.name).sha256 == base.sha256
    told = dict(_told(found, known, flight))
    entries: Entries = {} if shipped else {key: (base.values[key].value, base.values[key].source) for key in _own(base)}
    for key, (number, source) in told.items():
        entries |= dict([_entry(base, key, number, source)])
    entries |= _sparing(base, entries)
    waived = sorted(base.waived | {name for name, rule in RULES.items() if not rule.holds(found.airframe)})
    lines = ["# Identified. A set with a base takes from it what it does not state itself.", "[set]"]
    lines += [f"name = {_text(path.stem)}", f"description = {_text(f'{base.name} as identified from {flight}')}"]
    lines += [f"base = {_text(base.name)}"] if shipped else []
    lines += [f"waived = {json.dumps(waived)}"] if waived else []
    for key, (value, source) in entries.items():
        shown = _text(value) if isinstance(value, str) else repr(value)
        lines += ["", f"[{key}]", f"value = {shown}", f"unit = {_text(ALL_UNITS[key])}", f"source = {_text(source)}"]
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise SitlError(f"{path}: cannot be written: {error.strerror}") from error
    load_airframe(str(path))


def _own(base: ParameterSet) -> list[str]:
    """Keys of a set that a file without a base states: of a propeller not what its own file does."""
    return [key for key in base.values if key not in PROPELLER_KEYS or "propeller" not in base.values]


def _told(found: Identification, known: Mapping[str, float], flight: str) -> Iterator[tuple[str, tuple[float, str]]]:
    for key, value in known.items():
        yield key, (value, "given by the user")
    for row in found.parameters:
        share = 100.0 * row.interval / abs(row.estimate) if row.estimate else math.inf
        how = f"within {share:.2g} % (95 %)" if row.told else "which hardly tells it: near the set's value"
        yield row.key, (row.estimate, f"identified from {flight}, {how}")


def _sparing(base: ParameterSet, entries: Entries) -> Entries:
    """The torque factor that is needed for the propeller to take more power than it gives, if it is larger."""
    if "propeller" not in base.values:
        return {}
    stated = {key: one.value for key, one in base.values.items()} | {key: value for key, (value, _) in entries.items()}
    factors = PropellerFactors(**{key: float(stated[key]) for key in PropellerFactors._fields if key in stated})
    propeller, least = load_propeller(str(stated["propeller"])), factors.torque_factor
    while True:
        try:
            propeller.corrected(factors)
        except PropellerError:
            factors = factors._replace(torque_factor=_rounded(TORQUE_STEP * factors.torque_factor))
        else:
            break
    if factors.torque_factor == least:
        return {}
    source = f"raised from {least:g}, with which the propeller would give more power than it takes"
    return {"torque_factor": (factors.torque_factor, source)}


def _entry(base: ParameterSet, key: str, value: float, source: str) -> tuple[str, tuple[float | str, str]]:
    """A constant of the kernels as the file states it."""
    if "propeller" in base.values and key in FACTOR_OF:
        factor = FACTOR_OF[key]
        before = float(base.values[factor].value) if factor in base.values else 1.0
        return factor, (_rounded(before * value / value_of(base.parameters, key)), source)
    if key == "per_stall":
        return "stall_angle", (_rounded(math.degrees(math.asin(min(value**-0.5, 1.0)))), source)
    shown = math.degrees(value) if ALL_UNITS[key] == "deg" else value
    return key, (_rounded(shown), source)


def _rounded(value: float) -> float:
    return float(f"{value:.{FILE_DIGITS}g}")


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


MAX_PARAMETER_ERROR, MAX_FLOWN_WIND, MAX_FLOWN_GUSTS = 0.3, 8.0, 3.0
MAX_CHANNEL = 16


def study_identify(args: argparse.Namespace) -> int:
    """Identify from a log, or fly and write one."""
    _check(args)
    if args.fly is not None:
        return _fly(args)
    known, channels = _known(args), _channels(args.channels)

    base = load_airframe(args.airframe)
    in_hover = args.frame == "hover"
    found = identify(args.flight, base.parameters, known=known, channels=channels, hover_frame=in_hover)
    as_json = json.dumps({"ok": True, **as_data(found)}, indent=1) if args.json else ""
    print(as_json or as_text(found, base.name, "m" in known), flush=True)
    if args.plot is not None:
        save_residual_plot(found, base.name, args.plot)
    if args.write is not None:
        write_airframe(found, base, known, args.flight.name, args.write)
        print(f"written: fly it with --airframe {args.write}", file=sys.stderr)
    return 0


def _fly(args: argparse.Namespace) -> int:
    base = load_airframe(args.airframe)
    true = flown_log.off_airframe(base.parameters, args.off, args.seed)
    wind = (args.wind * math.cos(args.seed), args.wind * math.sin(args.seed))
    excitation = Excitation(legs=()) if args.hover else Excitation()
    flown = flown_log.fly_excitation(
        true, base.parameters, seed=args.seed, wind=wind, gusts=args.gusts, excitation=excitation
    )
    flown_log.write_log(flown, args.fly, base.parameters, seed=args.seed)
    how = "it crashed" if flown.crashed else "it flew on"
    if args.json:
        told = {"file": str(args.fly), "airframe": base.name, "off": args.off, "seed": args.seed}
        print(
            json.dumps({"ok": not flown.crashed, **told, "duration": float(flown.time[-1]), "crashed": flown.crashed})
        )
    else:
        print(f"{args.fly}: {flown.time[-1]:.0f} s of {base.name}, {100 * args.off:g} % off by seed {args.seed}; {how}")
    return 1 if flown.crashed else 0


def _check(args: argparse.Namespace) -> None:
    """Refuse bad arguments before any work."""
    if (args.flight is None) == (args.fly is None):
        raise SitlError("identify takes a flight's log, or --fly and the log to write")
    if args.seed < 0:
        raise SitlError(f"--seed {args.seed}: seeds are not negative")
    for name, most in (("off", MAX_PARAMETER_ERROR), ("wind", MAX_FLOWN_WIND), ("gusts", MAX_FLOWN_GUSTS)):
        value = getattr(args, name)
        if not 0.0 <= value <= most:
            raise SitlError(f"--{name} {value:g} is not within 0 and {most:g}")
    if args.write is not None and args.write.suffix != ".toml":
        raise SitlError(f"--write {args.write}: the name must end in .toml")
    for path in (args.write, args.fly):
        if path is not None and not path.parent.is_dir():
            raise SitlError(f"{path}: there is no folder {path.parent}")
    if args.plot is not None:
        check_plot_path(args.plot)


def _known(args: argparse.Namespace) -> dict[str, float]:
    known: dict[str, float] = {}
    for text in args.known:
        key, _, value = text.partition("=")
        try:
            known[key] = float(value)
        except ValueError:
            raise SitlError(f"--known {text}: must be KEY=VALUE") from None
    if args.mass is not None:
        known["m"] = args.mass
    for key, number in known.items():
        if not (math.isfinite(number) and (number > 0.0 or key.startswith("C_"))):
            raise SitlError(f"{key} = {number:g} must be positive")
    return known


def _channels(text: str | None) -> tuple[int, ...] | None:
    if text is None:
        return None
    try:
        numbers = tuple(int(one) for one in text.split(","))
    except ValueError:
        numbers = ()
    if (
        len({abs(number) for number in numbers}) != 4
        or len(numbers) != 4
        or not all(1 <= abs(number) <= MAX_CHANNEL for number in numbers)
    ):
        raise SitlError(f"--channels {text}: must be four different outputs from 1 to {MAX_CHANNEL}, as in 1,2,3,-4")
    return numbers
