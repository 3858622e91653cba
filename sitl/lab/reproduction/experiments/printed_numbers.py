"""The report's printed numbers and matrices beside those of this model."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sitl import Airframe, Array
from sitl.defaults import AIRFRAME
from sitl.design import linearise
from sitl.design.lqr import hover_thrust, lqr
from sitl.design.trim import level_trim
from sitl.lab.reproduction.equations.as_typed import (
    A_SLIPS,
    B_SLIPS,
    DIGIT,
    HOVER_SLIPS,
    PRINTED_A,
    PRINTED_B,
    PRINTED_GAIN,
    PRINTED_INVERSE,
    PRINTED_SPEED,
    PRINTED_START,
    PRINTED_TILT,
    PRINTED_TURN,
    Slip,
    forward_matrices,
    kernel_wrench,
    typed_force_matrix,
    typed_hover_linearisation,
    typed_moment_matrix,
    typed_trim,
)
from sitl.lab.reproduction.experiment import (
    EDGE,
    REPORT_SET,
    Conditions,
    EntryTable,
    Experiment,
    ExperimentResult,
    Illustration,
    Panel,
    Recomputation,
    Statement,
    above,
    all_of,
    below,
    printed,
)
from sitl.lab.reproduction.flight_panels import SvgSheet
from sitl.model.quaternions import from_euler

# The numbers that the report prints about its models: gains, trims, linear models (chapters 3 and 4).

# The report's printed matrices, entry by entry, beside the kernel that flies, without and with the report's slips.


FORWARD_STATE_NAMES = ("p_z", "v_x", "v_y", "v_z", "e_1", "e_2", "e_3", "w_x", "w_y", "w_z")
HOVER_STATE_NAMES = ("p_x", "p_y", *FORWARD_STATE_NAMES)
INPUT_NAMES = ("T1", "T2", "d1", "d2")
VIRTUAL_INPUT_NAMES = ("T1", "T2", "d1 T1", "d2 T2")
MOMENT_NAMES = ("M_x", "M_y", "M_z")
SYMBOLS_AGREE = 1e-4  # what is printed in symbols must agree to the accuracy of our differences
BY_YAW = (slice(2, 4), 2)  # the two entries +-1.49 of the pseudo-inverse
TableOf = Callable[[frozenset[Slip]], Array]


def agreeing(ours: Array, printed_entries: Array, digit: float = DIGIT) -> float:
    """Number of entries that would be printed as the report prints them."""
    return float((np.abs(ours - printed_entries) <= digit + EDGE).sum())


def hover_model_rows(a: Airframe) -> list[Statement]:
    """A of section 3.1.2, which is printed in symbols."""
    symbols = np.zeros((12, 12))
    symbols[0:3, 3:6], symbols[3:6, 6:9], symbols[6:9, 9:12] = np.eye(3), a.g * PRINTED_TILT, PRINTED_TURN
    counts = [
        agreeing(typed_hover_linearisation(a, slips)[0], symbols, SYMBOLS_AGREE)
        for slips in (frozenset[Slip](), frozenset({Slip.STILL_ETA}))
    ]
    return [
        Statement(
            "3.1.2", "A at the hover, entries", all_of(144), counts[0],
            cause=Recomputation(Slip.STILL_ETA.value, counts[1]),
            note="printed in symbols: compared to 1e-4; dv_z/deps_2 = -sqrt2 g is the one that differs",
        )
    ]  # fmt: skip


def gain(a: Airframe, slips: frozenset[Slip]) -> Array:
    """The LQR gain for Q = I, R = I, (4, 12)."""
    return lqr(*typed_hover_linearisation(a, slips), np.eye(12), np.eye(4))[0]


def gain_rows(a: Airframe) -> tuple[list[Statement], EntryTable]:
    """The printed LQR gain; and whether it stabilises the plant that flies."""
    digits = np.delete(PRINTED_GAIN, 6, axis=1)
    row, table = _compared(
        "3.1.3", "LQR gain", digits, lambda slips: gain(a, slips), HOVER_SLIPS, VIRTUAL_INPUT_NAMES, HOVER_STATE_NAMES
    )
    return [row], table


def forward_rows(a: Airframe) -> tuple[list[Statement], list[EntryTable]]:
    """A and B of section 4.1."""
    states = FORWARD_STATE_NAMES
    A, A_table = _compared(
        "4.1", "A at 5 m/s", PRINTED_A, lambda slips: forward_matrices(a, slips)[0], A_SLIPS, states, states
    )
    B, B_table = _compared(
        "4.1", "B at 5 m/s", PRINTED_B, lambda slips: forward_matrices(a, slips)[1], B_SLIPS, states, INPUT_NAMES
    )
    return [A, B], [A_table, B_table]


def inverse(a: Airframe, slips: frozenset[Slip]) -> Array:
    """The pseudo-inverse of M_b, (4, 3), without the slip of the roll term: it is printed without it."""
    return np.asarray(np.linalg.pinv(typed_moment_matrix(a, slips)))


def inverse_rows(a: Airframe, table_set: Airframe) -> tuple[list[Statement], EntryTable]:
    """The pseudo-inverse of M_b, by the constants that fly and by those of appendix A.

    Args:
        a: The published constants.
        table_set: Those of appendix A.
    """
    arm = frozenset({Slip.YAW_ARM})
    _, table = _compared("3.2", "Pseudo-inverse of M_b", PRINTED_INVERSE, lambda slips: inverse(a, slips), arm,
                         VIRTUAL_INPUT_NAMES, MOMENT_NAMES)  # fmt: skip
    ours, slipped = (inverse(a, slips) for slips in (frozenset[Slip](), arm))
    by_table = _others_agreeing(inverse(table_set, arm))
    rows = [
        Statement(
            "3.2", "pseudo-inverse of M_b, entries but two", all_of(10), _others_agreeing(ours),
            cause=Recomputation(Slip.YAW_ARM.value, _others_agreeing(slipped)),
        ),
        Statement(
            "3.2", "pseudo-inverse of M_b, delta T by yaw", printed("1.49"), float(abs(ours[BY_YAW][0])), "1/m",
            Recomputation(Slip.YAW_ARM.value, float(abs(slipped[BY_YAW][0]))),
        ),
        Statement(
            "appendix A", "the same ten entries by the constants of appendix A", all_of(10), by_table,
            cause=Recomputation(
                "ENAC's constants: S_p = pi 0.125^2 m2, xi_f 0.48, xi_m 0.93, Diederich's C_l",
                _others_agreeing(slipped),
            ),
            note=f"{Slip.YAW_ARM.value}, as above",
        ),
    ]  # fmt: skip
    return rows, table


def _others_agreeing(ours: Array) -> float:
    return agreeing(ours, PRINTED_INVERSE) - agreeing(ours[BY_YAW], PRINTED_INVERSE[BY_YAW])


def _variants(slips: frozenset[Slip]) -> list[frozenset[Slip]]:
    """None of the slips, all, and all but one."""
    return [frozenset(), slips, *(slips - {slip} for slip in sorted(slips, key=lambda slip: slip.name))]


def _compared(
    place: str, name: str, digits: Array, made: TableOf, slips: frozenset[Slip], rows: tuple[str, ...],
    columns: tuple[str, ...],
) -> tuple[Statement, EntryTable]:  # fmt: skip
    """A matrix as one statement, and its entries that are not printed as zero as a table."""
    by_slips = {variant: made(variant) for variant in _variants(slips)}
    plain, slipped = by_slips[frozenset()], by_slips[slips]
    statement = Statement(
        place, f"{name}, entries", all_of(digits.size), agreeing(plain, digits),
        cause=Recomputation("; ".join(sorted(slip.value for slip in slips)), agreeing(slipped, digits)),
        note="entry by entry below",
    )  # fmt: skip
    lines = []
    for i, j in np.argwhere(digits != 0.0):
        close = {variant: abs(M[i, j] - digits[i, j]) <= DIGIT + EDGE for variant, M in by_slips.items()}
        needed = [slip.name.lower() for slip in slips if not close[slips - {slip}]]
        if close[frozenset()]:
            verdict = "kernel"
        else:
            verdict = f"slips: {', '.join(sorted(needed)) or 'any of several'}" if close[slips] else "neither"
        numbers = (f"{digits[i, j]:.2f}", f"{plain[i, j]:.3f}", f"{slipped[i, j]:.3f}")
        lines.append((f"{rows[i]}, {columns[j]}", *numbers, verdict))
    head = ("entry", "report", "kernel that flies", "with the slips", "agrees by")
    return statement, EntryTable(f"{name}: the entries that are not printed as zero", head, lines)


KERNEL = frozenset[Slip]()
TRIM_SLIPS = f"{Slip.ONE_NUMBER.value}; {Slip.AREA.value}"
START_ANGLES = (10.0, -45.0, 25.0)  # roll, pitch, yaw in the text of section 3.2.2 [deg]
PRINTED_ANGLES = (20.0, -45.0, 10.0)  # of the quaternion beside them, once its third entry has its sign [deg]


def run(conditions: Conditions) -> ExperimentResult:
    """Every printed matrix and trim, by the kernel that flies and with the report's slips switched on."""
    a, nominal = conditions.airframe(REPORT_SET), conditions.airframe("nominal")
    inverse, inverse_table = inverse_rows(a, conditions.airframe("report-table"))
    gains, gain_table = gain_rows(a)
    forward, forward_tables = forward_rows(a)
    statements = [
        *_structure(a), *hover_model_rows(a), *gains, _stabilised(a), *inverse, _kappa(a), _start(), *_trim(a),
        *forward,
    ]  # fmt: skip
    return ExperimentResult(
        statements, [_trims(a, nominal)], _illustrations(conditions), [gain_table, inverse_table, *forward_tables]
    )


def _structure(a: Airframe) -> list[Statement]:
    A, B = typed_hover_linearisation(a, KERNEL)
    reached = np.hstack([np.linalg.matrix_power(A, k) @ B for k in range(12)])
    ranks = [float(np.linalg.matrix_rank(X)) for X in (typed_force_matrix(a), typed_moment_matrix(a, KERNEL), reached)]
    pair = np.full(2, hover_thrust(a).T1)
    force, moment = kernel_wrench(np.zeros(3), np.zeros(3), pair, np.zeros(2), a)
    weight = a.m * a.g
    return [
        Statement("2.2.1", "rank of F_b of the kernel at rest", printed("2"), ranks[0]),
        Statement("2.2.1", "rank of M_b of the kernel at rest", printed("3"), ranks[1]),
        Statement("3.1.1", "moment of (1, 1, 0, 0) at the hover, kernel", printed("0.00"), float(abs(moment).max()),
                  "N m"),
        Statement("3.1.1", "force of the hover's thrusts over the weight, kernel", printed("1.000"),
                  float(force[0]) / weight),
        Statement("3.1.1", "both thrusts of the hover over the weight", above(1.0, "more than the weight"),
                  float(pair.sum()) / weight),
        Statement("3.1.2", "rank of the controllability matrix at the hover", printed("12"), ranks[2]),
    ]  # fmt: skip


def _stabilised(a: Airframe) -> Statement:
    A, B = typed_hover_linearisation(a, KERNEL)
    slowest = float(np.linalg.eigvals(A - B @ np.delete(PRINTED_GAIN, 6, axis=1)).real.max())
    return Statement("5.1", "slowest pole of the printed gain on the kernel", below(0.0, "A - B K is Hurwitz"), slowest,
                     "1/s")  # fmt: skip


def _kappa(a: Airframe) -> Statement:
    """Force of the kernel for the distribution's u_bar f."""
    one_each = float(kernel_wrench(np.zeros(3), np.zeros(3), np.ones(2), np.zeros(2), a)[0][0])
    kappa = float(np.linalg.norm(typed_force_matrix(a) @ [1.0, 1.0, 0.0, 0.0]))
    return Statement("3.2", "force of u_bar f over f, kernel, with the printed kappa", printed("1.00"),
                     kappa * one_each, cause=Recomputation("kappa = 1 / |F_b (1, 1, 0, 0)|", one_each / kappa),
                     note="kappa normalises the vector")  # fmt: skip


def _trim(a: Airframe) -> list[Statement]:
    ours, slipped = typed_trim(a, KERNEL), typed_trim(a)
    nose = math.degrees(slipped[0])
    return [
        Statement("4.1", "trim at 5 m/s, nose", printed("62.67"), math.degrees(ours[0]), "deg",
                  Recomputation(f"{Slip.AREA.value}; and cut after two decimals, not rounded: {nose:.3f}", _cut(nose))),
        Statement("4.1", "trim at 5 m/s, thrust", printed("2.18"), ours[1], "N", Recomputation(TRIM_SLIPS, slipped[1])),
        Statement("4.1", "trim at 5 m/s, elevon", printed("0.92"), ours[2], "rad",
                  Recomputation(TRIM_SLIPS, slipped[2]), note="0.92 rad would be 53 deg, beyond the stop at 30 deg"),
    ]  # fmt: skip


def _cut(value: float) -> float:
    return math.floor(100.0 * value) / 100.0


def _start() -> Statement:
    ours, intended = (np.array(from_euler(*np.radians(angles).tolist())) for angles in (START_ANGLES, PRINTED_ANGLES))
    roll, pitch, yaw = PRINTED_ANGLES
    return Statement(
        "3.2.2", "entries of the quaternion of roll 10, pitch -45, yaw 25 deg", all_of(4),
        agreeing(ours, PRINTED_START),
        cause=Recomputation(
            f"of roll {roll:.0f}, pitch {pitch:.0f}, yaw {yaw:.0f} deg, the sign of the third entry lost",
            agreeing(_unsigned(intended), PRINTED_START),
        ),
        note="ZYX gives " + ", ".join(f"{x:.3f}" for x in ours),
    )  # fmt: skip


def _unsigned(q: Array) -> Array:
    return np.array([q[0], q[1], abs(q[2]), q[3]])


def _entries(a: Airframe) -> float:
    """Number of entries of A and B that the plant's linear model at 5 m/s shares with the printed ones."""
    linear = linearise.forward(a, level_trim(a, PRINTED_SPEED))
    return sum(agreeing(M, digits) for M, digits in zip(linear, (PRINTED_A, PRINTED_B), strict=True))


def _illustrations(conditions: Conditions) -> list[Illustration]:
    table, published = conditions.airframe("report-table"), conditions.airframe(REPORT_SET)
    flies = float(sum(level_trim(table, float(speed)).exists for speed in range(5, 21)))
    reach = math.degrees(level_trim(published, 7.0).delta)
    return [
        *(
            Illustration("4.1", f"entries of A and B by the kernel with the set '{name}'",
                         _entries(conditions.airframe(name)), "of 140", "", text)
            for name, text in (
                ("nominal", "the report's model with a level trim at every speed; most entries are the zeros"),
                (AIRFRAME, "the set for flying: propeller, stall and damping are not the report's"),
            )
        ),
        Illustration("appendix A", "level trims of the printed table, 5 to 20 m/s", flies, "of 16", "",
                     "the report trims one speed only, with other constants than these"),
        Illustration("2.1.2", "elevon for level flight at 7 m/s, published constants", reach, "deg", "stops at 30 deg",
                     "the published constants fly level below 5.1 and above 9.3 m/s; the set 'nominal' at every speed"),
    ]  # fmt: skip


def _trims(published: Airframe, nominal: Airframe) -> Panel:
    speeds = np.linspace(0.0, 25.0, 126)
    sheet = SvgSheet("trims", 3, height=1.8)
    with sheet as axes:
        for name, a in (("nominal", nominal), ("published", published)):
            trims = [level_trim(a, float(speed)) for speed in speeds]
            axes[0].plot(speeds, [math.degrees(trim.theta) for trim in trims], label=name)
            axes[1].plot(speeds, [trim.thrust for trim in trims], label=name)
            axes[2].plot(speeds, [math.degrees(trim.delta) for trim in trims], label=name)
        for axis, point in zip(axes, (62.67, 2.18, math.degrees(0.92 / 2.18)), strict=True):
            axis.plot([5.0], [point], "x", color="crimson", label="printed")
            axis.grid(alpha=0.2)
        axes[2].axhline(math.degrees(nominal.delta_max), linestyle="--", linewidth=0.8)
        for axis, label in zip(axes, ("nose [deg]", "thrust [N]", "elevon [deg]"), strict=True):
            axis.set_ylabel(label)
        axes[0].legend()
        axes[2].set_xlabel("level airspeed [m/s]")
    margin = math.degrees(min(level_trim(nominal, float(speed)).margin for speed in speeds))
    return Panel(
        "", "Level trims of both parameter sets, with the printed point at 5 m/s",
        "One trim is printed, at 5 m/s; the elevon's 0.92 is shown as delta T / T.",
        "The corridor between 4.5 and 7 m/s decides how the vehicle may slow down: the nominal set passes it with "
        f"{margin:.1f} deg of elevon to spare, the published one cannot.", sheet.svg,
    )  # fmt: skip


PRINTED_NUMBERS = Experiment(
    "matrices",
    "Printed numbers of the models",
    "2.2, 3.1, 3.2, 4.1, appendix A",
    "Every matrix and trim of the document, computed from the kernel that flies with the set 'published'. Where it "
    "differs, the same is computed again with slips of the report switched on in that kernel, one by one.",
    run,
    airframes=("nominal", AIRFRAME, REPORT_SET, "report-table"),
)
