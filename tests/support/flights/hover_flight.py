"""Flights of the whole vehicle under chosen hover laws, far above the ground."""

import math

import numpy as np

from sitl.control.reference import hover_at
from sitl.model.airframe_files import load
from sitl.model.quaternions import hover
from sitl.model.state import Body
from sitl.model.vectors import Vector
from sitl.simulation.flight_errors import DivergedError
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from tests.support.flights.estimates import quaternion, vector

NOMINAL = load("nominal").parameters
ALOFT = 500.0  # [m]
LINEAR_ALONE = {"v_enter": 0.5e9, "v_leave": 1e9}
ZERO_MOMENT_ALONE = {"v_enter": 0.0, "v_leave": math.inf}


class Flight:
    """Recorded hover flight, one row per 10 ms; positions are relative to the target."""

    def __init__(self, recording, target, *, diverged):
        self.time, self.v_hover = recording.time, recording.v_hover
        self.e, self.v, self.q = recording.position - target, recording.velocity, recording.attitude
        self.actuator, self.pointing = recording.actuators, recording.pointing
        self.distance = np.linalg.norm(self.e, axis=1)
        self.tilt = np.arccos(np.clip(2.0 * (self.q[:, 1] * self.q[:, 3] - self.q[:, 0] * self.q[:, 2]), -1.0, 1.0))
        self.jumps, self.diverged = recording.jumps, diverged

    def settled(self, radius):
        """Time after which the error stays below ``radius`` [s]; infinite if it does not."""
        outside = np.flatnonzero(self.distance > radius)
        if self.diverged or (outside.size and outside[-1] + 1 == self.time.size):
            return math.inf
        return self.time[outside[-1] + 1] if outside.size else 0.0


def fly(target, *, law, duration, attitude=None, v=(0, 0, 0), w=(0, 0, 0), wind=(0, 0, 0), heading=0.0, **tuning):
    """Fly from rest at the origin; arguments as in ``Start`` and ``Tuning``, attitude a quaternion."""
    start = Start(up=ALOFT, heading=heading, airborne=True)
    vehicle = Simulation(NOMINAL, start=start, tuning=Tuning(**tuning))
    q = hover(heading) if attitude is None else quaternion(attitude)
    vehicle.place(Body(Vector(0.0, 0.0, ALOFT), vector(v), q, vector(w)))
    vehicle.begin_flight(law)
    vehicle.set_wind(wind)
    aim = np.add(target, (0.0, 0.0, ALOFT))
    vehicle.reference = hover_at(tuple(aim), heading, 3.0)
    try:
        return Flight(vehicle.record(duration, 100.0), aim, diverged=False)
    except DivergedError as error:
        return Flight(error.recording, aim, diverged=True)
