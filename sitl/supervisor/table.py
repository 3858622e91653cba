"""The vehicle's supervisor: which law flies, as a table of jumps on hybrid time (t, j).

A jump set is written as guards that must hold and guards that must not; the flow set of a law is the complement of its
rows' jump sets. Hysteresis is the gap between two thresholds of a Lyapunov value: the linear hover law is entered below
``v_enter`` and left above ``v_leave``, the linear forward law likewise by its own. In a wind the laws that do not use
the wind estimate give way to that of the transition, which does, and holds and flies upright as well. The report takes
250 and 400 for the hover (section 5.1; the second comparison is printed the wrong way round); on the full model those
values let the linear law be entered where it diverges, so the defaults are lower. Transitions have a dwell time
besides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from protocol.dialect.vocabulary import Law, Reason
from sitl.supervisor import guards as g
from sitl.supervisor import resets as r
from sitl.supervisor.guards import Guard
from sitl.supervisor.resets import Reset
from sitl.tools.plotting import mermaid


@dataclass(frozen=True)
class Jump:
    """One row: from the law it stands under, where all of ``when`` and none of ``unless`` hold."""

    name: str
    target: Law
    reason: Reason
    when: tuple[Guard, ...] = ()
    unless: tuple[Guard, ...] = ()
    resets: tuple[Reset, ...] = ()

    @property
    def required(self) -> int:
        """Bits of the guards that must hold."""
        return sum(guard.bit for guard in self.when)

    @property
    def forbidden(self) -> int:
        """Bits of the guards that must not hold."""
        return sum(guard.bit for guard in self.unless)

    def is_due(self, bits: int) -> bool:
        """Whether the guards that hold put the state in the jump set."""
        return bits & self.required == self.required and not bits & self.forbidden

    def after(self, bits: int) -> int:
        """The guards that may still hold after the jump."""
        cleared = {guard.bit for made in (r.begin_anew, *self.resets) for guard in made.clears}
        return bits & ~sum(cleared)


Table = Mapping[Law, tuple[Jump, ...]]

_CRASH = Jump("crash", Law.CRASHED, Reason.CRASH, when=(g.crashed,), resets=(r.broken,))
_LAND = (
    _CRASH,
    Jump("disarm", Law.LANDED, Reason.DISARM, unless=(g.armed,), resets=(r.landed, r.let_go)),
    Jump("touch_down", Law.LANDED, Reason.TOUCHDOWN, when=(g.resting,), resets=(r.landed, r.carry_weight)),
)
_CATCH = Jump("catch_fall", Law.FAILSAFE, Reason.FAILSAFE, when=(g.falling,), resets=(r.point_from_here,))
# Between laws that share the pointing, it goes on.
_CATCH_POINTED = Jump("catch_fall", Law.FAILSAFE, Reason.FAILSAFE, when=(g.falling,))


def _to_indi(name: str, reason: Reason, *when: Guard, unless: tuple[Guard, ...] = ()) -> Jump:
    """To INDI, alone or in the hybrid controller."""
    return Jump(name, Law.INDI, reason, (g.indi_chosen, *when), unless, (r.increment_from_here,))


_INDI = _to_indi("choose_indi", Reason.COMMAND)
_INDI_ALONE = _to_indi("choose_indi", Reason.COMMAND, g.indi_alone)
_ROBUST_PI = Jump(
    "choose_robust_pi",
    Law.ROBUST_PI,
    Reason.COMMAND,
    when=(g.robust_pi_chosen, g.standing, g.recovered, g.dwell_elapsed),
    unless=(g.attitude_commanded, g.touching_down),
    resets=(r.robust_pi_from_here,),
)
_GO = (g.forward_requested, g.leg_long_enough)


def _steer(*when: Guard, unless: tuple[Guard, ...] = ()) -> Jump:
    required = (g.attitude_commanded, *when)
    return Jump("steer", Law.HOVER_ATTITUDE, Reason.COMMAND, required, unless, (r.steering_from_here,))


def _align(*when: Guard, resets: tuple[Reset, ...]) -> Jump:
    return Jump("align", Law.ALIGN, Reason.COMMAND, (*_GO, *when), (g.stop_due, g.robust_pi_chosen), resets)


def _stop(*resets: Reset) -> tuple[Jump, Jump]:
    return (
        Jump("brake", Law.TO_HOVER, Reason.SPEED, when=(g.stop_due,), resets=resets),
        Jump("recall", Law.TO_HOVER, Reason.COMMAND, unless=(g.forward_requested,), resets=resets),
    )


TABLE: dict[Law, tuple[Jump, ...]] = {
    Law.LANDED: (
        _CRASH,
        Jump(
            "take_off_indi",
            Law.INDI,
            Reason.TAKEOFF,
            when=(g.indi_chosen, g.armed, g.flight_requested),
            unless=(g.resting,),
            resets=(r.increment_from_here,),
        ),
        Jump(
            "take_off",
            Law.HOVER_ZERO_MOMENT,
            Reason.TAKEOFF,
            when=(g.armed, g.flight_requested),
            unless=(g.resting,),
            resets=(r.point_from_here,),
        ),
    ),
    Law.HOVER_LINEAR: (
        *_LAND,
        _INDI_ALONE,
        _CATCH,
        _ROBUST_PI,
        _steer(g.upright_and_slow),
        _to_indi("fly_indi", Reason.COMMAND, g.forward_requested),
        _to_indi("leave_proved", Reason.LYAPUNOV_ABOVE, g.v_above_leave),
        _align(g.upright_and_slow, resets=(r.point_from_here, r.hold_here)),
        Jump(
            "ride_wind",
            Law.TO_HOVER,
            Reason.LYAPUNOV_ABOVE,
            when=(g.v_above_leave, g.wind_strong, g.upright_and_slow, g.recovered),
            unless=(g.v_below_enter,),
            resets=(r.sight_from_here,),
        ),
        Jump(
            "leave_linear",
            Law.HOVER_ZERO_MOMENT,
            Reason.LYAPUNOV_ABOVE,
            when=(g.v_above_leave,),
            unless=(g.v_below_enter,),
            resets=(r.point_from_here,),
        ),
    ),
    Law.HOVER_ZERO_MOMENT: (
        *_LAND,
        _INDI,
        _CATCH_POINTED,
        _ROBUST_PI,
        _steer(g.upright_and_slow),
        _align(g.upright_and_slow, resets=(r.hold_here,)),
        Jump(
            "enter_linear",
            Law.HOVER_LINEAR,
            Reason.LYAPUNOV_BELOW,
            when=(g.v_below_enter,),
            unless=(g.v_above_leave, g.wind_strong),
        ),
        Jump(
            "ride_wind",
            Law.TO_HOVER,
            Reason.SPEED,
            when=(g.wind_strong, g.upright_and_slow, g.recovered, g.dwell_elapsed),
            resets=(r.sight_from_here,),
        ),
        Jump("stop_sliding", Law.TO_HOVER, Reason.SPEED, when=(g.sliding, g.wind_strong), resets=(r.sight_from_here,)),
    ),
    Law.ALIGN: (
        *_LAND,
        _INDI,
        _CATCH_POINTED,
        Jump("stay", Law.HOVER_ZERO_MOMENT, Reason.COMMAND, unless=(g.forward_requested,)),
        Jump(
            "front_transition",
            Law.TO_FORWARD,
            Reason.SPEED,
            when=(g.aligned, g.dwell_elapsed),
            resets=(r.sight_from_here,),
        ),
    ),
    Law.TO_FORWARD: (
        *_LAND,
        _INDI,
        _CATCH,
        *_stop(),
        Jump("fly", Law.FORWARD_LINE_OF_SIGHT, Reason.SPEED, when=(g.wing_borne, g.dwell_elapsed)),
    ),
    Law.FORWARD_LINE_OF_SIGHT: (
        *_LAND,
        _INDI,
        _CATCH,
        *_stop(),
        Jump(
            "enter_forward_linear",
            Law.FORWARD_LINEAR,
            Reason.LYAPUNOV_BELOW,
            when=(g.has_forward_linear, g.straight, g.dwell_elapsed, g.v_forward_below_enter),
            unless=(g.v_forward_above_leave,),
        ),
    ),
    Law.FORWARD_LINEAR: (
        *_LAND,
        _INDI,
        _CATCH,
        *_stop(r.sight_from_here),
        Jump(
            "leave_forward_linear",
            Law.FORWARD_LINE_OF_SIGHT,
            Reason.LYAPUNOV_ABOVE,
            when=(g.v_forward_above_leave,),
            resets=(r.sight_from_here,),
        ),
        Jump("turn", Law.FORWARD_LINE_OF_SIGHT, Reason.COMMAND, unless=(g.straight,), resets=(r.sight_from_here,)),
    ),
    Law.TO_HOVER: (
        *_LAND,
        _INDI,
        _CATCH,
        _ROBUST_PI,
        _steer(g.standing, g.dwell_elapsed),
        Jump(
            "hover",
            Law.HOVER_LINEAR,
            Reason.LYAPUNOV_BELOW,
            when=(g.v_below_settled, g.standing, g.wind_calm, g.dwell_elapsed),
            unless=(g.v_above_leave, g.touching_down),
        ),
        _align(g.upright_and_slow, g.standing, g.dwell_elapsed, resets=(r.point_from_here, r.hold_here)),
        Jump(
            "fly_on",
            Law.FORWARD_LINE_OF_SIGHT,
            Reason.COMMAND,
            when=(*_GO, g.has_stopping_distance, g.wing_borne, g.dwell_elapsed),
            unless=(g.stop_due, g.standing),
        ),
    ),
    Law.FAILSAFE: (
        *_LAND,
        _INDI_ALONE,
        _to_indi("recover_indi", Reason.SPEED, g.recovered, g.dwell_elapsed, unless=(g.falling,)),
        _to_indi("fly_leaning", Reason.SPEED, g.caught, unless=(g.falling,)),
        Jump(
            "recover",
            Law.HOVER_ZERO_MOMENT,
            Reason.SPEED,
            when=(g.recovered, g.dwell_elapsed),
            unless=(g.falling,),
        ),
        Jump(
            "stop_sliding",
            Law.TO_HOVER,
            Reason.SPEED,
            when=(g.sliding, g.wind_strong),
            unless=(g.falling,),
            resets=(r.sight_from_here,),
        ),
    ),
    Law.HOVER_ATTITUDE: (
        *_LAND,
        _INDI_ALONE,
        _CATCH,
        _to_indi("let_go_indi", Reason.COMMAND, unless=(g.attitude_commanded,)),
        Jump(
            "let_go",
            Law.HOVER_ZERO_MOMENT,
            Reason.COMMAND,
            unless=(g.attitude_commanded,),
            resets=(r.point_from_here, r.level_first),
        ),
        Jump(
            "upset",
            Law.HOVER_ZERO_MOMENT,
            Reason.FAILSAFE,
            when=(g.attitude_diverged,),
            resets=(r.point_from_here, r.level_first),
        ),
    ),
    # It hovers, whatever is asked for; beyond its region the hybrid controller's laws bring the vehicle back.
    Law.ROBUST_PI: (
        *_LAND,
        _INDI,
        _CATCH,
        _steer(g.upright_and_slow),
        Jump(
            "choose_another",
            Law.HOVER_ZERO_MOMENT,
            Reason.COMMAND,
            unless=(g.robust_pi_chosen,),
            resets=(r.point_from_here,),
        ),
        Jump(
            "lose_robust_pi",
            Law.HOVER_ZERO_MOMENT,
            Reason.FAILSAFE,
            unless=(g.upright_and_slow,),
            resets=(r.point_from_here,),
        ),
    ),
    # No jump leads from hover to cruise or back: the law is the same. Alone, it catches its own falls.
    Law.INDI: (
        *_LAND,
        Jump(
            "catch_fall",
            Law.FAILSAFE,
            Reason.FAILSAFE,
            when=(g.out_of_hand,),
            unless=(g.indi_alone,),
            resets=(r.point_from_here,),
        ),
        _steer(g.upright_and_slow, unless=(g.indi_alone,)),
        Jump(
            "enter_proved",
            Law.HOVER_LINEAR,
            Reason.LYAPUNOV_BELOW,
            when=(g.v_below_enter, g.standing, g.wind_calm, g.dwell_elapsed),
            unless=(g.indi_alone, g.forward_requested, g.attitude_commanded, g.touching_down, g.v_above_leave),
        ),
        Jump(
            "choose_report",
            Law.HOVER_ZERO_MOMENT,
            Reason.COMMAND,
            when=(g.upright_and_slow,),
            unless=(g.indi_chosen,),
            resets=(r.point_from_here,),
        ),
        Jump(
            "choose_report_in_cruise",
            Law.FORWARD_LINE_OF_SIGHT,
            Reason.COMMAND,
            when=(g.forward_requested, g.wing_borne),
            unless=(g.indi_chosen, g.stop_due),
            resets=(r.sight_from_here,),
        ),
        Jump(
            "choose_report_on_the_way",
            Law.TO_HOVER,
            Reason.COMMAND,
            unless=(g.indi_chosen,),
            resets=(r.sight_from_here,),
        ),
    ),
    Law.CRASHED: (),  # for good: only a new start stands it up again
}


def diagram() -> str:
    """The table as a Mermaid state diagram, for the documentation."""
    return mermaid(TABLE, lambda law: law.name)
