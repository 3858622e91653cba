"""The airframe's constants that a flight may tell, and the airframe with other values of them.

Forces and moments reach the sensors over mass and inertia only, so that no flight tells mass and inertias apart from
the forces: mass and lengths are taken as known, everything else is counted per mass. All unknowns are shares of the
set's own value, as logarithms where the sign is sure.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from sitl import Airframe, SitlError
from sitl.model.airframe import FIRST_ORDER, STALL

ADVANCE = "advance"  # key of the propeller's advance ratio, which is no field of the airframe
MEASURED = ("m", "g", "S", "b", "c", "a_y", "p_y")  # by scales and rulers
MAX_LOGARITHM = 10.0  # that a descent may try: a logarithm


class Unknown(NamedTuple):
    """One constant to be found."""

    key: str  # field of the airframe
    meaning: str
    unit: str
    deviation: float  # assumed before the flight, as a share of the set's value
    signed: bool = False  # whether it may change its sign: then it is no logarithm
    scale: float = 0.0  # of a signed one, where the set's value is zero


_ALWAYS = (
    Unknown("k_f", "thrust coefficient", "kg m", 0.5),
    Unknown("C_l", "lift slope", "1/rad", 0.5),
    Unknown("C_d0", "axial drag", "-", 0.5),
    Unknown("C_y0", "lateral drag", "-", 0.5, signed=True, scale=0.1),
    Unknown("xi_f", "elevon share of the lift", "-", 0.3),
    Unknown("xi_m", "elevon arm", "-", 0.5),
    Unknown("Delta_r", "neutral point behind the mass centre", "m", 0.5),
    Unknown("k_m", "torque coefficient", "kg m2", 0.5),
    Unknown("J1", "inertia about x", "kg m2", 0.5),
    Unknown("J2", "inertia about y", "kg m2", 0.5),
    Unknown("J3", "inertia about z", "kg m2", 0.5),
    Unknown("C_mq", "pitch damping", "-", 0.5),
    Unknown("C_nr", "yaw damping", "-", 0.5),
    Unknown("J_p", "inertia of a propeller", "kg m2", 0.5),
)
_LINEAR = (
    Unknown("S_ratio", "wing over four discs: the slipstream", "-", 0.3),
    Unknown("C_lp", "roll damping", "-", 0.5),
    Unknown("C_lr", "roll by yaw rate", "-", 0.5, signed=True),
    Unknown("C_np", "yaw by roll rate", "-", 0.5, signed=True),
)
_STALL = (
    Unknown("C_90", "normal force across the stream", "-", 0.3),
    Unknown("per_stall", "1 / sin2 of the stall's incidence", "-", 0.5),
    Unknown("cp_shift", "shift of the centre of pressure", "m", 0.5),
)
_PROPELLER = (
    Unknown("S_p", "disc that the slipstream comes from", "m2", 0.3),
    Unknown(ADVANCE, "advance ratio that the blades feel", "-", 0.3),
    Unknown("k_fc", "thrust by air across the disc", "kg/m", 0.5),
    Unknown("k_h", "force of air across the disc", "kg", 0.5),
)
_LAGS = (Unknown("motor_tau", "lag of the motors", "s", 0.5), Unknown("elevon_tau", "lag of the elevons", "s", 0.5))
_RATES = (
    Unknown("omega_rate", "rate limit of the motors", "rad/s2", 0.3),
    Unknown("delta_rate", "rate limit of the elevons", "rad/s", 0.3),
)


def has_propeller(a: Airframe) -> bool:
    """Whether its propellers feel the air along their axis."""
    return a.k_fv != 0.0 or a.k_fvv != 0.0


def unknowns_of(a: Airframe, known: Mapping[str, float] | None = None) -> tuple[Unknown, ...]:
    """Unknowns that a flight may tell; a constant that the set has at zero stays there, unless it has a scale.

    Args:
        a: The set.
        known: Values that the user knows, by key.

    Raises:
        SitlError: A known key is neither an unknown nor measured.
    """
    found = [*_ALWAYS, *(_STALL if a.aerodynamics == STALL else _LINEAR[1:])]
    found += _PROPELLER if has_propeller(a) else _LINEAR[:1]
    found += _LAGS if a.actuator_model == FIRST_ORDER else _RATES
    keys = [one.key for one in found]
    for key in known or {}:
        if key not in keys and key not in MEASURED:
            raise SitlError(f"{key} is not one of {', '.join((*MEASURED, *keys))}")
    return tuple(u for u in found if u.key not in (known or {}) and (value_of(a, u.key) != 0.0 or u.scale > 0.0))


def value_of(a: Airframe, key: str) -> float:
    """The set's value of an unknown; of the advance ratio it is 1."""
    return 1.0 if key == ADVANCE else float(getattr(a, key))


def value_at(a: Airframe, unknown: Unknown, x: float) -> float:
    """The value of an unknown that is at ``x``."""
    value = value_of(a, unknown.key)
    return (
        value + x * (abs(value) or unknown.scale)
        if unknown.signed
        else value * math.exp(min(max(x, -MAX_LOGARITHM), MAX_LOGARITHM))
    )


def airframe_at(a: Airframe, unknowns: Sequence[Unknown], x: Sequence[float]) -> Airframe:
    """The airframe whose unknowns are at ``x``."""
    return with_values(a, {u.key: value_at(a, u, float(share)) for u, share in zip(unknowns, x, strict=False)})


def with_values(a: Airframe, values: Mapping[str, float]) -> Airframe:
    """The airframe with other values, and with them those of the same propeller and of the same slipstream."""
    fields: dict[str, Any] = {key: value for key, value in values.items() if key != ADVANCE}
    thrust, torque = (fields[key] / getattr(a, key) if key in fields else 1.0 for key in ("k_f", "k_m"))
    advance = values.get(ADVANCE, 1.0)
    fields |= {"k_fv": a.k_fv * thrust * advance, "k_fvv": a.k_fvv * thrust * advance**2, "k_fw": a.k_fw * thrust}
    if "cp_shift" in fields:
        fields["slip_shift"] = a.slip_shift * fields["cp_shift"] / a.cp_shift
    fields |= {name: getattr(a, name) * torque * advance**power for name, power in _TORQUE_BY_AIR}
    fields["advance_knot"] = a.advance_knot / advance
    if "S_p" in fields:  # the wing's part in the slipstream stays
        fields["S_ratio"] = a.S_ratio * a.S_p / fields["S_p"]
    return a._replace(**fields)


_TORQUE_BY_AIR = (("k_mv", 1), ("k_mvv", 2), ("k_mk", 2))
_PER_MASS = (
    "m", "J1", "J2", "J3", "J_p", "C_l", "C_d0", "C_y0", "C_90", "C_lp", "C_lq", "C_lr", "C_mp", "C_mq", "C_mr", "C_np",
    "C_nq", "C_nr", "k_f", "k_fv", "k_fvv", "k_fw", "k_fc", "k_h", "k_m", "k_mv", "k_mvv", "k_mk", "S_p",
)  # fmt: skip


def of_mass(a: Airframe, mass: float) -> Airframe:
    """The airframe of another mass [kg] that flies the same: no sensor could tell the two apart off the ground."""
    share = mass / a.m
    scaled: dict[str, Any] = {name: share * getattr(a, name) for name in _PER_MASS}
    return a._replace(**scaled, S_ratio=a.S_ratio / share)
