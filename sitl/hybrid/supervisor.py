"""The vehicle's supervisor: which law flies, as a table of jumps on hybrid time (t, j).

A jump set is written as conditions that must hold and conditions that must not. Hysteresis is the gap between two
thresholds of a Lyapunov value: the linear hover law is entered below ``v_enter`` and left above ``v_leave``, the
linear forward law likewise by its own. In a wind the laws that do not know of it give way to that of the transition,
which does, and holds and flies upright as well. The report takes 250 and 400 for the hover (section 5.1; the second
comparison is printed the wrong way round); on the full model those values let the linear law be entered where it
diverges, so the defaults are lower. Transitions have a dwell time besides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl.hybrid.automaton import Jump, mermaid
from sitl.hybrid.conditions import Condition

C = Condition  # the table below is read by its conditions


class Law(IntEnum):
    """The discrete state: values are those of DARKO_LAW on the wire."""

    LANDED = 0
    HOVER_LINEAR = 1
    HOVER_ZERO_MOMENT = 2
    ALIGN = 3
    TO_FORWARD = 4
    FORWARD_LINE_OF_SIGHT = 5
    FORWARD_LINEAR = 6
    TO_HOVER = 7
    FAILSAFE = 8
    HOVER_ATTITUDE = 9


# From tipping over until standing again.
WINGED = frozenset({Law.TO_FORWARD, Law.FORWARD_LINE_OF_SIGHT, Law.FORWARD_LINEAR, Law.TO_HOVER})


class Reason(IntEnum):
    """Why a jump was taken: values are those of DARKO_JUMP_REASON on the wire."""

    NONE = 0
    LYAPUNOV_BELOW = 1
    LYAPUNOV_ABOVE = 2
    COMMAND = 3
    TAKEOFF = 4
    TOUCHDOWN = 5
    DISARM = 6
    SPEED = 7
    FAILSAFE = 8


@dataclass(frozen=True)
class Guard:
    """A jump set: all of ``when`` and none of ``unless``."""

    when: int
    unless: int = 0

    def __call__(self, x: int) -> bool:
        """Whether conditions are in the jump set."""
        return (x & self.when) == self.when and (x & self.unless) == 0


class JumpRecord(NamedTuple):
    """One jump of the vehicle, as it is reported."""

    time: float  # ordinary time t [s]
    number: int  # j after the jump
    source: Law
    target: Law
    name: str
    reason: Reason
    lyapunov: float  # of the linear forward law where the jump is to or from it, else of the linear hover law


_NOT_DWELT = ~int(C.DWELT)


def _dwell_anew(conditions: int) -> int:
    """Jump map of nearly every jump: the dwell time of the next law begins."""
    return conditions & _NOT_DWELT


def _from_here(conditions: int) -> int:
    """Jump map into a commanded attitude: its reference begins where the vehicle is."""
    return _dwell_anew(conditions) & ~int(C.OFF_TRIM)


def _level_first(conditions: int) -> int:
    """Jump map out of a commanded tilt: V may be small with it, but the linear law has to wait for it to be gone."""
    return _dwell_anew(conditions) & ~int(C.NEAR | C.SETTLED)


def _jump(
    name: str,
    target: Law,
    reason: Reason,
    when: C = C(0),  # noqa: B008 - immutable
    unless: C = C(0),  # noqa: B008
    reset: Callable[[int], int] = _dwell_anew,
) -> Jump:
    return Jump(name, Guard(int(when), int(unless)), target, reason, reset)


_DISARM = _jump("disarm", Law.LANDED, Reason.DISARM, unless=C.ARMED)
_TO_GROUND = (_DISARM, _jump("touch_down", Law.LANDED, Reason.TOUCHDOWN, C.RESTING))
_FAIL = _jump("catch_fall", Law.FAILSAFE, Reason.FAILSAFE, C.FALLING)
_BRAKE = (
    _jump("brake", Law.TO_HOVER, Reason.SPEED, C.STOP_DUE),
    _jump("recall", Law.TO_HOVER, Reason.COMMAND, unless=C.WANTED),
)
_GO = C.WANTED | C.WORTH
_STEER = _jump("steer", Law.HOVER_ATTITUDE, Reason.COMMAND, C.STEERED | C.CALM, C.OFF_TRIM, _from_here)

TABLE: dict[Law, tuple[Jump, ...]] = {
    Law.LANDED: (_jump("take_off", Law.HOVER_ZERO_MOMENT, Reason.TAKEOFF, C.ARMED | C.FLYING, C.RESTING),),
    Law.HOVER_LINEAR: (
        *_TO_GROUND,
        _FAIL,
        _STEER,
        _jump("align", Law.ALIGN, Reason.COMMAND, _GO | C.CALM, C.STOP_DUE),
        _jump("ride_wind", Law.TO_HOVER, Reason.LYAPUNOV_ABOVE, C.FAR | C.WINDY, C.NEAR),
        _jump("leave_linear", Law.HOVER_ZERO_MOMENT, Reason.LYAPUNOV_ABOVE, C.FAR, C.NEAR),
    ),
    Law.HOVER_ZERO_MOMENT: (
        *_TO_GROUND,
        _FAIL,
        _STEER,
        _jump("align", Law.ALIGN, Reason.COMMAND, _GO | C.CALM, C.STOP_DUE),
        _jump("enter_linear", Law.HOVER_LINEAR, Reason.LYAPUNOV_BELOW, C.NEAR, C.FAR | C.WINDY),
        _jump("ride_wind", Law.TO_HOVER, Reason.SPEED, C.WINDY | C.DWELT),
        _jump("stop_sliding", Law.TO_HOVER, Reason.SPEED, C.SLIDING),
    ),
    Law.ALIGN: (
        *_TO_GROUND,
        _FAIL,
        _jump("stay", Law.HOVER_ZERO_MOMENT, Reason.COMMAND, unless=C.WANTED),
        _jump("tip_over", Law.TO_FORWARD, Reason.SPEED, C.ALIGNED | C.DWELT),
    ),
    Law.TO_FORWARD: (
        *_TO_GROUND,
        _FAIL,
        *_BRAKE,
        _jump("fly", Law.FORWARD_LINE_OF_SIGHT, Reason.SPEED, C.WING_BORNE | C.DWELT),
    ),
    Law.FORWARD_LINE_OF_SIGHT: (
        *_TO_GROUND,
        _FAIL,
        *_BRAKE,
        _jump(
            "enter_forward_linear",
            Law.FORWARD_LINEAR,
            Reason.LYAPUNOV_BELOW,
            C.ON_TRIM | C.STRAIGHT | C.DWELT,
            C.OFF_TRIM,
        ),
    ),
    Law.FORWARD_LINEAR: (
        *_TO_GROUND,
        _FAIL,
        *_BRAKE,
        _jump("leave_forward_linear", Law.FORWARD_LINE_OF_SIGHT, Reason.LYAPUNOV_ABOVE, C.OFF_TRIM),
        _jump("turn", Law.FORWARD_LINE_OF_SIGHT, Reason.COMMAND, unless=C.STRAIGHT),
    ),
    Law.TO_HOVER: (
        *_TO_GROUND,
        _FAIL,
        _jump("steer", Law.HOVER_ATTITUDE, Reason.COMMAND, C.STEERED | C.STANDING | C.DWELT, reset=_from_here),
        _jump("hover", Law.HOVER_LINEAR, Reason.LYAPUNOV_BELOW, C.SETTLED | C.STANDING | C.STILL | C.DWELT, C.FAR),
        _jump("align", Law.ALIGN, Reason.COMMAND, _GO | C.CALM | C.STANDING | C.DWELT, C.STOP_DUE),
        _jump(
            "fly_on",
            Law.FORWARD_LINE_OF_SIGHT,
            Reason.COMMAND,
            _GO | C.ROOM | C.WING_BORNE | C.DWELT,
            C.STOP_DUE | C.STANDING,
        ),
    ),
    Law.FAILSAFE: (
        *_TO_GROUND,
        _jump("recover", Law.HOVER_ZERO_MOMENT, Reason.SPEED, C.RECOVERED | C.DWELT, C.FALLING),
    ),
    Law.HOVER_ATTITUDE: (
        *_TO_GROUND,
        _FAIL,
        _jump("let_go", Law.HOVER_ZERO_MOMENT, Reason.COMMAND, unless=C.STEERED, reset=_level_first),
        _jump("upset", Law.HOVER_ZERO_MOMENT, Reason.FAILSAFE, C.OFF_TRIM, reset=_level_first),
    ),
}


def jump_sets() -> npt.NDArray[np.int64]:
    """The guards as the compiled flow takes them: [law, jump, (when, unless)]; rows beyond a law's own never hold."""
    most = max(len(jumps) for jumps in TABLE.values())
    sets = np.full((len(TABLE), most, 2), -1, dtype=np.int64)  # all bits both wanted and forbidden
    for law, jumps in TABLE.items():
        for row, jump in enumerate(jumps):
            sets[law, row] = jump.guard.when, jump.guard.unless  # type: ignore[attr-defined]
    return sets


def diagram() -> str:
    """The table as the documentation shows it."""
    return mermaid(TABLE, lambda law: law.name)
