"""Outcomes of the parameter changes that the operator asked for."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import NamedTuple


class ChangeState(Enum):
    """State of one change."""

    WAITING = "waiting"
    SET = "set"
    REFUSED = "refused"


class ParameterChange(NamedTuple):
    """One change; a later one of the same parameter replaces it."""

    value: float  # that was asked for
    state: ChangeState = ChangeState.WAITING
    reason: str = ""  # of a refusal, also of one that is tried again

    @property
    def words(self) -> str:
        """Its state for people: "set", "refused: is outside 0..3"."""
        is_explained = self.state is ChangeState.REFUSED and self.reason
        return f"{self.state.value}: {self.reason}" if is_explained else self.state.value


def refused_changes(changes: Mapping[str, ParameterChange]) -> dict[str, ParameterChange]:
    """Those that the vehicle refused, by name."""
    return {name: change for name, change in changes.items() if change.state is ChangeState.REFUSED}
