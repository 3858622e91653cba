"""Region of attraction of the linear hover law: flights from random states, and a proof (report, section 5.1).

The report takes its thresholds 250 and 400 from sampled trajectories. Here states are drawn on level sets of V and
flown by the linear law alone on the whole plant (:mod:`sitl.lab.studies.hover_region_flights`). A flight
has converged once it is in the set that :mod:`sitl.lab.proofs.region` proves; V is the LQR's, whichever law flies.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sitl import Airframe, Array, SitlError, load_airframe
from sitl.control.hover_linear import LinearGains
from sitl.design import linearise
from sitl.design.lmi import SPREAD, effectiveness, guaranteed_decay, lmi_gains
from sitl.design.lqr import gentle_hover_gains, hover_gains
from sitl.design.lqr import lqr as design_lqr
from sitl.design.proved import PROVED_LEVEL, is_proved, proved_gains
from sitl.lab.proofs.proof import Proof
from sitl.lab.proofs.region import Certificate, certify, chart_level, radii, rate_level, reach_level, saturation_level
from sitl.lab.proofs.rise import first_rise
from sitl.lab.studies.hover_region_flights import STEP_SIZES, V_BANDS, RegionFlights, decay_seen, draw, fly, steps
from sitl.tools.plotting import blank_page, check_plot_path, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


CONVERGED_V = 0.02  # V at which a law without a certificate counts as converged
GENTLE_WEIGHT = 10.0  # of u, for a gentler LQR
SHARE_ROUNDING = 1e-9  # tolerance of comparisons of shares
NEIGHBOURHOOD = 1.25  # factor of V within which a flight counts for a level
MIN_CONVERGED_SHARE = 0.95  # of flights that must converge from a threshold to leave
DEFAULT_THRESHOLDS, REPORT_THRESHOLDS = (20.0, 50.0), (250.0, 400.0)  # thresholds to enter and to leave


class LawRegion(NamedTuple):
    """Results for one law."""

    name: str
    gains: LinearGains
    certificate: Certificate | None  # None where V leaves the integral out
    rise: float  # the law's own V at which it first rises
    guaranteed: float  # decay rate of V for every effectiveness within the spread [1/s]
    seen: float  # decay rate flown [1/s]
    settling: Array  # settling times of steps, as :func:`steps` gives them [s]
    flown: RegionFlights  # from states that occur in flights
    spread: RegionFlights  # from states uniform on level sets


def laws(a: Airframe) -> dict[str, LinearGains]:
    """The compared laws by name."""
    lqr = hover_gains(a, integral=False)
    A, B = linearise.hover(a)
    K, S = design_lqr(A, B, np.eye(12), GENTLE_WEIGHT * np.eye(4))
    proved = {"LQI as flown": proved_gains(a)} if is_proved(a) else {}
    return proved | {
        "LQI, R = 5 I": gentle_hover_gains(a),
        "LQI of the report": hover_gains(a),
        "LQR": lqr,
        "LQR of the report": lqr._replace(reach=math.inf),
        f"LQR, R = {GENTLE_WEIGHT:.0f} I": lqr._replace(K=np.ascontiguousarray(K), S=S),
        "LMI": lmi_gains(a),
    }


def study(a: Airframe, samples: int, seed: int) -> list[LawRegion]:
    """Certify and fly every law from the same states.

    Args:
        a: The airframe.
        samples: States per draw.
        seed: Of the draws.

    Raises:
        SitlError: If there are too few samples for the bands, or a law has no certificate.
    """
    if samples < len(V_BANDS) - 1 or seed < 0:
        raise SitlError(
            f"{samples} samples with seed {seed}: at least {len(V_BANDS) - 1} samples and a seed from 0 on are needed"
        )
    S = hover_gains(a, integral=False).S
    flown, spread = (draw(S, samples, seed, envelope=envelope) for envelope in (True, False))
    A, corners = linearise.hover(a)[0], effectiveness(a, SPREAD)
    results = []
    for name, gains in laws(a).items():
        certificate = certified(a, gains)
        converged_v = CONVERGED_V if certificate is None else certificate.level
        results.append(
            LawRegion(
                name=name,
                gains=gains,
                certificate=certificate,
                rise=first_rise(a, gains),
                guaranteed=guaranteed_decay(A, corners, gains.K, gains.S),
                seen=decay_seen(a, gains),
                settling=steps(a, gains),
                flown=fly(a, gains, flown, converged_v),
                spread=fly(a, gains, spread, converged_v),
            )
        )
    return results


def certified(a: Airframe, gains: LinearGains) -> Certificate | None:
    """The certificate of a law: with commands in force at once, or stored and with the delay for the law that flies."""
    if not gains.K_i.any():
        return certify(a, gains, sampled=False)
    if not gains.S_ii.any():
        return None
    rate = rate_level(a, Proof.of(a, gains), saturation_level(a, gains))
    return Certificate(PROVED_LEVEL, saturation_level(a, gains), rate, reach_level(gains), chart_level(gains))


def threshold(flights: RegionFlights, share: float) -> float:
    """The V up to which at least this share of the flights converges; 0 if the lowest V already misses it.

    The share as a function of V is the best fit that does not rise with V.
    """
    from scipy.optimize import isotonic_regression  # noqa: PLC0415 - half a second that only this study needs

    order = np.argsort(flights.start)
    fit = isotonic_regression(flights.converged[order].astype(float), increasing=False).x
    good = np.flatnonzero(fit >= share - SHARE_ROUNDING)
    return float(flights.start[order][good[-1]]) if good.size else 0.0


def share_at(flights: RegionFlights, level: float) -> float:
    """Share that converges of the flights that start within NEIGHBOURHOOD of a V; NaN if there are none."""
    near = np.abs(np.log(flights.start / level)) <= math.log(NEIGHBOURHOOD)
    return float(flights.converged[near].mean()) if near.any() else math.nan


# A page of where flights of the linear hover law start, and which of them converge.


def save_plot(results: list[LawRegion], path: Path) -> None:
    """Draw every start by V and outcome, the proved levels, and the thresholds.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(9.0, 7.0)
    page.suptitle("Linear hover law: where flights start, and whether they converge")
    above, below = page.subplots(2, 1, sharex=True)
    _strips(above, results, [result.flown for result in results])
    above.set_title("states that occur in flights: 17 m, 5 m/s, 90 deg, 3 rad/s at most", fontsize=9)
    _strips(below, results, [result.spread for result in results])
    below.set_title("states uniform on level sets of V", fontsize=9)
    below.set_xlabel("V of the LQR with Q = I, R = I at the start; proved level and first rise: of the law's own V")
    above.plot([], [], color="tab:green", linewidth=2.5, label="proved")  # not every law has one
    handles, labels = above.get_legend_handles_labels()
    page.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
    save_page(page, path, dpi=80)


def _strips(axis: Axes, results: list[LawRegion], strips: list[RegionFlights]) -> None:
    scatter = np.random.default_rng(0)
    for row, (result, flights) in enumerate(zip(results, strips, strict=True)):
        height = row + scatter.uniform(-0.3, 0.3, flights.start.size)
        for outcome, colour, name in ((True, "tab:blue", "converged"), (False, "tab:red", "lost")):
            chosen = flights.converged == outcome
            label = None if row else name
            axis.plot(flights.start[chosen], height[chosen], ".", color=colour, markersize=2.5, label=label)
        ends = np.array([row - 0.4, row + 0.4])
        if result.certificate is not None:
            axis.plot(2 * [result.certificate.level], ends, color="tab:green", linewidth=2.5)
        axis.plot(2 * [result.rise], ends, color="tab:orange", linewidth=1.5, label=None if row else "V first rises")
        leave = threshold(flights, MIN_CONVERGED_SHARE)
        if leave > 0.0:
            axis.plot(2 * [leave], ends, "k", linewidth=1.5, label=None if row else "95 % converge up to here")
    for values, style in ((DEFAULT_THRESHOLDS, "--"), (REPORT_THRESHOLDS, ":")):
        for value in values:
            pair = f"{values[0]:.0f} / {values[1]:.0f}" if value == values[0] else None
            axis.axvline(value, linestyle=style, linewidth=0.9, color="grey", label=pair)
    axis.set_xscale("log")
    axis.set_yticks(range(len(results)), [result.name for result in results], fontsize=8)
    axis.invert_yaxis()


def study_region(args: argparse.Namespace) -> int:
    """Prove, fly, print the tables and draw the plot."""
    if args.plot is not None:
        check_plot_path(args.plot)

    results = study(load_airframe(args.airframe).parameters, args.samples, args.seed)
    print("\n".join(_lines(results)))
    if args.plot is not None:
        save_plot(results, args.plot)
        print(f"plot: {args.plot}")
    return 0


def _lines(results: list[LawRegion]) -> Iterator[str]:
    yield "Proved level: below it V falls everywhere and flights stay (still air; ideal actuators, but LQI as flown)"
    yield from _proved(results)
    yield "\nDecay of V [1/s] and settling of position steps, slowest axis [s]"
    yield from _linear(results)
    yield "\nShare converged (share with V never rising), states that occur in flights: to 17 m, 5 m/s, 90 deg, 3 rad/s"
    yield from _bands(results, [result.flown for result in results])
    yield "\nShare converged (share with V never rising), states uniform on level sets of V"
    yield from _bands(results, [result.spread for result in results])
    yield "\nThresholds of V (of the LQR) for states that occur in flights, and the share that converges from them"
    yield from _thresholds(results)


def _proved(results: list[LawRegion]) -> Iterator[str]:
    yield f"{'':20}{'proved':>9}{'V rises':>9}{'saturates':>11}{'rate':>9}{'eta = 0':>9}   alone, any direction"
    for result in results:
        certificate = result.certificate
        if certificate is None:
            yield f"{result.name:20}{'-':>9}{result.rise:9.4f}"
            continue
        p, v, turn, w = radii(result.gains, certificate.level)
        yield (
            f"{result.name:20}{certificate.level:9.4f}{result.rise:9.4f}{certificate.saturation:11.4f}"
            f"{certificate.rate:9.4f}{certificate.chart:9.3f}   {p:.2f} m, {v:.2f} m/s, {math.degrees(turn):.1f} deg,"
            f" {w:.2f} rad/s"
        )


def _linear(results: list[LawRegion]) -> Iterator[str]:
    yield f"{'':20}{'guaranteed':>11}{'flown':>7}" + "".join(f"{step:7.1f} m" for step in STEP_SIZES)
    for result in results:
        slowest = "".join(f"{time:9.2f}" for time in result.settling.max(axis=1))
        guaranteed = "-" if result.gains.K_i.any() else f"{result.guaranteed:.2f}"
        yield f"{result.name:20}{guaranteed:>11}{result.seen:7.2f}{slowest}"


def _bands(results: list[LawRegion], drawn: list[RegionFlights]) -> Iterator[str]:
    edges = [f"{low:.0f}-{high:.0f}" for low, high in pairwise(V_BANDS)]
    yield f"{'':20}" + "".join(f"{edge:>13}" for edge in edges) + "  lost from  saturated"
    for result, flights in zip(results, drawn, strict=True):
        cells = []
        for band in range(len(edges)):
            chosen = flights.band == band
            cells.append(f"{flights.converged[chosen].mean():7.2f} ({flights.monotone[chosen].mean():.2f})")
        lost = flights.start[~flights.converged]
        lowest = f"{lost.min():9.2f}" if lost.size else f"{'-':>9}"
        yield f"{result.name:20}{''.join(cells)}  {lowest}{flights.saturated.mean():10.0%}"


def _thresholds(results: list[LawRegion]) -> Iterator[str]:
    pairs = [f"{enter:.0f}/{leave:.0f}" for enter, leave in (DEFAULT_THRESHOLDS, REPORT_THRESHOLDS)]
    yield f"{'':20}{'99 %':>7}{'95 %':>7}  enter/leave" + "".join(f"{pair:>24}" for pair in pairs)
    for result in results:
        flights = result.flown
        leave = threshold(flights, MIN_CONVERGED_SHARE)
        verdicts = []
        for pair in (DEFAULT_THRESHOLDS, REPORT_THRESHOLDS):
            at_enter, at_leave = (share_at(flights, level) for level in pair)
            sound = "sound" if at_leave >= MIN_CONVERGED_SHARE else "too high"
            verdicts.append(f"{at_enter:.1%}/{at_leave:.1%} {sound:<8}")
        advised = f"{0.5 * leave:.0f}/{leave:.0f}"
        numbers = f"{threshold(flights, 0.99):7.0f}{leave:7.0f}{advised:>13}"
        yield f"{result.name:20}{numbers}" + "".join(f"{verdict:>24}" for verdict in verdicts)
