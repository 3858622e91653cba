"""A table of jumps drawn as a Mermaid state diagram, for the documentation."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from typing import Any, TypeVar

Mode = TypeVar("Mode", bound=Hashable)
FEW_MODES = 2  # that each draw a jump they share, be they most of the table


def mermaid(table: Mapping[Mode, tuple[Any, ...]], label: Callable[[Mode], str] = str) -> str:
    """The table, from each mode to its ordered jumps, as a Mermaid state diagram.

    Jumps between the same two modes share an arrow, in the order of the table. A jump that most modes have is drawn
    once, from a state that names the others.
    """
    sources: dict[tuple[str, str], list[str]] = {}
    for mode, jumps in table.items():
        for jump in jumps:
            sources.setdefault((jump.name, label(jump.target)), []).append(label(mode))
    groups: dict[str, str] = {}  # names of states that stand for most modes, by what they say
    arrows: dict[tuple[str, str], list[str]] = {}
    for (name, target), modes in sources.items():
        begins = modes
        if len(modes) > max(FEW_MODES, len(table) / 2):
            others = ", ".join(label(mode) for mode in table if label(mode) not in modes)
            begins = [groups.setdefault(f"all but {others}" if others else "all", f"most{len(groups) + 1}")]
        for begin in begins:
            arrows.setdefault((begin, target), []).append(name)
    lines = [f'    state "{text}" as {group}' for text, group in groups.items()]
    lines += [f"    {begin} --> {target}: {', '.join(names)}" for (begin, target), names in arrows.items()]
    return "\n".join(["stateDiagram-v2", *lines])
