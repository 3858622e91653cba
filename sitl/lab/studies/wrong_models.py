"""Vehicles that differ from what their controller knows of them: other constants, louder and slower instruments."""

from __future__ import annotations

from typing import Any

import numpy as np

from sitl import Airframe, SensorSet

UNCERTAIN = (
    "m", "J1", "J2", "J3", "rho", "C_l", "C_d0", "xi_f", "xi_m", "Delta_r", "a_y", "p_y", "k_f", "k_m", "C_lp", "C_mq",
    "C_nr", "C_90", "per_stall", "cp_shift",
)  # fmt: skip
SCALED_WITH = {  # one propeller's, and one centre of pressure's
    "k_f": ("k_fv", "k_fvv", "k_fw"), "k_m": ("k_mv", "k_mvv", "k_mk"), "cp_shift": ("slip_shift",),
}  # fmt: skip
NOISES = (
    "noise", "noise_level", "noise_up", "velocity_noise_level", "velocity_noise_up", "attitude_noise", "vibration",
)  # fmt: skip


def drawn_scale(random: np.random.Generator, error: float) -> dict[str, float]:
    """Factors of the uncertain parameters, each within a relative error of 1."""
    return {name: 1.0 + float(random.uniform(-1.0, 1.0)) * error for name in UNCERTAIN}


def perturbed(a: Airframe, scale: dict[str, float]) -> Airframe:
    """An airframe with some parameters scaled, and with them what belongs to the same propeller."""
    names = {also: factor for name, factor in scale.items() for also in (name, *SCALED_WITH.get(name, ()))}
    return a._replace(**{name: getattr(a, name) * factor for name, factor in names.items()})


def noisier(sensors: SensorSet, factor: float, delay: float) -> SensorSet:
    """Instruments with more noise, and a slower pipeline.

    Args:
        sensors: As specified.
        factor: On every noise and vibration.
        delay: From inertial reading to actuator [s].
    """

    def louder(part: Any) -> Any:  # noqa: ANN401 - a specification
        return part._replace(**{name: factor * getattr(part, name) for name in NOISES if name in part._fields})

    parts = {name: louder(part) for name, part in sensors._asdict().items()}
    parts["pipeline"] = sensors.pipeline._replace(latency=delay)
    return SensorSet(**parts)
