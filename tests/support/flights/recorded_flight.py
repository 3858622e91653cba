"""Recorded flights: the bare vehicle on a leg, and the aircraft under its autopilot."""

import math
from dataclasses import replace

import numpy as np

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.frames import LocalFrame
from protocol.plans import load as load_plan
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.guidance.legs import leg_reference
from sitl.model.airframe_files import load
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import Aircraft, is_forward
from sitl.vehicle.parameters import Configuration, WorldSettings
from tests.support.paths import DATA

NOMINAL = load("nominal").parameters
WORLD = World(LocalFrame(HOME), ARENAS["open"])
HIGH = 25.0  # where flights in the air begin [m]
SAMPLE = 10  # control periods between samples: one autopilot tick


class Track:
    """The record of a flight, one row per 20 ms: time, law, state, actuators, energy, wind and its estimate, phase."""

    def __init__(self, vehicle):
        self.vehicle = vehicle
        self._rows = []

    def advance(self, seconds, fly=None, each=lambda: None):
        """Fly on, by ``fly(periods)`` unless the bare vehicle flies; ``each`` is called after every sample."""
        for _ in range(round(seconds * 1000 / 2 / SAMPLE)):
            (fly or self.vehicle.advance)(SAMPLE)
            v = self.vehicle
            truth = v.truth
            (p, u, q, w), act = truth.body, truth.actuators
            state = (v.time, v.law, *p, *u, *q, *w, *act, v.energy, *v.wind, *v.wind_estimate, is_forward(v))
            self._rows.append(state)
            each()

    def _columns(self, first, last):
        return np.array([row[first:last] for row in self._rows])

    @property
    def time(self):
        return self._columns(0, 1)[:, 0]

    @property
    def law(self):
        return self._columns(1, 2)[:, 0]

    @property
    def p(self):
        return self._columns(2, 5)

    @property
    def v(self):
        return self._columns(5, 8)

    @property
    def q(self):
        return self._columns(8, 12)

    @property
    def actuator(self):
        return self._columns(15, 19)

    @property
    def energy(self):
        return self._columns(19, 20)[:, 0]

    @property
    def wind(self):
        return self._columns(20, 23)

    @property
    def estimate(self):
        return self._columns(23, 26)

    @property
    def flown_forward(self):
        return self._columns(26, 27)[:, 0] > 0.0

    @property
    def names(self):
        """Of the jumps, in order."""
        return [jump.name for jump in self.vehicle.jumps]

    @property
    def failsafes(self):
        return sum(jump.target is Law.FAILSAFE for jump in self.vehicle.jumps)

    def saturated(self):
        """Share of the time that an elevon is at its stop."""
        limit = self.vehicle.airframe.delta_max
        return float((np.abs(self.actuator[:, 2:]) > limit - 1e-6).any(axis=1).mean())

    def beyond(self, end, azimuth):
        """The greatest distance beyond a point along an azimuth [m]."""
        ahead = np.array((math.cos(azimuth), math.sin(azimuth)))
        return float(((self.p[:, :2] - np.array(end)[:2]) @ ahead).max())


def hop(
    azimuth=0.0, *, distance=100.0, up=10.0, heading=0.0, airspeed=15.0, seconds=25.0, seed=1, gusts=0.0,
    wind=(0.0, 0.0, 0.0), plant=NOMINAL, design_model=None, tuning=None,
):  # fmt: skip
    """From the hover at ``HIGH``, fly forward to a point along an azimuth, and hover there."""
    vehicle = Simulation(
        plant, seed=seed, start=Start(up=HIGH, heading=heading, airborne=True), design_model=design_model, tuning=tuning
    )
    vehicle.begin_flight(Law.HOVER_LINEAR)
    vehicle.set_wind(wind, gusts)
    end = (distance * math.cos(azimuth), distance * math.sin(azimuth), HIGH + up)
    here = vehicle.reference
    vehicle.reference = leg_reference(here.position, end, here, airspeed, stop=True)
    track = Track(vehicle)
    track.advance(seconds)
    return track


def on_a_leg(*, airspeed=15.0, seed=1, gusts=0.0, wind=(0.0, 0.0, 0.0), plant=NOMINAL, design_model=None, tuning=None):
    """A vehicle at the start of an endless leg northwards."""
    vehicle = Simulation(
        plant, seed=seed, start=Start(up=200.0, airborne=True), design_model=design_model, tuning=tuning
    )
    vehicle.begin_flight(Law.HOVER_LINEAR)
    vehicle.set_wind(wind, gusts)
    start = vehicle.reference
    vehicle.reference = leg_reference(start.position, (5000.0, 0.0, 200.0), start, airspeed, stop=False)
    return vehicle


class Flight(Track):
    """An aircraft under its autopilot, with its texts to the pilot."""

    def __init__(
        self, *, airborne=True, seed=1, settings=None, tuning=None, wind_speed=0.0, wind_from=0.0, gusts=0.0,
        plant=NOMINAL, design_model=None,
    ):  # fmt: skip
        start = Start(up=HIGH, airborne=True) if airborne else Start()
        super().__init__(Simulation(plant, seed=seed, start=start, design_model=design_model))
        configuration = Configuration(
            settings or Settings(), tuning or Tuning(), WorldSettings(wind_speed, wind_from, gusts, battery=1e6)
        )
        self.aircraft = Aircraft(self.vehicle, WORLD, configuration, airborne=airborne)
        self.autopilot = self.aircraft.autopilot
        self.reached = {}  # time at which each mission item was done [s]
        self.texts = []

    def fly(self, seconds, each=lambda: None):
        """Fly on for a time."""

        def note():
            self.reached |= {seq: self.vehicle.time for seq in self.autopilot.reached() if seq not in self.reached}
            self.texts += [notice.text for notice in self.autopilot.notices()]
            each()

        self.advance(seconds, self.aircraft.advance, note)

    def fly_until(self, condition, limit):
        """Fly until a condition holds; the test fails if it never does within ``limit`` seconds."""
        end = self.vehicle.time + limit
        while not condition():
            assert self.vehicle.time < end, f"after {limit} s under {self.vehicle.law.name} at {self.p[-1]}"
            self.fly(0.02)

    def fly_mission(self, items, limit=200.0):
        """Arm, fly a mission to its end and, if it lands, until the motors stop."""
        self.autopilot.arming.arm()
        self.autopilot.missions.load(items)
        assert self.autopilot.missions.start().accepted
        mission = self.autopilot.mission
        assert mission is not None
        self.fly_until(lambda: mission.finished, limit)
        return self


def square(airspeed):
    """The 100 m square of tests/data at an airspeed."""
    items = load_plan(DATA / "square100.plan").items
    return tuple(
        replace(item, params=(0.0, airspeed, -1.0, 0.0)) if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED else item
        for item in items
    )


def off_polygon(p, corners):
    """Horizontal distance to the nearest side of a closed polygon, (n,) [m]."""
    nearest = np.full(len(p), np.inf)
    corners = np.asarray(corners, dtype=float)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = b - a
        along = np.clip((p[:, :2] - a) @ side / (side @ side), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(p[:, :2] - a - along[:, None] * side, axis=1))
    return nearest
