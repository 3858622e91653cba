"""The sigmoids of the quasi time-optimal governor (report, section 3.2.1, figure 3.7)."""

from __future__ import annotations

import math

import numpy as np

from sitl.control.governor import arctan_sigmoid, gompertz
from sitl.model.airframe import Array
from sitl.reproduction.experiment import Experiment, ExperimentResult, Panel, judge
from sitl.reproduction.svg_sheet import SvgSheet
from sitl.scenarios.scenario import Finding

SIGMOID_LIMIT = 1.0  # M: with the printed c = 1 the only one the report can have drawn


def printed_gompertz(x: Array, M: float = SIGMOID_LIMIT) -> Array:
    """The Gompertz function as the report prints it: b = -ln(1/2), c = 1."""
    return np.asarray(2.0 * M * np.exp(-np.exp(math.log(2.0) - x)) - M)


def run(seed: int) -> ExperimentResult:  # noqa: ARG001 - nothing here is random
    """Value, slope and symmetry at zero, and the distance to the discontinuous saturation."""
    x = np.linspace(-6.0, 6.0, 1201)
    hard = np.clip(x, -SIGMOID_LIMIT, SIGMOID_LIMIT)
    ours = np.array([gompertz(value, SIGMOID_LIMIT) for value in x])
    arctan = np.array([arctan_sigmoid(value, SIGMOID_LIMIT) for value in x])
    typed = printed_gompertz(x)
    step = 1e-5
    slope = (gompertz(step, SIGMOID_LIMIT) - gompertz(-step, SIGMOID_LIMIT)) / (2.0 * step)
    at_zero = float(printed_gompertz(np.zeros(1))[0])
    corrected = gompertz(0.0, SIGMOID_LIMIT)
    place = "3.2.1"
    nearer, typed_nearer = (_area(x, curve - hard) / _area(x, arctan - hard) for curve in (ours, typed))
    statements = [
        judge(
            place,
            Finding("printed Gompertz at zero", at_zero, "M", "0", abs(at_zero) < 1e-6),
            "b = -ln(1/2) should be ln(ln 2): as printed the law pushes at the target itself",
        ),
        judge(place, Finding("corrected Gompertz at zero", corrected, "M", "0", corrected == 0.0)),
        judge(
            place,
            Finding("slope at zero, corrected", slope, "", "1", abs(slope - 1.0) < 1e-3),
            "c = 1 / (M ln 2); with the printed c = 1 the slope depends on M",
        ),
        judge(
            place,
            Finding("area to the hard saturation, Gompertz over arctan", nearer, "", "< 1", nearer < 1.0),
            "mirrored to be odd: a Gompertz function is not",
        ),
        judge(
            place,
            Finding("the same, Gompertz as printed", typed_nearer, "", "< 1", typed_nearer < 1.0),
            "its right half is close, its left half and its offset are not: the claim needs the correction",
        ),
    ]  # fmt: skip
    sheet = SvgSheet("sigmoids", height=3.2)
    with sheet as axes:
        for curve, label, style in (
            (hard, "saturation", ":"), (ours, "Gompertz, corrected", "-"), (arctan, "arctan", "-"),
            (typed, "Gompertz, as printed", "--"),
        ):  # fmt: skip
            axes[0].plot(x, curve, style, label=label)
        axes[0].set(xlabel="x / M", ylabel="sigma / M")
        axes[0].legend(loc="lower right")
        axes[0].grid(alpha=0.2)
    panel = Panel(
        "3.7", "Comparison of two sigmoid functions",
        "The Gompertz function comes closer to the discontinuous saturation than the arctangent.",
        f"True of the corrected one: {nearer:.2f} of the arctangent's area. The printed one does not "
        f"pass through zero ({at_zero:+.2f} M there).", sheet.svg,
    )  # fmt: skip
    return ExperimentResult(statements, [panel])


def _area(x: Array, gap: Array) -> float:
    return float(np.abs(gap).sum() * (x[1] - x[0]))


GOVERNOR_SIGMOIDS = Experiment(
    "sigmoids",
    "Sigmoids of the saturation",
    "3.2.1",
    "The governor saturates with a sigmoid. The report prefers a Gompertz function to the arctangent because it is "
    "nearer to a saturation. Its printed constants do not make it vanish at zero.",
    run,
)
