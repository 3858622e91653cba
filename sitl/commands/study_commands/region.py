"""The region of attraction of the linear hover law."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from itertools import pairwise

from sitl.lab.proofs.region import radii
from sitl.lab.studies.hover_region import hover_region as study
from sitl.lab.studies.hover_region.hover_region import LawRegion
from sitl.lab.studies.hover_region.hover_region_flights import STEP_SIZES, V_BANDS, RegionFlights
from sitl.lab.studies.hover_region.hover_region_plot import save_plot
from sitl.model.airframe_files import load
from sitl.tools.plotting import check_plot_path


def run(args: argparse.Namespace) -> int:
    """Prove, fly, print the tables and draw the plot."""
    if args.plot is not None:
        check_plot_path(args.plot)

    results = study.study(load(args.airframe).parameters, args.samples, args.seed)
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
    pairs = [f"{enter:.0f}/{leave:.0f}" for enter, leave in (study.DEFAULT_THRESHOLDS, study.REPORT_THRESHOLDS)]
    yield f"{'':20}{'99 %':>7}{'95 %':>7}  enter/leave" + "".join(f"{pair:>24}" for pair in pairs)
    for result in results:
        flights = result.flown
        leave = study.threshold(flights, study.MIN_CONVERGED_SHARE)
        verdicts = []
        for pair in (study.DEFAULT_THRESHOLDS, study.REPORT_THRESHOLDS):
            at_enter, at_leave = (study.share_at(flights, level) for level in pair)
            sound = "sound" if at_leave >= study.MIN_CONVERGED_SHARE else "too high"
            verdicts.append(f"{at_enter:.1%}/{at_leave:.1%} {sound:<8}")
        advised = f"{0.5 * leave:.0f}/{leave:.0f}"
        numbers = f"{study.threshold(flights, 0.99):7.0f}{leave:7.0f}{advised:>13}"
        yield f"{result.name:20}{numbers}" + "".join(f"{verdict:>24}" for verdict in verdicts)
