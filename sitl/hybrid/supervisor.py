"""The vehicle's supervisor: which law flies, as a table of jumps on hybrid time (t, j).

Hysteresis is the gap between two thresholds of V: the linear law is entered below ``v_enter`` and left above
``v_leave``. The report takes 250 and 400 (section 5.1, where the second comparison is printed the wrong way
round); on the full model those values let the linear law be entered where it diverges, so the defaults are
lower.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from sitl.hybrid.automaton import Jump, mermaid


class Law(IntEnum):
    """The discrete state: values are those of DARKO_LAW on the wire."""

    LANDED = 0
    HOVER_LINEAR = 1
    HOVER_ZERO_MOMENT = 2


class Reason(IntEnum):
    """Why a jump was taken: values are those of DARKO_JUMP_REASON on the wire."""

    NONE = 0
    LYAPUNOV_BELOW = 1
    LYAPUNOV_ABOVE = 2
    COMMAND = 3
    TAKEOFF = 4
    TOUCHDOWN = 5
    DISARM = 6


class Situation(NamedTuple):
    """What the guards look at."""

    lyapunov: float  # V of the linear hover law about the present target
    v_enter: float
    v_leave: float
    armed: bool
    flying: bool  # the autopilot wants to be in the air
    settled: bool  # landing, and at rest on the ground


class JumpRecord(NamedTuple):
    """One jump of the vehicle, as it is reported."""

    time: float  # ordinary time t [s]
    number: int  # j after the jump
    source: Law
    target: Law
    name: str
    reason: Reason
    lyapunov: float


_TO_GROUND = (
    Jump("disarm", lambda x: not x.armed, Law.LANDED, Reason.DISARM),
    Jump("touch_down", lambda x: x.settled, Law.LANDED, Reason.TOUCHDOWN),
)

TABLE: dict[Law, tuple[Jump, ...]] = {
    Law.LANDED: (
        Jump("take_off", lambda x: x.armed and x.flying and not x.settled, Law.HOVER_ZERO_MOMENT, Reason.TAKEOFF),
    ),
    Law.HOVER_LINEAR: (
        *_TO_GROUND,
        Jump("leave_linear", lambda x: x.lyapunov > x.v_leave, Law.HOVER_ZERO_MOMENT, Reason.LYAPUNOV_ABOVE),
    ),
    Law.HOVER_ZERO_MOMENT: (
        *_TO_GROUND,
        Jump("enter_linear", lambda x: x.lyapunov < x.v_enter, Law.HOVER_LINEAR, Reason.LYAPUNOV_BELOW),
    ),
}


def diagram() -> str:
    """The table as the documentation shows it."""
    return mermaid(TABLE, lambda law: law.name)
