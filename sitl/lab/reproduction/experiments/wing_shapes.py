"""Straight wing against arc-shaped wing (report, appendix C).

The arc's elevons are canted, so that [xi] delta gets two more components: Delta = xi delta [(1, 1, 1)]× instead of
xi delta [(0, 1, 0)]×. The report finds the same matrices and concludes that the shape has no influence.
"""

from __future__ import annotations

import numpy as np

from sitl import Airframe, Array
from sitl.lab.reproduction.equations.as_typed import cross_matrix
from sitl.lab.reproduction.experiment import (
    REPORT_SET,
    Conditions,
    Experiment,
    ExperimentResult,
    Illustration,
    Panel,
    Recomputation,
    Statement,
    printed,
)
from sitl.lab.reproduction.flight_panels import SvgSheet
from sitl.model.aerodynamics import force_matrix, moment_matrix

STRAIGHT_HINGE, ARC_HINGE = np.array([0.0, 1.0, 0.0]), np.array([1.0, 1.0, 1.0])
TRIAL_C_Y0 = 0.1  # for comparison with the report's zero


def input_matrices(a: Airframe, hinge: Array) -> tuple[Array, Array]:
    """F_b and M_b, (3, 4), of u = (T1, T2, delta1 T1, delta2 T2), for elevons hinged about an axis.

    Args:
        a: The airframe.
        hinge: Axis of Delta = xi delta [hinge]×, (3,).
    """
    F, M = force_matrix(a), moment_matrix(a)
    for i, side in enumerate((1.0, -1.0)):
        per_force, per_moment = _elevon(a, hinge, np.array([1.0, 0.0, 0.0]), side)
        F[:, 2 + i], M[:, 2 + i] = a.S_ratio * per_force, a.S_ratio * per_moment
    return F, M


def airspeed_matrices(a: Airframe, hinge: Array, v_b: Array) -> tuple[Array, Array]:
    """Force and moment per deflection in the free stream, each (3, 2)."""
    quarter = 0.25 * a.rho * a.S * float(np.linalg.norm(v_b))
    columns = [_elevon(a, hinge, v_b, side) for side in (1.0, -1.0)]
    return quarter * np.array([c[0] for c in columns]).T, quarter * np.array([c[1] for c in columns]).T


def _elevon(a: Airframe, hinge: Array, stream: Array, side: float) -> tuple[Array, Array]:
    """Phi(fv) Delta and [a_i] Phi(fv) Delta + B Phi(mv) Delta on a stream, per unit of delta."""
    turned = cross_matrix(hinge) @ stream
    force = a.xi_f * np.array([a.C_d0, a.C_y0, a.C_l]) * turned
    moment = np.cross([0.0, side * a.a_y, 0.0], force)
    moment += a.xi_m * a.Delta_r * np.array([0.0, a.C_l * turned[2], -a.b / a.c * a.C_y0 * turned[1]])
    return np.asarray(force), np.asarray(moment)


def run(conditions: Conditions) -> ExperimentResult:
    """The matrices of both shapes at the hover and in the free stream."""
    a = conditions.airframe(REPORT_SET)
    hover = _difference(input_matrices(a, STRAIGHT_HINGE), input_matrices(a, ARC_HINGE))
    sided = a._replace(C_y0=TRIAL_C_Y0)
    lateral = _difference(input_matrices(sided, STRAIGHT_HINGE), input_matrices(sided, ARC_HINGE))
    slipping = np.array([20.0, 3.5, -2.0])  # 10 deg of sideslip
    roll = float(
        airspeed_matrices(a, ARC_HINGE, slipping)[1][0, 0] / airspeed_matrices(a, STRAIGHT_HINGE, slipping)[1][0, 0]
    )
    at_rest = float(moment_matrix(a)[0, 2] / input_matrices(a, ARC_HINGE)[1][0, 2])
    statement = Statement(
        "appendix C", "roll by elevon, arc over straight, at 20 m/s and 10 deg of sideslip", printed("1.00"), roll,
        cause=Recomputation("without airspeed, as in the matrices that appendix C compares", at_rest),
        note="the report: the shape has no influence on the command",
    )  # fmt: skip
    illustrations = [
        Illustration("appendix C", "largest difference of F_b and M_b", hover, "", "exactly the same",
                     "with C_y0 = 0 an identity of the printed algebra"),
        Illustration("appendix C", f"the same with C_y0 = {TRIAL_C_Y0}", lateral, "", "exactly the same",
                     "the canted elevons push sideways as much as C_y0 lets them"),
    ]  # fmt: skip
    return ExperimentResult([statement], [_panel(a)], illustrations)


def _difference(one: tuple[Array, Array], other: tuple[Array, Array]) -> float:
    return float(max(np.abs(x - y).max() for x, y in zip(one, other, strict=True)))


def _panel(a: Airframe) -> Panel:
    angles = np.radians(np.linspace(-20.0, 20.0, 81))
    sheet = SvgSheet("shapes", height=2.6)
    with sheet as axes:
        for name, hinge in (("straight", STRAIGHT_HINGE), ("arc", ARC_HINGE)):
            values = []
            for angle in angles:
                v_b = 20.0 * np.array([np.cos(angle), np.sin(angle), -0.1])
                _, M = airspeed_matrices(a, hinge, v_b)
                values.append(abs(M[0, 0]))
            axes[0].plot(np.degrees(angles), values, label=name)
        axes[0].set(xlabel="sideslip at 20 m/s [deg]", ylabel="roll per left elevon [N m/rad]")
        axes[0].legend()
        axes[0].grid(alpha=0.2)
    return Panel(
        "", "Roll by the left elevon over sideslip, straight wing and arc",
        "The shape of the wing has no influence on the command.",
        "In flight with sideslip the arc's elevons see the lateral stream.",
        sheet.svg,
    )  # fmt: skip


WING_SHAPES = Experiment(
    "straight-or-arc",
    "Straight wing against arc",
    "appendix C",
    "Appendix C derives the input matrices of an arc-shaped vehicle and finds those of the straight one.",
    run,
)
