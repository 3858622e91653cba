"""A page of trims over airspeed: straight at several climbs, turning, braking; gaps are where no trim exists."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from sitl import Actuators, Airframe, Array, SitlError, load_airframe
from sitl.design.trim import Trim, braking_limit, level_trim, trims
from sitl.design.turn import TurningTrim, banked_trim, turning_trim
from sitl.model.airframe_files import available
from sitl.model.battery import drawn_power
from sitl.tools.plotting import blank_page, check_plot_path, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


AnyTrim: TypeAlias = Trim | TurningTrim
LISTED_SPEEDS = range(26)  # [m/s]
TRIM_SPEEDS = np.linspace(0.0, 25.0, 101)  # [m/s]
TURN_SPEEDS = np.linspace(0.0, 25.0, 51)  # [m/s]
TRIM_CLIMBS = (-30.0, -15.0, 0.0, 15.0, 30.0, 45.0)  # [deg]
TURN_RATES = (0.0, 15.0, 30.0, 45.0, 60.0)  # [deg/s]
DECELERATIONS = (0.0, 0.5, 1.0, 2.0, 3.0)  # [m/s2]


def cost(a: Airframe, trim: AnyTrim) -> float:
    """Energy per metre of path, as the airframe counts it [J/m]; infinite without speed."""
    left, right = np.broadcast_to(trim.omega, 2).tolist()
    inflow = trim.speed * math.cos(trim.theta - trim.climb)
    return drawn_power(Actuators(left, right, 0.0, 0.0), inflow, a) / trim.speed if trim.speed > 0.0 else math.inf


def gaps(speeds: Array, flown: Sequence[AnyTrim]) -> str:
    """Speeds without a trim, in words: empty if one exists everywhere, "none" if nowhere, else the ranges of speed."""
    missing = np.array([not trim.exists for trim in flown])
    if missing.all():
        return "none"
    edges = np.flatnonzero(np.diff(np.concatenate(([False], missing, [False])).astype(int)))
    ranges = [f"{speeds[low]:g}-{speeds[high - 1]:g}" for low, high in edges.reshape(-1, 2)]
    return f"none at {', '.join(ranges)} m/s" if ranges else ""


def save_trims_plot(name: str, a: Airframe, path: Path) -> None:
    """Draw the trims of an airframe.

    Args:
        name: Of the parameter set, for the title.
        a: The airframe.
        path: Of the plot: .png, .svg or .pdf.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(10.0, 13.0)
    axes = page.subplots(6, 2, sharex=True)
    page.suptitle(f"Trims of {name}: straight (left), level turns (right); a gap is where the actuators cannot hold it")
    climbs = {f"{climb:+g} deg": trims(a, TRIM_SPEEDS, math.radians(climb)) for climb in TRIM_CLIMBS}
    turns = {
        f"{turn:g} deg/s": [turning_trim(a, float(v), math.radians(turn)) for v in TURN_SPEEDS] for turn in TURN_RATES
    }
    _family(axes[:5, 0], a, TRIM_SPEEDS, climbs)
    _family(axes[:5, 1], a, TURN_SPEEDS, turns)
    _braking(axes[5], a)
    for axis in axes[5]:
        axis.set_xlabel("V [m/s]")
    save_page(page, path, dpi=100)


def _family(axes: Sequence[Axes], a: Airframe, speeds: Array, family: Mapping[str, Sequence[AnyTrim]]) -> None:
    """Five plots in a column, a curve per member of the family."""
    rows: tuple[tuple[str, Callable[[AnyTrim], float]], ...] = (
        ("nose over horizon [deg]", lambda trim: math.degrees(trim.theta)),
        ("greater elevon [deg]", lambda trim: math.degrees(np.max(trim.delta))),
        ("faster motor [rad/s]", lambda trim: float(np.max(trim.omega))),
        ("elevon margin [deg]", lambda trim: math.degrees(trim.margin)),
        ("energy [J/m]", lambda trim: cost(a, trim)),
    )
    for axis, (label, of) in zip(axes, rows, strict=True):
        for curve, flown in family.items():
            values = [of(trim) if trim.exists else math.nan for trim in flown]
            axis.plot(speeds, values, linewidth=1.0, label=f"{curve}  {gaps(speeds, flown)}".strip())
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
    axes[4].set_yscale("log")
    axes[0].legend(fontsize=6.5, framealpha=0.5)


def _braking(axes: Sequence[Axes], a: Airframe) -> None:
    """The elevons that braking in level flight takes, and the braking limit of each climb."""
    for brake in DECELERATIONS:
        flown = trims(a, TRIM_SPEEDS, 0.0, -brake)
        values = [math.degrees(trim.delta) if trim.exists else math.nan for trim in flown]
        axes[0].plot(TRIM_SPEEDS, values, linewidth=1.0, label=f"{brake:g} m/s2  {gaps(TRIM_SPEEDS, flown)}".strip())
    axes[0].set_ylabel("elevon, braking level [deg]")
    for climb in TRIM_CLIMBS[1:5]:
        limit = braking_limit(a, TRIM_SPEEDS, math.radians(climb)).held
        axes[1].plot(TRIM_SPEEDS, limit, linewidth=1.0, label=f"{climb:+g} deg")
    axes[1].set_ylabel("braking limit [m/s2]")
    axes[1].set_ylim(-5.0, 10.0)
    for axis in axes:
        axis.legend(fontsize=6.5, framealpha=0.5)
        axis.grid(alpha=0.3)


def show_airframe(args: argparse.Namespace) -> int:
    """List the shipped sets, or check and show one."""
    _check(args)
    if args.name is None:
        for name in available():
            print(f"{name:<22}{load_airframe(name).description}")
        return 0
    airframe = load_airframe(args.name)
    if args.trims:
        print("\n".join(_trims(airframe.parameters, args)))
        if args.plot is not None:
            save_trims_plot(airframe.name, airframe.parameters, args.plot)
        return 0
    print(f"{airframe.name}: {airframe.description}\n{airframe.path} sha256 {airframe.sha256}")
    for key, entry in airframe.values.items():
        print(f"  {key:<16}{entry.value!s:>14} {entry.unit:<10} {entry.source}")
    return 0


def _check(args: argparse.Namespace) -> None:
    """Refuse angles out of range, and options of --trims without it."""
    for option, limit in (("climb", 80.0), ("turn", 180.0), ("bank", 80.0)):
        value = getattr(args, option)
        if value is not None and not abs(value) <= limit:
            raise SitlError(f"--{option} {value:g} is not within -{limit:g} to {limit:g}")
    chosen = [option for option in ("climb", "turn", "bank", "plot") if getattr(args, option) is not None]
    if chosen and not (args.trims and args.name is not None):
        raise SitlError(f"--{chosen[0]} needs a parameter set and --trims")
    if args.plot is not None:
        check_plot_path(args.plot)


def _trims(a: Airframe, args: argparse.Namespace) -> Iterator[str]:
    climb = math.radians(args.climb or 0.0)
    if args.turn is None and args.bank is None:
        return _straight(a, climb)
    return _turning(a, climb, args.turn, args.bank)


def _straight(a: Airframe, climb: float) -> Iterator[str]:
    yield "V [m/s]  nose [deg]  thrust [N]  elevon [deg]  motor [rad/s]  elevon margin [deg]  [J/m]"
    for speed in LISTED_SPEEDS:
        trim = level_trim(a, float(speed), climb)
        numbers = (
            f"{math.degrees(trim.theta):12.1f}{trim.thrust:12.3f}{math.degrees(trim.delta):14.1f}{trim.omega:15.0f}"
        )
        missing = "" if trim.exists else "   no trim within the limits"
        yield f"{speed:7d}{numbers}{math.degrees(trim.margin):21.1f}{cost(a, trim):7.2f}{missing}"


def _turning(a: Airframe, climb: float, turn: float | None, bank: float | None) -> Iterator[str]:
    yield ("V [m/s]  turn [deg/s]  bank [deg]  nose [deg]  elevons [deg]  motors [rad/s]  elevon margin [deg]  [J/m]")
    for speed in LISTED_SPEEDS:
        if bank is None:
            trim = turning_trim(a, float(speed), math.radians(turn or 0.0), climb)
        elif speed == 0:
            continue  # at rest a bank does not turn
        else:
            trim = banked_trim(a, float(speed), math.radians(bank), climb)
        if math.isnan(trim.margin):
            yield f"{speed:7d}   no trim: the propellers would have to push, or no elevon angle balances"
            continue
        path = f"{math.degrees(trim.turn_rate):14.1f}{math.degrees(trim.bank):12.1f}{math.degrees(trim.theta):12.1f}"
        left, right = (math.degrees(delta) for delta in trim.delta)
        actuators = f"{left:9.1f}{right:6.1f}{trim.omega[0]:10.0f}{trim.omega[1]:6.0f}{math.degrees(trim.margin):21.1f}"
        missing = "" if trim.exists else "   no trim within the limits"
        yield f"{speed:7d}{path}{actuators}{cost(a, trim):7.2f}{missing}"
