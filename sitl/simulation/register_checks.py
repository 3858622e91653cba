"""Checks of a register of laws: unknown or repeated names, which the generated code would mix up silently."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from sitl.control.laws import Gains, LawRow, LawStates
from sitl.errors import SitlError
from sitl.simulation.flight import Controller
from sitl.supervisor.table import Jump


def check(
    laws: Sequence[LawRow], table: Mapping[Any, tuple[Jump, ...]], states: Iterable[str], gains: Iterable[str]
) -> None:
    """Refuse what does not fit together.

    Args:
        laws: The rows of the laws.
        table: Their jumps.
        states: Names of the state slots besides those of LawStates.
        gains: Names of the gains besides those of Gains.

    Raises:
        SitlError: If a number, a name or a guard's bit stands for two things, or something is named that is not there.
    """
    jumps = [(law, jump) for law, rows in table.items() for jump in rows]
    guards = [guard for _, jump in jumps for guard in (*jump.when, *jump.unless)]
    resets = [reset for _, jump in jumps for reset in jump.resets]
    _refuse_twins("law number", laws, lambda row: int(row.law))
    _refuse_twins("law name", laws, lambda row: row.law.name)
    _refuse_twins("guard name", guards, lambda guard: guard.name)
    _refuse_twins("guard bit", guards, lambda guard: guard.bit)
    _refuse_twins("reset name", resets, lambda reset: reset.name)
    for kind, added, own in (("state slot", states, LawStates._fields), ("gains", gains, Gains._fields)):
        if taken := sorted(set(added) & set(own)):
            raise SitlError(f"{kind} {taken[0]!r} is there already")
    known = {row.law for row in laws}
    for law, jump in jumps:
        if jump.target not in known:
            raise SitlError(f"jump {jump.name!r} of {law.name} leads to {jump.target!r}: it is not registered")
    if missing := [row.law.name for row in laws if row.law not in table]:
        raise SitlError(f"no row of the table for {', '.join(missing)}: a law needs at least its way out")
    for row in laws:
        if row.gains and row.gains not in (every := (*Gains._fields, *gains)):
            raise SitlError(f"law {row.law.name} takes gains {row.gains!r}: there is {', '.join(sorted(every))}")
    parts = {*LawStates._fields, *states, *Controller._fields} - {"states"}
    for reset in resets:
        if unknown := sorted(set(reset.sets) - parts):
            raise SitlError(f"reset {reset.name} sets {unknown[0]!r}: there is {', '.join(sorted(parts))}")


def _refuse_twins(what: str, things: Iterable[Any], key: Callable[[Any], Any]) -> None:
    seen: dict[Any, Any] = {}
    for thing in things:
        if seen.setdefault(key(thing), thing) != thing:
            raise SitlError(f"{what} {key(thing)!r} stands for two")
