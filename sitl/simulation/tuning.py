"""Tunable parameters of the hybrid controller, and the design they give for an airframe."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl.control.forward_flight.forward_linear import ForwardGains
from sitl.control.governor import VELOCITY
from sitl.control.hover_linear import LinearGains
from sitl.control.laws import Gains
from sitl.defaults import GENTLE
from sitl.design.forward_schedule import forward_gains
from sitl.design.gains import attitude_gains, indi_gains, line_of_sight_gains, wind_gains, zero_moment_gains
from sitl.design.lmi import lmi_gains
from sitl.design.lqr import gentle_hover_gains, hover_gains
from sitl.design.paparazzi_indi import paparazzi_gains
from sitl.design.proved import PROVED_LEVEL, base_gains, is_proved, proved_gains
from sitl.design.robust_pi_gains import WINDY_TUNING, robust_pi_gains
from sitl.design.scaling import scale_of
from sitl.errors import SitlError
from sitl.model.airframe import STALL, Airframe
from sitl.simulation.flight import Design
from sitl.storage import record_of
from sitl.supervisor.guards import Thresholds
from sitl.tools.parameter_metadata import ParameterMetadata

REPORT_GAIN, LMI_GAIN, GENTLE_GAIN, PROVED_GAIN = range(4)  # designs of the linear hover law
REPORTED, INDI, ROBUST_PI, HYBRID = range(4)
CONTROLLERS = {"hybrid": HYBRID, "report": REPORTED, "indi": INDI, "robust-pi": ROBUST_PI}  # by name on commands
OWN = -1.0  # a threshold that the design of the linear hover law has itself
SAMPLED_ENTER, SAMPLED_LEAVE = 20.0, 50.0  # of designs whose V proves little: from flights (docs/region.md)
PROVED_LEAVE = 50.0  # of the proved design: from flights as well
PROVED_WAITED = 20.0  # likewise
PROVED_SETTLED = 4.0  # likewise: a transition ends while the reference already sinks or goes on
STALL_LEAVE, STALL_WAITED = 120.0, 50.0  # the same where the wing stalls: its V is 1 at a smaller deviation
STALL_SETTLED = 10.0
HANDED_OVER = 2.5  # V above which INDI takes over from it: from flights
SETTLED_SHARE = 0.5  # of v_enter, where that is sampled


class Tuning(NamedTuple):
    """Tunable parameters of the hybrid controller; those with metadata are parameters on the wire."""

    v_enter: Annotated[
        float,
        ParameterMetadata(
            "DRK_V_ENTER", (OWN, 1e5), "", "V below which the linear hover law takes over; -1: the design's own"
        ),
    ] = OWN
    # Infinite in scenarios only: a hover law is then flown alone, whatever comes of it.
    v_leave: Annotated[
        float,
        ParameterMetadata(
            "DRK_V_LEAVE", (OWN, 1e5), "", "V above which the linear hover law hands over; -1: the design's own"
        ),
    ] = OWN
    integral: Annotated[
        int,
        ParameterMetadata(
            name="DRK_LQI",
            bounds=(0, 1),
            unit="",
            text="Integral of the position error in the linear hover law",
            values=((0, "off"), (1, "on")),
        ),
    ] = 1
    # What the report tries and no table found better: for its reproduction, not on the wire.
    governor: int = VELOCITY  # of :mod:`sitl.control.governor`
    nu_prime: int = 0  # nu' of appendix D instead of nu
    kpp: Annotated[float, ParameterMetadata("DRK_KPP", (0.1, 3.0), "N/m", "Position gain of the zero-moment law")] = 1.5
    kpd: Annotated[float, ParameterMetadata("DRK_KPD", (0.1, 3.0), "N s/m", "Velocity gain of the zero-moment law")] = (
        1.5
    )
    k_delta: Annotated[
        float, ParameterMetadata("DRK_KDELTA", (0.5, 20.0), "1/s", "Force convergence of the zero-moment law")
    ] = 5.0
    lam: Annotated[
        float, ParameterMetadata("DRK_LAMBDA", (1.0, 20.0), "rad/s", "Attitude bandwidth of the zero-moment law")
    ] = 10.0
    zeta: Annotated[
        float, ParameterMetadata("DRK_ZETA", (0.2, 2.0), "", "Attitude damping ratio of the zero-moment law")
    ] = 0.8
    k_q: Annotated[float, ParameterMetadata("DRK_KQ", (0.0, 5.0), "rad/s", "Heading gain of the zero-moment law")] = 1.0
    design: Annotated[
        int,
        ParameterMetadata(
            name="DRK_LIN_DESIGN",
            bounds=(0, 3),
            unit="",
            text="Linear hover gain",
            values=((0, "the report's R = I"), (1, "LMI"), (2, "R = 5 I"), (3, "proved")),
        ),
    ] = PROVED_GAIN
    forward_linear: Annotated[
        int,
        ParameterMetadata(
            name="DRK_FWD_LIN",
            bounds=(0, 1),
            unit="",
            text="Hand straight legs to the linear forward law",
            values=((0, "no"), (1, "yes")),
        ),
    ] = 0
    v_forward_enter: Annotated[
        float, ParameterMetadata("DRK_VF_ENTER", (0.0, 1e5), "", "V below which the linear forward law takes over")
    ] = 5.0
    v_forward_leave: Annotated[
        float, ParameterMetadata("DRK_VF_LEAVE", (0.0, 1e5), "", "V above which the linear forward law hands back")
    ] = 20.0
    controller: Annotated[
        int,
        ParameterMetadata(
            name="DRK_CONTROLLER",
            bounds=(0, 3),
            unit="",
            text="What flies",
            values=(
                (0, "the report's switched laws"),
                (1, "INDI"),
                (2, "a robust PI law, hovering only"),
                (3, "the hybrid controller: INDI, a proved law for the calm hover, one that catches falls"),
            ),
        ),
    ] = HYBRID
    pace: Annotated[
        int,
        ParameterMetadata(
            name="DRK_PACE",
            bounds=(0, 1),
            unit="",
            text="How hard INDI accelerates and brakes",
            values=((0, "gently"), (1, "briskly: less time and energy")),
        ),
    ] = GENTLE
    paparazzi: int = 0  # whether INDI has the gains of :mod:`sitl.design.paparazzi_indi`: for studies, not on the wire
    robust_pi: str = WINDY_TUNING  # of :mod:`sitl.design.robust_pi_gains`; others are for studies, not on the wire
    pitot: Annotated[
        int,
        ParameterMetadata(
            name="DRK_PITOT",
            bounds=(0, 1),
            unit="",
            text="The wind estimator has a pitot tube",
            values=((0, "no"), (1, "yes")),
        ),
    ] = 1


def uses_indi(tuning: Tuning) -> bool:
    """Whether INDI flies what has no better law, alone or in the hybrid controller."""
    return tuning.controller == INDI or (tuning.controller == HYBRID and not math.isinf(tuning.v_leave))


@lru_cache(maxsize=64)
def designed(a: Airframe, tuning: Tuning, latency: float = 0.0) -> Design:
    """The controller for an airframe.

    Args:
        a: The airframe as the controller believes it to be.
        tuning: Its parameters.
        latency: From inertial reading to actuator, beyond the control period [s].
    """
    size = scale_of(a)
    loop = zero_moment_gains(
        a,
        k_pp=tuning.kpp,
        k_pd=tuning.kpd,
        k_delta=tuning.k_delta,
        lam=tuning.lam,
        zeta=tuning.zeta,
        k_q=tuning.k_q,
        nu_prime=bool(tuning.nu_prime),
        governor=tuning.governor,
    )
    gains = Gains(
        hover_linear=_hover_gains(a, bool(tuning.integral), tuning.design),
        zero_moment=loop,
        hover_attitude=attitude_gains(loop, size),
        line_of_sight=line_of_sight_gains(latency, size),
        forward_linear=_forward_gains(a),
        indi=paparazzi_gains() if tuning.paparazzi else indi_gains(size, tuning.pace),
        robust_pi=robust_pi_gains(tuning.robust_pi),
        wind=wind_gains(),
    )
    return Design(a, gains, thresholds(a, tuning))


@lru_cache(maxsize=64)
def design_record(a: Airframe, tuning: Tuning, latency: float = 0.0) -> npt.NDArray[Any]:
    """The same as the compiled loop takes it, a record, (1,); not to be changed."""
    return record_of(Design, designed(a, tuning, latency))


def thresholds(a: Airframe, tuning: Tuning) -> Thresholds:
    """Switching thresholds of the supervisor.

    The linear hover law is entered below the level that is proved of it, if one is; then V below which it is entered
    after a while, in a wind that the proof does not know, and V above which it is left, come from flights.
    """
    enter, leave, waited, settled = SAMPLED_ENTER, SAMPLED_LEAVE, SAMPLED_ENTER, SETTLED_SHARE * SAMPLED_ENTER
    if tuning.design == PROVED_GAIN and tuning.integral and is_proved(a):
        enter, leave, waited, settled = PROVED_LEVEL, PROVED_LEAVE, PROVED_WAITED, PROVED_SETTLED
        if a.aerodynamics == STALL:
            leave, waited, settled = STALL_LEAVE, STALL_WAITED, STALL_SETTLED
    if tuning.controller == HYBRID:
        enter, leave, waited = PROVED_LEVEL, HANDED_OVER, PROVED_LEVEL
    if tuning.v_enter >= 0.0:
        enter, waited, settled = tuning.v_enter, tuning.v_enter, SETTLED_SHARE * tuning.v_enter
    if tuning.v_leave >= 0.0:
        leave = tuning.v_leave
    return Thresholds(
        v_enter=float(enter),
        v_leave=float(leave),
        v_waited=float(waited),
        v_settled=float(settled),
        v_forward_enter=float(tuning.v_forward_enter) if tuning.forward_linear else 0.0,
        v_forward_leave=float(tuning.v_forward_leave),
        single_law=math.isinf(tuning.v_leave),
        use_indi=uses_indi(tuning),
        indi_alone=tuning.controller == INDI,
        use_robust_pi=tuning.controller == ROBUST_PI,
    )


@lru_cache(maxsize=8)
def _hover_gains(a: Airframe, integral: bool, design: int) -> LinearGains:
    if design == LMI_GAIN:
        return lmi_gains(a)
    if design == PROVED_GAIN and integral and is_proved(a):
        return proved_gains(a)
    if design == PROVED_GAIN and integral and a.aerodynamics == STALL:
        return base_gains(a)  # unproved of this set; the stiffer integral holds it in a wind all the same
    return (hover_gains if design == REPORT_GAIN else gentle_hover_gains)(a, integral=integral)


@lru_cache(maxsize=8)
def _forward_gains(a: Airframe) -> ForwardGains:
    try:
        return forward_gains(a)
    except SitlError:  # nothing balances it in level flight at some speed: it hovers, and never asks for these
        none, grid = np.zeros((2, 2)), np.array((0.0, 1.0))
        return ForwardGains(
            speeds=grid,
            climbs=grid,
            K=np.zeros((2, 4, 11)),
            S=np.zeros((2, 11, 11)),
            theta=none,
            thrust=none,
            delta=none,
        )
