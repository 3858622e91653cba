"""An identification as text and as plain data."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from sitl.lab.identification.regression import RESIDUAL_AXES
from sitl.lab.identification.result import SHOT, Identification, Row

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
