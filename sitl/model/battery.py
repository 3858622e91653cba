"""The battery: what the propellers' motors draw from it, and what its owner reads of what is left."""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.airframe import BATTERY, Airframe
from sitl.model.propeller import torque, torque_by_air
from sitl.model.state import Actuators

FULL_VOLTAGE, EMPTY_VOLTAGE = 12.6, 9.9  # of three lithium cells [V]


@kernel
def shaft_power(actuators: Actuators, inflow: float, a: Airframe) -> float:
    """Power of both shafts [W]."""
    w1, w2 = actuators.left_motor, actuators.right_motor
    cubes = a.k_m * (w1 * w1 * w1 + w2 * w2 * w2)
    return cubes + (w1 * torque_by_air(w1, inflow, a) + w2 * torque_by_air(w2, inflow, a))


@kernel
def battery_power(actuators: Actuators, inflow: float, a: Airframe) -> float:
    r"""Power drawn from the battery by both motors [W]: shafts, copper, friction, controllers and its own resistance.

    A motor of constant K takes the current i = Q / K + i_0 at the voltage K w + R i; the controllers do not feed power
    of a windmilling propeller back. The battery of voltage U and resistance r loses r I^2 besides.
    """
    drawn = _motor_power(actuators.left_motor, inflow, a) + _motor_power(actuators.right_motor, inflow, a)
    at_terminals = drawn / a.controller_efficiency + a.avionics_power
    room = a.battery_voltage * a.battery_voltage - 4.0 * a.battery_resistance * at_terminals
    current = 2.0 * at_terminals / (a.battery_voltage + math.sqrt(max(room, 0.0)))
    return at_terminals + a.battery_resistance * current * current


@kernel
def _motor_power(speed: float, inflow: float, a: Airframe) -> float:
    """Electrical power into one motor [W]."""
    current = max(torque(speed, inflow, a) / a.motor_constant + a.idle_current, 0.0)
    return current * (a.motor_constant * speed + a.motor_resistance * current) if speed > 0.0 else 0.0


@kernel
def drawn_power(actuators: Actuators, inflow: float, a: Airframe) -> float:
    """The power that the vehicle's energy account counts [W]: the battery's, or the shafts' as in the report."""
    return battery_power(actuators, inflow, a) if a.energy_account == BATTERY else shaft_power(actuators, inflow, a)


class Battery(NamedTuple):
    """A battery after some energy was drawn, as the vehicle reads it.

    The open voltage falls linearly from full to empty, and sags with the current over the cells' resistance. Where the
    airframe counts the energy of shafts, as the report does, the store is one of shaft energy and does not sag.
    """

    capacity: float  # energy when full [J]
    used: float  # energy drawn since then [J]
    resistance: float = 0.0  # of the cells [ohm]
    lost: float = 0.0  # voltage of cells that have failed [V]

    @property
    def remaining(self) -> float:
        """Share of the energy that remains, 0..1."""
        return max(0.0, 1.0 - self.used / self.capacity)

    @property
    def open_voltage(self) -> float:
        """Voltage without load [V]."""
        return EMPTY_VOLTAGE + (FULL_VOLTAGE - EMPTY_VOLTAGE) * self.remaining - self.lost

    def current(self, power: float) -> float:
        """Current [A] when its cells give up a power, losses in them included [W]."""
        return power / self.open_voltage

    def voltage(self, power: float = 0.0) -> float:
        """Voltage at the terminals at such a power [V]."""
        return self.open_voltage - self.resistance * self.current(power)
