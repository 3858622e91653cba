"""Limits of this project's vehicle that both ends must know."""

from __future__ import annotations

__all__ = ["MIN_FORWARD_HEIGHT"]

MIN_FORWARD_HEIGHT = 3.0
"""Least height of forward flight, and of a front transition [m]."""
