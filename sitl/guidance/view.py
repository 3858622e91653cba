"""The vehicle's state as guidance and the autopilot see it, and the limits within which references are made."""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.dialect.vocabulary import Law, Regime
from sitl.control.reference import Point
from sitl.model.ground import Crash

# The vehicle's state as guidance and the autopilot see it.


class VehicleView(NamedTuple):
    """The vehicle at one tick of the autopilot, as it is estimated.

    World frame NWU, SI units, headings in radians about world z (from north towards west).
    """

    time: float  # since boot [s]
    p: Point  # position [m]
    v: Point  # velocity [m/s]
    heading: float  # of the belly while upright, of the nose in forward flight [rad]
    tilt: float  # angle between the nose and the vertical [rad]
    landed: bool  # on the ground: the law in force is LANDED or CRASHED
    battery_remaining: float  # share of the battery, 0..1
    forward: bool = False  # in forward flight, or in a front or back transition
    wind: Point = (0.0, 0.0, 0.0)  # [m/s]
    stopping_distance: float = 0.0  # from the present speed in forward flight [m]
    battery_energy: float = math.inf  # left in the battery [J]
    law: Law = Law.LANDED  # in force
    regime: Regime = Regime.GROUND
    crash: Crash | None = None  # what broke it
    touched: str = ""  # what it touched then; empty: the ground
    rates: Point = (0.0, 0.0, 0.0)  # body rates [rad/s]
    gyroscope_failed: bool = False  # it repeats itself, or leaps
    accelerometer_failed: bool = False  # likewise
    aligned: bool = True  # the navigation filter runs
    awaited: tuple[str, ...] = ()  # what navigation waits for before a flight, in plain words
    position_age: float = 0.0  # since the last aid of the position [s]; infinite before the first
    height_deviation: float = 0.0  # of the height that is believed [m]
    failed_motors: tuple[int, ...] = ()  # 1 left, 2 right: their controllers say so
    unfused: tuple[str, ...] = ()  # instruments that navigation goes on without
    unexplained: tuple[float, float] = (0.0, 0.0)  # rolling and yawing moment, as shares of what a hover has of them
    shaking: float = 0.0  # rms of that rolling moment of late, likewise
    attitude: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)  # FLU -> NWU, (w, x, y, z)
    resets: int = 0  # of the estimate to readings that it had refused


# Limits of flight: speeds and rates within which guidance makes references.


MAX_HOVER_CLIMB, MAX_HOVER_DESCENT = 2.5, 2.0  # vertical speeds of the hover [m/s]
MAX_HOVER_TURN_RATE = math.radians(20.0)  # of the heading: the hover laws follow no faster turn evenly [rad/s]
MAX_HEADING_RATE = math.radians(30.0)  # at which a step of the wanted heading is turned [rad/s]
MAX_HEADING_STEP = math.radians(45.0)  # but for steps that a pilot or program steers, up to this [rad]
MIN_HOLD_HEIGHT = 1.5  # nothing moves sideways lower than this, and no hold is flown lower [m]
MAX_CENTRIPETAL = 5.0  # lateral acceleration on a circle [m/s2]
