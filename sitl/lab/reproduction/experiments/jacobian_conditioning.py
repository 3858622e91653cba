"""Condition number of the moment's Jacobian, with the report's M_y and with the corrected one (report, 4.2.2)."""

from __future__ import annotations

import numpy as np

from sitl import Airframe, Array
from sitl.design.lqr import hover_thrust
from sitl.lab.reproduction.equations.as_typed import jacobian, kernel_wrench
from sitl.lab.reproduction.equations.report_forward_flight import conditioning
from sitl.lab.reproduction.equations.report_forward_law import ReportForwardGains, model
from sitl.lab.reproduction.expectation import above, printed
from sitl.lab.reproduction.experiment import Panel, Recomputation, Statement
from sitl.lab.reproduction.svg_sheet import SvgSheet


def jacobian_row(a: Airframe) -> Statement:
    """The printed Jacobian against differences of the kernel's moment, at the hover."""
    T = hover_thrust(a).T1
    kernel = jacobian(lambda u_bar: _kernel_moment(2.0 * T, u_bar, a), np.zeros(3), 3)
    command = np.array([2.0 * T, 0.0, 0.0, 0.0])
    ours, printed_one = (
        float(abs(model(np.zeros(3), 0.0, command, ReportForwardGains(a, swapped=swapped))[1] - kernel).max())
        for swapped in (0, 1)
    )
    return Statement(
        "4.2.2", "dM/du as printed less the kernel's at the hover, largest entry", printed("0.00"), printed_one, "N m",
        Recomputation("M_y with T1 + T2 and T1 - T2 in their places", ours),
        note="of T1 - T2, delta1 + delta2, delta1 - delta2; signs of FLU and the yaw arm corrected",
    )  # fmt: skip


def _kernel_moment(total: float, u_bar: Array, a: Airframe) -> Array:
    """Moment of the kernel at rest for T1 + T2 [N] and u_bar = (T1 - T2, d1 + d2, d1 - d2)."""
    T = 0.5 * np.array([total + u_bar[0], total - u_bar[0]])
    deflections = 0.5 * np.array([u_bar[1] + u_bar[2], u_bar[1] - u_bar[2]])
    return kernel_wrench(np.zeros(3), np.zeros(3), T, deflections, a)[1]


def conditioning_row(a: Airframe) -> Statement:
    """The greatest condition number along the level trims."""
    ours, typed = (
        max(conditioning(a, float(speed), swapped=swapped) for speed in range(26)) for swapped in (False, True)
    )
    return Statement(
        "4.2.2", "condition number of dM/du, greatest in level flight from 0 to 25 m/s", above(1e14, "> 1e14"), ours,
        cause=Recomputation("M_y with T1 - T2 and T1 + T2 exchanged, as printed: singular at the hover", typed),
        note="by singular values; the report takes eigenvalues",
    )  # fmt: skip


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
