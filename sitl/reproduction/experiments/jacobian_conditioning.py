"""Condition number of the moment's Jacobian, with the report's M_y and with the corrected one (report, 4.2.2)."""

from __future__ import annotations

import numpy as np

from sitl import Airframe
from sitl.reproduction.equations.report_forward_flight import conditioning
from sitl.reproduction.experiment import Panel, Statement, judge
from sitl.reproduction.svg_sheet import SvgSheet
from sitl.scenarios.scenario import Finding


def conditioning_rows(a: Airframe) -> list[Statement]:
    """Condition numbers at the hover, and along the level trims."""
    typed, ours = conditioning(a, 0.0, swapped=True), conditioning(a, 0.0, swapped=False)
    speeds = (1.0, 3.0, 5.0, 20.0)
    pairs = [[conditioning(a, speed, swapped=swapped) for swapped in (True, False)] for speed in speeds]
    both = (f"{one:.3g} and {two:.2g} at {speed:.0f} m/s" for (one, two), speed in zip(pairs, speeds, strict=True))
    along = ", ".join(both)
    worst = max(conditioning(a, float(speed), swapped=False) for speed in range(26))
    return [
        judge(
            "4.2.2",
            Finding("condition number at the hover, as typed", typed, "", "> 1e14", typed > 1e14),
            f"by singular values (the report takes eigenvalues); in level trims, as typed and corrected: {along}",
            slip=True,
        ),
        judge(
            "4.2.2",
            Finding("condition number at the hover, corrected", ours, "", "not invertible", ours > 1e14),
            f"the exchange in M_y alone makes the Jacobian singular; corrected it stays below {worst:.0f} up to "
            "25 m/s, and no bound on singular values is needed",
        ),
    ]


def conditioning_panel(a: Airframe) -> Panel:
    """Condition numbers over airspeed."""
    speeds = np.linspace(0.0, 25.0, 101)
    sheet = SvgSheet("forward-conditioning", height=2.4)
    with sheet as axes:
        for swapped, style, word in ((False, "-", "corrected"), (True, "--", "as typed")):
            values = [min(conditioning(a, float(speed), swapped=swapped), 1e8) for speed in speeds]
            axes[0].semilogy(speeds, values, style, label=word)
        axes[0].set(xlabel="level airspeed [m/s]", ylabel="condition number")
        axes[0].legend()
        axes[0].grid(alpha=0.2)
    return Panel(
        "", "Condition number of dM/du along the level trims",
        "The system is badly conditioned: its Jacobian cannot be inverted.",
        "As typed it is singular at the hover; corrected it never exceeds "
        f"{max(conditioning(a, float(speed), swapped=False) for speed in speeds):.0f}.", sheet.svg,
    )  # fmt: skip
