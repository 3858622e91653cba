"""Values of command line options that both programs take."""

from __future__ import annotations

import argparse
import math

__all__ = ["finite_number", "system_id"]


def finite_number(text: str) -> float:
    """A number that is neither infinite nor NaN; raises as ``argparse`` expects."""
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not a finite number")
    return value


def system_id(text: str) -> int:
    """A MAVLink system id, 1 to 255; raises as ``argparse`` expects."""
    value = int(text)
    if not 1 <= value <= 255:
        raise argparse.ArgumentTypeError(f"{text} is not a system id")
    return value
