"""Speed of the air before the pitot, which stands between the propellers."""

from __future__ import annotations

import math

from sitl.compiled import kernel
from sitl.model.aerodynamics import thrusts
from sitl.model.airframe import Airframe
from sitl.model.state import Actuators
from sitl.sensors.specification import Pitot


@kernel
def speed_before_tube(along: float, actuators: Actuators, a: Airframe, spec: Pitot) -> float:
    """Airspeed along the nose and a share of the slipstream [m/s].

    Args:
        along: Airspeed along the nose [m/s].
        actuators: What the slipstream comes from.
        a: The airframe.
        spec: The pitot.
    """
    T1, T2 = thrusts(actuators, along, a)
    ahead, disc = max(along, 0.0), a.blown_share * a.S / (2.0 * a.S_ratio)
    swept = ahead * ahead + max(T1 + T2, 0.0) / (a.rho * disc)  # of the mean of both propellers
    return along + spec.slipstream * (math.sqrt(swept) - ahead)
