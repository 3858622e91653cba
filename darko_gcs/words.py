"""Words from the wire, made safe to show."""

from __future__ import annotations

__all__ = ["clock", "printable"]


def clock(seconds: float) -> str:
    """Minutes and seconds."""
    return f"{int(seconds // 60)}:{seconds % 60:04.1f}"


def printable(text: str) -> str:
    """Text without what could command a terminal: each such character becomes a question mark."""
    return "".join(character if character.isprintable() else "?" for character in text)
