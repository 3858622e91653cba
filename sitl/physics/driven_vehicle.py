"""A vehicle without its controller: actuator commands of somebody else's autopilot in, readings of the instruments out.

World and body are those of the wire here, NED and FRD; the body's x is along the nose, as in forward flight.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from protocol.frames import flip, flip_quaternion
from sitl.model.airframe import BATTERY, Airframe
from sitl.model.battery import Battery
from sitl.model.state import Actuators
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import (
    BAROMETER,
    FIRST_DELAYED,
    GNSS,
    MAGNETOMETER,
    MOTION_CAPTURE,
    N_DELAYED,
    PITOT,
    POSITION_VARIANCE,
    READING_SIZE,
    SensorSet,
)
from sitl.simulation.arrays import ENDED_WELL
from sitl.simulation.avionics import Navigation
from sitl.simulation.open_loop import Heard
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.vehicle.parameters import WorldSettings

FULL = WorldSettings().battery  # energy of a full battery [J]
Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]


class Pose(NamedTuple):
    """A reading of motion capture."""

    position: Triple  # NED [m]
    attitude: Quadruple  # body FRD to NED
    variance: float  # of the position, per axis [m2]
    attitude_variance: float  # about each axis [rad2]


class SatelliteFix(NamedTuple):
    """A reading of the satellite receiver."""

    position: Triple  # NED [m]
    velocity: Triple  # NED [m/s]


class Seen(NamedTuple):
    """All that an autopilot may be told; readings are None unless one has arrived since the step before."""

    time: float  # simulated, since boot [s]
    rates: Triple  # of the gyroscope, mean of the step, FRD [rad/s]
    force: Triple  # specific force of the accelerometer, likewise [m/s2]
    position: Triple  # the truth, NED [m]
    velocity: Triple  # likewise [m/s]
    acceleration: Triple  # likewise, mean of the step [m/s2]
    attitude: Quadruple  # likewise, body FRD to NED
    true_rates: Triple  # likewise, FRD [rad/s]
    wind: Triple  # velocity of the air, NED [m/s]
    voltage: float  # of the battery [V]
    current: float  # [A]
    field: Triple | None = None  # magnetic, FRD [T]
    height: float | None = None  # of the barometer, above the origin [m]
    airspeed: float | None = None  # of the pitot tube [m/s]
    fix: SatelliteFix | None = None
    pose: Pose | None = None


class DrivenVehicle(Simulation):
    """One DarkO that is flown from outside.

    Args:
        airframe: The airframe.
        seed: Of gusts and instruments.
        start: Where it begins; in the air it begins at rest.
        sensors: Specifications of the instruments.
    """

    def __init__(self, airframe: Airframe, *, seed: int, start: Start, sensors: SensorSet) -> None:
        super().__init__(airframe, seed=seed, start=start, navigation=Navigation.SENSORS, sensors=sensors)
        self._heard = Heard(np.zeros(6), np.zeros((N_DELAYED, READING_SIZE)), np.zeros(N_DELAYED))
        self._newest = np.zeros(N_DELAYED)

    def drive(self, command: Actuators | None, periods: int) -> Seen:
        """Fly for control periods under one command; None: disarmed, the motors stop.

        Raises:
            DivergedError: If the state is no longer finite.
        """
        self.armed = command is not None
        self._arrays.set_air(self.environment)
        velocity, flown = self.truth.body.velocity, 0
        inertial = np.zeros(6)
        while flown < periods:
            stretch = self._arrays.drive(command or Actuators(0.0, 0.0, 0.0, 0.0), periods - flown, self._heard)
            inertial += self._heard.inertial * (stretch.periods / periods)
            flown += stretch.periods
            if stretch.end not in ENDED_WELL:
                raise self.failure(stretch.end)
        return self._seen_after(inertial, velocity, periods * PERIOD)

    def _seen_after(self, inertial: np.ndarray, before: Triple, seconds: float) -> Seen:
        body = self.truth.body
        change = [(now - then) / seconds for now, then in zip(body.velocity, before, strict=True)]
        reading = self.avionics.battery_reading(self.battery, self.power, self.periods)
        return Seen(
            time=self.time,
            rates=flip(inertial[:3]),
            force=flip(inertial[3:]),
            position=flip(body.position),
            velocity=flip(body.velocity),
            acceleration=flip(change),
            attitude=flip_quaternion(body.attitude),
            true_rates=flip(body.rates),
            wind=flip(self.wind),
            voltage=reading.voltage,
            current=reading.current,
            **self._news(),
        )

    @property
    def battery(self) -> Battery:
        """The battery, of as much energy as the airframe counts as drawn."""
        resistance = self.airframe.battery_resistance if self.airframe.energy_account == BATTERY else 0.0
        return Battery(FULL, min(self.energy, 0.99 * FULL), resistance)

    def _news(self) -> dict[str, Any]:
        """The readings that have arrived since the step before."""
        heard, news = self._heard, dict[str, Any]()
        fresh = heard.sampled > self._newest
        self._newest[:] = heard.sampled
        for instrument in np.flatnonzero(fresh) + FIRST_DELAYED:
            row = [float(x) for x in heard.readings[instrument - FIRST_DELAYED]]
            if instrument == MAGNETOMETER:
                news["field"] = flip(row[:3])
            elif instrument == BAROMETER:
                news["height"] = row[0]
            elif instrument == PITOT:
                news["airspeed"] = row[0]
            elif instrument == GNSS:
                news["fix"] = SatelliteFix(flip(row[:3]), flip(row[3:6]))
            elif instrument == MOTION_CAPTURE:
                norm = math.hypot(*row[3:7])
                attitude = flip_quaternion([x / norm for x in row[3:7]])
                news["pose"] = Pose(flip(row[:3]), attitude, row[POSITION_VARIANCE], row[POSITION_VARIANCE + 1])
        return news

    def warm_up(self) -> None:
        """Compile what flies, or read it from disk; nothing moves."""
        self._arrays.drive(Actuators(0.0, 0.0, 0.0, 0.0), 0, self._heard)

    def restart(self) -> None:
        """Put the vehicle back to its start, whole, disarmed and at rest; its time goes on."""
        self.armed = False
        self.begin(self.start)
