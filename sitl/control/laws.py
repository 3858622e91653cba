"""The register of the control laws: one row per law, its gains and its state.

To add a law: its module with ``step``; its row here, with a field for its gains and one for each state slot that is
new; its entry in the dialect; its jumps in the supervisor's table. Parameters of ``step`` are passed by name: the
estimate, the reference, its own gains, the design model ``a``, the control period ``dt``, and a state slot, or several
as ``state``, a NamedTuple of slots. It gives the command, the DARKO_SATURATION bits and the slot or the state back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from protocol.dialect.vocabulary import Law
from sitl.control import align, hover_attitude, hover_linear, hover_zero_moment, indi, landed, robust_pi
from sitl.control.forward_flight import forward_linear, line_of_sight
from sitl.control.forward_flight.forward_linear import ForwardGains
from sitl.control.forward_flight.line_of_sight import LineOfSight, LineOfSightGains
from sitl.control.handover import Handover
from sitl.control.hover_attitude import AttitudeGains, Steering
from sitl.control.hover_linear import LinearGains
from sitl.control.hover_zero_moment import Pointing, ZeroMomentGains
from sitl.control.indi import IndiGains, IndiState
from sitl.control.robust_pi import RobustPiGains, RobustPiState
from sitl.control.wind_estimator import WindGains
from sitl.model.vectors import Vector


class LawStates(NamedTuple):
    """State slots; a slot that several laws share is handed over between them."""

    integral: Vector  # of the linear hover law, world [m s]
    side: float  # of the quaternion, of the linear hover law; other laws keep theirs in their state
    pointing: Pointing  # of the zero-moment law, the alignment and the fall
    handover: Handover  # what the law before commanded more, fading
    steering: Steering  # of the attitude law
    hold: Vector  # where the alignment stays, world NWU [m]
    course: float  # azimuth the belly or the nose is to point to [rad]
    sight: LineOfSight  # of the line-of-sight law and the transitions
    increment: IndiState  # of INDI
    robust_pi: RobustPiState  # of the robust PI law


class Gains(NamedTuple):
    """Gains of the laws and of the wind estimator."""

    hover_linear: LinearGains
    zero_moment: ZeroMomentGains
    hover_attitude: AttitudeGains
    line_of_sight: LineOfSightGains
    forward_linear: ForwardGains
    indi: IndiGains
    robust_pi: RobustPiGains
    wind: WindGains


@dataclass(frozen=True)
class LawRow:
    """One law: its tick, and the field of the gains it takes."""

    law: Law  # or a member of another IntEnum, for laws of one's own
    step: Callable[..., Any]
    gains: str = ""


@dataclass(frozen=True)
class ValueRow:
    """One Lyapunov value that guards look at, by the name they call it."""

    name: str
    value: Callable[..., float]
    gains: str


LAWS = (
    LawRow(Law.LANDED, landed.step, "zero_moment"),
    LawRow(Law.HOVER_LINEAR, hover_linear.step, "hover_linear"),
    LawRow(Law.HOVER_ZERO_MOMENT, hover_zero_moment.step, "zero_moment"),
    LawRow(Law.ALIGN, align.step, "zero_moment"),
    LawRow(Law.TO_FORWARD, line_of_sight.cruise_step, "line_of_sight"),
    LawRow(Law.FORWARD_LINE_OF_SIGHT, line_of_sight.cruise_step, "line_of_sight"),
    LawRow(Law.FORWARD_LINEAR, forward_linear.step, "forward_linear"),
    LawRow(Law.TO_HOVER, line_of_sight.brake_step, "line_of_sight"),
    LawRow(Law.FAILSAFE, hover_zero_moment.step, "zero_moment"),
    LawRow(Law.HOVER_ATTITUDE, hover_attitude.step, "hover_attitude"),
    LawRow(Law.CRASHED, landed.lie),
    LawRow(Law.INDI, indi.step, "indi"),
    LawRow(Law.ROBUST_PI, robust_pi.step, "robust_pi"),
)

VALUES = (
    ValueRow("v_hover", hover_linear.lyapunov, "hover_linear"),
    ValueRow("v_integral", hover_linear.integral_share, "hover_linear"),
    ValueRow("v_forward", forward_linear.lyapunov, "forward_linear"),
    ValueRow("v_attitude", hover_attitude.lyapunov, "hover_attitude"),
)
