"""Region of attraction of the linear hover law: flights from random states beside what is proved (report, section 5.1).

The report takes 250 and 400 from sampled trajectories. Here states are drawn on level sets of V and flown by the linear
law alone on the whole plant (:mod:`sitl.studies.region_flights`). A flight has converged once it is in the set that
:mod:`sitl.design.region` proves; V is the LQR's, whichever law flies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl.control.hover_linear import LinearGains
from sitl.design import linearise
from sitl.design.lmi import SPREAD, effectiveness, guaranteed_decay, lmi_gains
from sitl.design.lqr import hover_gains
from sitl.design.lqr import lqr as design_lqr
from sitl.design.region import Certificate, certify
from sitl.design.rise import first_rise
from sitl.errors import SitlError
from sitl.model.airframe import Airframe, Array
from sitl.studies.region_flights import BANDS, Flights, decay_seen, draw, fly, steps

CAUGHT = 0.02  # V at which a law without a certificate counts as converged
GENTLE = 10.0  # the other weight of u that is tried
ROUNDING = 1e-9
NEAR = 1.25  # factor of V
SHARE = 0.95  # of flights that a threshold to leave asks for
DEFAULTS, REPORT = (20.0, 50.0), (250.0, 400.0)  # thresholds to enter and to leave


class Result(NamedTuple):
    """What the study finds of one law."""

    name: str
    gains: LinearGains
    certificate: Certificate | None  # None with an integral: V is not of its whole state
    rise: float  # of the law's own V, where it first rises
    guaranteed: float  # decay rate of V over the spread of effectiveness [1/s]
    seen: float  # decay rate flown [1/s]
    settling: Array  # of steps, as :func:`steps` [s]
    flown: Flights  # from states of a flight
    spread: Flights  # from states uniform on level sets


def laws(a: Airframe) -> dict[str, LinearGains]:
    """The laws that are compared, by name."""
    lqr = hover_gains(a, integral=False)
    A, B = linearise.hover(a)
    K, S = design_lqr(A, B, np.eye(12), GENTLE * np.eye(4))
    return {
        "LQI as flown": hover_gains(a),
        "LQR": lqr,
        "LQR of the report": lqr._replace(reach=math.inf),
        f"LQR, R = {GENTLE:.0f} I": lqr._replace(K=np.ascontiguousarray(K), S=S),
        "LMI": lmi_gains(a),
    }


def study(a: Airframe, samples: int, seed: int) -> list[Result]:
    """Certify and fly every law from the same states.

    Args:
        a: The airframe.
        samples: States per draw.
        seed: Of the draws.

    Raises:
        SitlError: If there are too few samples for the bands, or nothing can be proved of a law.
    """
    if samples < len(BANDS) - 1 or seed < 0:
        raise SitlError(
            f"{samples} samples with seed {seed}: at least {len(BANDS) - 1} and a seed from 0 on are needed"
        )
    S = hover_gains(a, integral=False).S
    flown, spread = (draw(S, samples, seed, envelope=envelope) for envelope in (True, False))
    A, corners = linearise.hover(a)[0], effectiveness(a, SPREAD)
    results = []
    for name, gains in laws(a).items():
        certificate = None if gains.K_i.any() else certify(a, gains)
        caught = CAUGHT if certificate is None else certificate.level
        results.append(
            Result(
                name,
                gains,
                certificate,
                first_rise(a, gains),
                guaranteed_decay(A, corners, gains.K, gains.S),
                decay_seen(a, gains),
                steps(a, gains),
                fly(a, gains, flown, caught),
                fly(a, gains, spread, caught),
            )
        )
    return results


def threshold(flights: Flights, share: float) -> float:
    """The V up to which at least this share of the flights converges; 0 where even the lowest misses it.

    The share as a function of V is the best fit that does not rise with V.
    """
    from scipy.optimize import isotonic_regression  # noqa: PLC0415 - half a second that only this study needs

    order = np.argsort(flights.start)
    fit = isotonic_regression(flights.converged[order].astype(float), increasing=False).x
    good = np.flatnonzero(fit >= share - ROUNDING)
    return float(flights.start[order][good[-1]]) if good.size else 0.0


def share_at(flights: Flights, level: float) -> float:
    """Share that converges of the flights from within NEAR of a V; NaN without any."""
    near = np.abs(np.log(flights.start / level)) <= math.log(NEAR)
    return float(flights.converged[near].mean()) if near.any() else math.nan
