"""Tunable parameters of the hybrid controller, and the design they give for an airframe."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl.control.forward_linear import ForwardGains
from sitl.control.governor import VELOCITY
from sitl.control.hover_linear import LinearGains
from sitl.control.laws import Gains
from sitl.design.attitude import attitude_gains
from sitl.design.forward import line_of_sight_gains
from sitl.design.forward_linear import forward_gains
from sitl.design.lqr import hover_gains
from sitl.design.wind import wind_gains
from sitl.design.zero_moment import zero_moment_gains
from sitl.errors import SitlError
from sitl.model.airframe import Airframe
from sitl.simulation.flight import Design
from sitl.simulation.storage import record_of
from sitl.supervisor.guards import Thresholds


class Tuning(NamedTuple):
    """Tunable parameters of the hybrid controller; DRK_… are their names on the wire."""

    v_enter: float = 20.0  # DRK_V_ENTER
    v_leave: float = 50.0  # DRK_V_LEAVE; infinite: a hover law is flown alone, whatever comes of it
    integral: int = 1  # DRK_LQI
    governor: int = VELOCITY  # DRK_GOVERNOR
    nu_prime: int = 0  # DRK_NU_PRIME
    kpp: float = 1.5  # DRK_KPP [N/m]
    kpd: float = 1.5  # DRK_KPD [N s/m]
    k_delta: float = 5.0  # DRK_KDELTA [1/s]
    lam: float = 10.0  # DRK_LAMBDA [rad/s]
    zeta: float = 0.8  # DRK_ZETA
    k_q: float = 1.0  # DRK_KQ [rad/s]
    forward_linear: int = 1  # DRK_FWD_LIN
    v_forward_enter: float = 5.0  # DRK_VF_ENTER
    v_forward_leave: float = 20.0  # DRK_VF_LEAVE
    pitot: int = 1  # DRK_PITOT
    design: int = 0  # DRK_LIN_DESIGN: 0 LQR or LQI, 1 LMI


@lru_cache(maxsize=64)
def designed(a: Airframe, tuning: Tuning) -> Design:
    """The controller for an airframe.

    Args:
        a: The airframe as the controller believes it to be.
        tuning: Its parameters.
    """
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
        hover_attitude=attitude_gains(loop),
        line_of_sight=line_of_sight_gains(),
        forward_linear=_forward_gains(a),
        wind=wind_gains(),
    )
    return Design(a, gains, thresholds(tuning))


@lru_cache(maxsize=64)
def design_record(a: Airframe, tuning: Tuning) -> npt.NDArray[Any]:
    """The same as the compiled loop takes it, a record, (1,); not to be changed."""
    return record_of(Design, designed(a, tuning))


def thresholds(tuning: Tuning) -> Thresholds:
    """Where the supervisor switches."""
    return Thresholds(
        v_enter=float(tuning.v_enter),
        v_leave=float(tuning.v_leave),
        v_forward_enter=float(tuning.v_forward_enter) if tuning.forward_linear else 0.0,
        v_forward_leave=float(tuning.v_forward_leave),
        alone=math.isinf(tuning.v_leave),
    )


@lru_cache(maxsize=8)
def _hover_gains(a: Airframe, integral: bool, design: int) -> LinearGains:
    if design:
        from sitl.design.lmi import lmi_gains  # noqa: PLC0415 - its solver is a second to import

        return lmi_gains(a)
    return hover_gains(a, integral=integral)


@lru_cache(maxsize=8)
def _forward_gains(a: Airframe) -> ForwardGains:
    try:
        return forward_gains(a)
    except SitlError:  # nothing balances it in level flight at some speed: it hovers, and never asks for these
        none, grid = np.zeros((2, 2)), np.array((0.0, 1.0))
        return ForwardGains(grid, grid, np.zeros((2, 4, 11)), np.zeros((2, 11, 11)), none, none, none)
