"""Constants that depend on the width of a number: their values in single precision, whose significand has 24 bits.

* Rounding to whole numbers adds and subtracts 1.5 times the number whose unit is 1.
* A quarter turn in three parts, the first two short enough for exact products with whole numbers below 2**8.
* The zero-moment law differentiates along the flow by a difference over AHEAD, twice. In doubles that step can be so
  short that the difference is the derivative; in floats the rounding of the forces, divided by the step and again by
  it, would shake the elevons.
"""

from __future__ import annotations

import numpy as np

from sitl.export.build import FlatController
from sitl.export.flown_again import RecordedFlight
from sitl.export.navigated_again import FlatEstimator, RecordedNavigation
from sitl.model.airframe import Airframe, Array
from sitl.simulation.flight import Controller

_AHEAD = 0.0009765625  # 2**-10: products with it are exact; 2**-8 and 2**-11 are farther from doubles [s]

CONSTANTS: dict[tuple[str, str], float] = {
    ("sitl.model.arithmetic", "_ROUND"): 12582912.0,
    ("sitl.model.arithmetic", "_QUARTER_1"): 1.5703125,
    ("sitl.model.arithmetic", "_QUARTER_2"): 0.000483751297,
    ("sitl.model.arithmetic", "_QUARTER_3"): 7.54978995489188216e-08,
    ("sitl.control.hover_zero_moment", "AHEAD"): _AHEAD,
    ("sitl.control.hover_zero_moment", "PER_AHEAD"): 1.0 / _AHEAD,
}


def command_differences(flight: RecordedFlight, code: FlatController) -> tuple[float, float]:
    """Largest differences of motor commands, by the fastest speed, and of elevon commands, by their travel.

    The law's own state is what the exported code made of the flight so far; a command counts until the first period in
    which another law is in force, where a jump fell into another period.

    Args:
        flight: As it was recorded.
        code: The exported code.
    """
    seen, _ = code.replay(flight.design, flight.begin, flight.rows)
    law, command = Controller._fields.index("law"), 8
    same = np.cumprod(seen[:, law] == flight.controllers[:, law]).astype(bool)
    a = Airframe(*flight.design[: len(Airframe._fields)])
    columns = slice(command, command + 4)
    apart = np.abs(_limited(seen[:, columns], a) - _limited(flight.controllers[:, columns], a))[same]
    return float(apart[:, :2].max() / a.omega_max), float(apart[:, 2:].max() / a.delta_max)


# Parts of an estimate that are compared: name, unit, and its numbers in a flat one.
ESTIMATE_PARTS = (
    ("position", "m", slice(0, 3)),
    ("velocity", "m/s", slice(3, 6)),
    ("attitude", "rad", slice(9, 13)),
    ("rates", "rad/s", slice(13, 16)),
    ("wind", "m/s", slice(16, 19)),
    ("on_ground", "", slice(23, 24)),
)


def estimate_differences(flight: RecordedNavigation, code: FlatEstimator) -> list[float]:
    """Largest differences of each of ``ESTIMATE_PARTS`` over a flight, of any component; of the attitude twice that.

    Args:
        flight: As it was recorded.
        code: The exported code.
    """
    estimates, _ = code.navigate(flight)
    apart = np.abs(estimates - flight.estimates)
    apart[:, 9:13] *= 2.0  # half an angle
    return [float(apart[:, part].max()) for _, _, part in ESTIMATE_PARTS]


def _limited(commands: Array, a: Airframe) -> Array:
    """Commands within the actuators' limits, (n, 4)."""
    most = np.array((a.omega_max, a.omega_max, a.delta_max, a.delta_max))
    least = np.array((0.0, 0.0, -a.delta_max, -a.delta_max))
    return np.clip(commands, least, most)
