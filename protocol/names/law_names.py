"""Display names of the control laws."""

from __future__ import annotations

from typing import Final

from protocol.dialect.vocabulary import Law, Regime
from protocol.names.enum_names import as_member

__all__ = ["law_label", "law_words"]

TRANSITIONS: Final = (Regime.FRONT_TRANSITION, Regime.BACK_TRANSITION)


def law_label(number: int) -> str:
    """A DARKO_LAW in plain words: the law of a transition is called as the transition; an unknown one "law 12"."""
    law = as_member(Law, number)
    if law is None:
        return f"law {number}"
    return law.regime.label if law.regime in TRANSITIONS else law.label


def law_words(name: str) -> str:
    """The same of a law's name in programs: "front transition" of "TO_FORWARD"; another name in lower case."""
    return law_label(Law[name]) if name in Law.__members__ else name.replace("_", " ").lower()
