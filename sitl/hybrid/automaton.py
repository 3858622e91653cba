"""Jumps as data: the discrete half of a hybrid system.

A table gives each mode its ordered jumps; a jump is its jump set (the guard), its jump map (the target and the
reset) and a name. What flows between jumps is not said here: for the vehicle it is the compiled flow, for the
textbook systems :mod:`sitl.hybrid.solution`. Both jump by this table.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from typing import Any, NamedTuple, TypeVar

from sitl.errors import ZenoError

Mode = TypeVar("Mode", bound=Hashable)


def unchanged(x: Any) -> Any:  # noqa: ANN401 - the identity of whatever the table's states are
    """The jump map of a jump that changes the mode alone."""
    return x


class Jump(NamedTuple):
    """One row of a table."""

    name: str
    guard: Callable[[Any], bool]  # whether the state is in the jump set
    target: Any  # mode after the jump
    reason: Any = None  # said when the jump is recorded
    reset: Callable[[Any], Any] = unchanged  # state after the jump


Table = Mapping[Mode, tuple[Jump, ...]]


def enabled(table: Table[Mode], mode: Mode, x: object) -> Jump | None:
    """The jump that ``x`` must take in ``mode``: the first whose guard holds; None in the flow set.

    Jumps have priority over flow, earlier rows over later ones, so that solutions are unique.
    """
    return next((jump for jump in table[mode] if jump.guard(x)), None)


def settle(table: Table[Mode], mode: Mode, x: object) -> tuple[Mode, list[Jump]]:
    """Take enabled jumps, their resets applied, until none is enabled, at one instant.

    Args:
        table: Ordered jumps of every mode.
        mode: Where to begin.
        x: What the guards look at.

    Returns:
        The mode reached and the jumps taken, in order.

    Raises:
        ZenoError: If more jumps than there are modes would be taken: then some mode came twice.
    """
    taken: list[Jump] = []
    while (jump := enabled(table, mode, x)) is not None:
        taken.append(jump)
        mode, x = jump.target, jump.reset(x)
        if len(taken) > len(table):
            raise ZenoError(f"jumps without end: {' -> '.join(j.name for j in taken)} at {x}")
    return mode, taken


def mermaid(table: Mapping[Mode, tuple[Any, ...]], label: Callable[[Mode], str] = str) -> str:
    """The table as a Mermaid state diagram, for the documentation."""
    lines = ["stateDiagram-v2"]
    lines += [
        f"    {label(mode)} --> {label(jump.target)}: {jump.name}" for mode, jumps in table.items() for jump in jumps
    ]
    return "\n".join(lines)
