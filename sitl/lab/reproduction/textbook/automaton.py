"""Jumps as data: the discrete half of a hybrid system.

A table gives each mode its ordered jumps. A jump has a jump set (``is_due``), a jump map (``target`` and ``after``)
and a name. The flow between jumps is :mod:`sitl.lab.reproduction.textbook.solution`.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from typing import Any, NamedTuple, TypeVar

from sitl import ZenoError

Mode = TypeVar("Mode", bound=Hashable)


def unchanged(x: Any) -> Any:  # noqa: ANN401 - a table's states have any type
    """The jump map of a jump that changes only the mode."""
    return x


class GuardedJump(NamedTuple):
    """One row of a table."""

    name: str
    is_due: Callable[[Any], bool]  # whether the state is in the jump set
    target: Any  # mode after the jump
    reason: Any = None  # recorded with the jump
    after: Callable[[Any], Any] = unchanged  # state after the jump


JumpTable = Mapping[Mode, tuple[GuardedJump, ...]]


def enabled(table: JumpTable[Mode], mode: Mode, x: object) -> GuardedJump | None:
    """The jump that ``x`` takes in ``mode``: the first whose guard holds; None in the flow set.

    Jumps have priority over flow, and earlier jumps over later ones, so that solutions are unique.
    """
    return next((jump for jump in table[mode] if jump.is_due(x)), None)


def settle(table: JumpTable[Mode], mode: Mode, x: object) -> tuple[Mode, list[GuardedJump]]:
    """Take jumps and apply their resets, at one instant, until no jump is enabled.

    Args:
        table: Ordered jumps of every mode.
        mode: To begin in.
        x: The state that the guards see.

    Returns:
        The mode reached and the jumps taken, in order.

    Raises:
        ZenoError: If there are more jumps than modes: then some mode came twice.
    """
    taken: list[GuardedJump] = []
    while (jump := enabled(table, mode, x)) is not None:
        taken.append(jump)
        mode, x = jump.target, jump.after(x)
        if len(taken) > len(table):
            raise ZenoError(f"jumps without end: {' -> '.join(j.name for j in taken)} at {x}")
    return mode, taken
