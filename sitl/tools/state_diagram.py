"""A table of jumps drawn as a Mermaid state diagram, for the documentation."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from typing import Any, TypeVar

Mode = TypeVar("Mode", bound=Hashable)


def mermaid(table: Mapping[Mode, tuple[Any, ...]], label: Callable[[Mode], str] = str) -> str:
    """The table, from each mode to its ordered jumps, as a Mermaid state diagram."""
    lines = ["stateDiagram-v2"]
    lines += [
        f"    {label(mode)} --> {label(jump.target)}: {jump.name}" for mode, jumps in table.items() for jump in jumps
    ]
    return "\n".join(lines)
