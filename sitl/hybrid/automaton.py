"""A discrete state with a table of jumps: what the vehicle's supervisor is made of.

Between jumps something else flows; here only the jump map and the jump set are data: each law has an ordered
tuple of jumps, and the first whose guard holds is taken, again and again until none holds.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from typing import Any, NamedTuple, TypeVar

from sitl.errors import SitlError

Mode = TypeVar("Mode", bound=Hashable)


class ZenoError(SitlError):
    """Jumps without end at one instant: the table's hysteresis is broken."""


class Jump(NamedTuple):
    """One row of a table."""

    name: str
    guard: Callable[[Any], bool]
    target: Any
    reason: Any = None


def settle(table: Mapping[Mode, tuple[Jump, ...]], mode: Mode, x: object) -> tuple[Mode, list[Jump]]:
    """Take enabled jumps, the first match of each mode, until none is enabled.

    Args:
        table: Ordered jumps of every mode.
        mode: Where to begin.
        x: What the guards look at; it does not change while jumps are taken.

    Returns:
        The mode reached and the jumps taken, in order.

    Raises:
        ZenoError: If more jumps than there are modes would be taken: then some mode came twice.
    """
    taken: list[Jump] = []
    while (jump := next((j for j in table[mode] if j.guard(x)), None)) is not None:
        taken.append(jump)
        mode = jump.target
        if len(taken) > len(table):
            raise ZenoError(f"jumps without end: {' -> '.join(j.name for j in taken)} at {x}")
    return mode, taken


def mermaid(table: Mapping[Mode, tuple[Jump, ...]], label: Callable[[Mode], str] = str) -> str:
    """The table as a Mermaid state diagram, for the documentation."""
    lines = ["stateDiagram-v2"]
    lines += [
        f"    {label(mode)} --> {label(jump.target)}: {jump.name}" for mode, jumps in table.items() for jump in jumps
    ]
    return "\n".join(lines)
