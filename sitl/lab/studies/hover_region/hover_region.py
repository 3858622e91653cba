"""Region of attraction of the linear hover law: flights from random states, and a proof (report, section 5.1).

The report takes its thresholds 250 and 400 from sampled trajectories. Here states are drawn on level sets of V and
flown by the linear law alone on the whole plant (:mod:`sitl.lab.studies.hover_region.hover_region_flights`). A flight
has converged once it is in the set that :mod:`sitl.lab.proofs.region` proves; V is the LQR's, whichever law flies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Airframe, Array, SitlError
from sitl.control.hover_linear import LinearGains
from sitl.design import linearise
from sitl.design.lmi import SPREAD, effectiveness, guaranteed_decay, lmi_gains
from sitl.design.lqr import gentle_hover_gains, hover_gains
from sitl.design.lqr import lqr as design_lqr
from sitl.design.proved import PROVED_LEVEL, is_proved, proved_gains
from sitl.lab.proofs.proof import Proof
from sitl.lab.proofs.region import Certificate, certify, chart_level, rate_level, reach_level, saturation_level
from sitl.lab.proofs.rise import first_rise
from sitl.lab.studies.hover_region.hover_region_flights import (
    V_BANDS,
    RegionFlights,
    decay_seen,
    draw,
    fly,
    steps,
)

CONVERGED_V = 0.02  # V at which a law without a certificate counts as converged
GENTLE_WEIGHT = 10.0  # of u, for a gentler LQR
SHARE_ROUNDING = 1e-9  # tolerance of comparisons of shares
NEIGHBOURHOOD = 1.25  # factor of V within which a flight counts for a level
MIN_CONVERGED_SHARE = 0.95  # of flights that must converge from a threshold to leave
DEFAULT_THRESHOLDS, REPORT_THRESHOLDS = (20.0, 50.0), (250.0, 400.0)  # thresholds to enter and to leave


class LawRegion(NamedTuple):
    """Results for one law."""

    name: str
    gains: LinearGains
    certificate: Certificate | None  # None where V leaves the integral out
    rise: float  # the law's own V at which it first rises
    guaranteed: float  # decay rate of V for every effectiveness within the spread [1/s]
    seen: float  # decay rate flown [1/s]
    settling: Array  # settling times of steps, as :func:`steps` gives them [s]
    flown: RegionFlights  # from states that occur in flights
    spread: RegionFlights  # from states uniform on level sets


def laws(a: Airframe) -> dict[str, LinearGains]:
    """The compared laws by name."""
    lqr = hover_gains(a, integral=False)
    A, B = linearise.hover(a)
    K, S = design_lqr(A, B, np.eye(12), GENTLE_WEIGHT * np.eye(4))
    proved = {"LQI as flown": proved_gains(a)} if is_proved(a) else {}
    return proved | {
        "LQI, R = 5 I": gentle_hover_gains(a),
        "LQI of the report": hover_gains(a),
        "LQR": lqr,
        "LQR of the report": lqr._replace(reach=math.inf),
        f"LQR, R = {GENTLE_WEIGHT:.0f} I": lqr._replace(K=np.ascontiguousarray(K), S=S),
        "LMI": lmi_gains(a),
    }


def study(a: Airframe, samples: int, seed: int) -> list[LawRegion]:
    """Certify and fly every law from the same states.

    Args:
        a: The airframe.
        samples: States per draw.
        seed: Of the draws.

    Raises:
        SitlError: If there are too few samples for the bands, or a law has no certificate.
    """
    if samples < len(V_BANDS) - 1 or seed < 0:
        raise SitlError(
            f"{samples} samples with seed {seed}: at least {len(V_BANDS) - 1} samples and a seed from 0 on are needed"
        )
    S = hover_gains(a, integral=False).S
    flown, spread = (draw(S, samples, seed, envelope=envelope) for envelope in (True, False))
    A, corners = linearise.hover(a)[0], effectiveness(a, SPREAD)
    results = []
    for name, gains in laws(a).items():
        certificate = certified(a, gains)
        converged_v = CONVERGED_V if certificate is None else certificate.level
        results.append(
            LawRegion(
                name=name,
                gains=gains,
                certificate=certificate,
                rise=first_rise(a, gains),
                guaranteed=guaranteed_decay(A, corners, gains.K, gains.S),
                seen=decay_seen(a, gains),
                settling=steps(a, gains),
                flown=fly(a, gains, flown, converged_v),
                spread=fly(a, gains, spread, converged_v),
            )
        )
    return results


def certified(a: Airframe, gains: LinearGains) -> Certificate | None:
    """The certificate of a law: with commands in force at once, or stored and with the delay for the law that flies."""
    if not gains.K_i.any():
        return certify(a, gains, sampled=False)
    if not gains.S_ii.any():
        return None
    rate = rate_level(a, Proof.of(a, gains), saturation_level(a, gains))
    return Certificate(PROVED_LEVEL, saturation_level(a, gains), rate, reach_level(gains), chart_level(gains))


def threshold(flights: RegionFlights, share: float) -> float:
    """The V up to which at least this share of the flights converges; 0 if the lowest V already misses it.

    The share as a function of V is the best fit that does not rise with V.
    """
    from scipy.optimize import isotonic_regression  # noqa: PLC0415 - half a second that only this study needs

    order = np.argsort(flights.start)
    fit = isotonic_regression(flights.converged[order].astype(float), increasing=False).x
    good = np.flatnonzero(fit >= share - SHARE_ROUNDING)
    return float(flights.start[order][good[-1]]) if good.size else 0.0


def share_at(flights: RegionFlights, level: float) -> float:
    """Share that converges of the flights that start within NEIGHBOURHOOD of a V; NaN if there are none."""
    near = np.abs(np.log(flights.start / level)) <= math.log(NEIGHBOURHOOD)
    return float(flights.converged[near].mean()) if near.any() else math.nan
