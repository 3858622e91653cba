"""The report's printed matrices, entry by entry, beside the kernel that flies, without and with the report's slips."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sitl import Airframe, Array
from sitl.design.lqr import lqr
from sitl.lab.reproduction.equations.as_typed import (
    A_SLIPS,
    B_SLIPS,
    HOVER_SLIPS,
    Slip,
    forward_matrices,
    typed_hover_linearisation,
    typed_moment_matrix,
)
from sitl.lab.reproduction.equations.printed_matrices import (
    DIGIT,
    PRINTED_A,
    PRINTED_B,
    PRINTED_GAIN,
    PRINTED_INVERSE,
    PRINTED_TILT,
    PRINTED_TURN,
)
from sitl.lab.reproduction.expectation import EDGE, all_of, printed
from sitl.lab.reproduction.experiment import EntryTable, Recomputation, Statement

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
