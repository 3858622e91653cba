"""The sigmoids of the quasi time-optimal governor (report, section 3.2.1, figure 3.7)."""

from __future__ import annotations

import math

import numpy as np

from sitl import Array
from sitl.control.governor import arctan_sigmoid, gompertz
from sitl.lab.reproduction.expectation import below
from sitl.lab.reproduction.experiment import Conditions, Experiment, ExperimentResult, Panel, Recomputation, Statement
from sitl.lab.reproduction.svg_sheet import SvgSheet

SIGMOID_LIMIT = 1.0  # M: with the printed c = 1 the only one the report can have drawn


def printed_gompertz(x: Array, M: float = SIGMOID_LIMIT) -> Array:
    """The Gompertz function as the report prints it: b = -ln(1/2), c = 1."""
    return np.asarray(2.0 * M * np.exp(-np.exp(math.log(2.0) - x)) - M)


def run(conditions: Conditions) -> ExperimentResult:  # noqa: ARG001 - it depends on nothing
    """The distance of both sigmoids to the discontinuous saturation."""
    x = np.linspace(-6.0, 6.0, 1201)
    hard = np.clip(x, -SIGMOID_LIMIT, SIGMOID_LIMIT)
    ours = np.array([gompertz(value, SIGMOID_LIMIT) for value in x])
    arctan = np.array([arctan_sigmoid(value, SIGMOID_LIMIT) for value in x])
    typed = printed_gompertz(x)
    nearer, typed_nearer = (_area(x, curve - hard) / _area(x, arctan - hard) for curve in (ours, typed))
    statement = Statement(
        "3.2.1", "area to the hard saturation, Gompertz as printed over arctan", below(1.0, "nearer than the arctan"),
        typed_nearer,
        cause=Recomputation("b = ln ln 2, c = 1 / (M ln 2), made odd: it vanishes at zero, with slope one", nearer),
    )  # fmt: skip
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
        f"pass through zero ({float(printed_gompertz(np.zeros(1))[0]):+.2f} M there).", sheet.svg,
    )  # fmt: skip
    return ExperimentResult([statement], [panel])


def _area(x: Array, gap: Array) -> float:
    return float(np.abs(gap).sum() * (x[1] - x[0]))


GOVERNOR_SIGMOIDS = Experiment(
    "sigmoids",
    "Sigmoids of the saturation",
    "3.2.1",
    "The governor saturates with a sigmoid. The report prefers a Gompertz function to the arctangent because it is "
    "nearer to a saturation. Its printed constants do not make it vanish at zero.",
    run,
    airframes=(),
)
