"""Errors that end a flight before its time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import IntEnum

from sitl.errors import SitlError, UnknownLawError, ZenoError
from sitl.model.state import Plant
from sitl.simulation.recording import JumpRecord, Recording

LAST_JUMPS = 12  # that the error of a jump without end names


class DivergedError(SitlError):
    """The simulation left the finite numbers."""

    def __init__(self, text: str, kept: int = 0) -> None:
        super().__init__(text)
        self.kept = kept  # samples before it did
        self.recording: Recording | None = None  # of what was flown, where it was recorded


def diverged(law: str, time: float, plant: Plant, kept: int) -> DivergedError:
    """The error of a flight whose state is no longer finite."""
    body = plant.body
    numbers = "; ".join(
        f"{name} ({', '.join(f'{x:.3g}' for x in part)})"
        for name, part in (("position", body.position), ("velocity", body.velocity), ("rates", body.rates))
    )
    return DivergedError(f"the flight diverged under {law} at {time:.3f} s: {numbers}", kept)


def zeno(jumps: Sequence[JumpRecord], time: float) -> ZenoError:
    """The error of a supervisor that jumps without end; its last jumps are named."""
    return ZenoError(f"jumps without end at {time:.3f} s: {' -> '.join(jump.name for jump in jumps[-LAST_JUMPS:])}")


def unknown_law(number: int, laws: Iterable[IntEnum]) -> UnknownLawError:
    """The error of a law that is not registered."""
    return UnknownLawError(f"law {number} is not one of {', '.join(law.name for law in laws)}")
