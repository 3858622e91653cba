"""Flights that go on the wing: hops of the bare vehicle, and the craft under its autopilot with what it recorded."""

import math
from dataclasses import replace

import numpy as np

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.frames import Geodetic, LocalFrame
from protocol.plans import load as load_plan
from protocol.plans.mission import MissionItem
from sitl.airframe import load
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.legs import leg_reference
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft, is_forward
from sitl.parameters import Bindings, Surroundings
from sitl.simulation.simulation import Simulation, Start, Tuning
from tests.support.paths import DATA

NOMINAL = load("nominal").parameters
HOME = Geodetic(43.5648, 1.4811, 150.0)
WORLD = World(LocalFrame(HOME), ARENAS["open"])
HIGH = 25.0  # where hops and airborne crafts begin [m]
SAMPLE = 10  # control periods between samples: one autopilot tick
NAN = math.nan
FORWARD = [int(law) for law in Law if is_forward(law)]


class Track:
    """What a flight was, one row per 20 ms: time, law, position, velocity, actuators, energy, wind and its estimate."""

    def __init__(self, vehicle):
        self.vehicle = vehicle
        self._rows = []

    def advance(self, seconds, fly=None, each=lambda: None):
        """Fly on, by ``fly(periods)`` if it is not the bare vehicle that flies; ``each`` follows every sample."""
        for _ in range(round(seconds * 1000 / 2 / SAMPLE)):
            (fly or self.vehicle.advance)(SAMPLE)
            v = self.vehicle
            truth = v.truth
            (p, u, q, w), act = truth.body, truth.actuators
            state = (v.time, v.law, *p, *u, *q, *w, *act, v.energy, *v.wind, *v.wind_estimate)
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
    def winged(self):
        return np.isin(self.law, FORWARD)

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
        """How far it goes beyond a point along an azimuth at most [m]."""
        ahead = np.array((math.cos(azimuth), math.sin(azimuth)))
        return float(((self.p[:, :2] - np.array(end)[:2]) @ ahead).max())


def hop(
    azimuth=0.0, *, distance=100.0, up=10.0, heading=0.0, airspeed=15.0, seconds=25.0, seed=1, gusts=0.0,
    wind=(0.0, 0.0, 0.0), plant=NOMINAL, design_model=None, tuning=None,
):  # fmt: skip
    """From the hover at ``HIGH``, on the wing to a point along an azimuth, and hover there."""
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
    """A vehicle that sets out on a leg northwards without an end."""
    vehicle = Simulation(
        plant, seed=seed, start=Start(up=200.0, airborne=True), design_model=design_model, tuning=tuning
    )
    vehicle.begin_flight(Law.HOVER_LINEAR)
    vehicle.set_wind(wind, gusts)
    start = vehicle.reference
    vehicle.reference = leg_reference(start.position, (5000.0, 0.0, 200.0), start, airspeed, stop=False)
    return vehicle


class Flight(Track):
    """A craft under its autopilot, whatever it is asked while it flies."""

    def __init__(
        self, *, airborne=True, seed=1, settings=None, tuning=None, wind_speed=0.0, wind_from=0.0, gusts=0.0,
        plant=NOMINAL, design_model=None,
    ):  # fmt: skip
        start = Start(up=HIGH, airborne=True) if airborne else Start()
        super().__init__(Simulation(plant, seed=seed, start=start, design_model=design_model))
        bindings = Bindings(
            settings or Settings(), tuning or Tuning(), Surroundings(wind_speed, wind_from, gusts, battery=1e6)
        )
        self.craft = Craft(self.vehicle, WORLD, bindings, airborne=airborne)
        self.autopilot = self.craft.autopilot
        self.reached = {}  # time at which each mission item was done [s]
        self.said = []

    def fly(self, seconds, each=lambda: None):
        """Fly on for a time."""

        def note():
            self.reached |= {seq: self.vehicle.time for seq in self.autopilot.reached() if seq not in self.reached}
            self.said += [notice.text for notice in self.autopilot.notices()]
            each()

        self.advance(seconds, self.craft.advance, note)

    def fly_until(self, condition, limit):
        """Fly until a condition holds; the test fails if it never does within ``limit`` seconds."""
        end = self.vehicle.time + limit
        while not condition():
            assert self.vehicle.time < end, f"after {limit} s under {self.vehicle.law.name} at {self.p[-1]}"
            self.fly(0.02)

    def fly_mission(self, items, limit=200.0):
        """Arm where it stands, fly a mission to its end and, where it lands, until the motors stop."""
        self.autopilot.arm()
        self.autopilot.load_mission(items)
        assert self.autopilot.start_mission().accepted
        self.fly_until(lambda: self.autopilot.mission.finished, limit)
        return self


def square(airspeed):
    """The 100 m square of tests/data at an airspeed."""
    items = load_plan(DATA / "square100.plan").items
    return tuple(
        replace(item, params=(0.0, airspeed, -1.0, 0.0)) if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED else item
        for item in items
    )


def item(command, north=0.0, west=0.0, up=0.0, params=(0.0, 0.0, 0.0, NAN)):
    """A mission item at a place in world NWU [m]."""
    frame = mavlink.MAV_FRAME_LOCAL_NED
    return MissionItem(command, frame, params, round(north * 1e4), round(-west * 1e4), -up)


def waypoint(north, west, up, *, hold=0.0, radius=0.0):
    """A waypoint; with a radius it is flown over."""
    return item(mavlink.MAV_CMD_NAV_WAYPOINT, north, west, up, (hold, radius, 0.0, NAN))


def off_polygon(p, corners):
    """Horizontal distance to the nearest side of a closed polygon, (n,) [m]."""
    nearest = np.full(len(p), np.inf)
    corners = np.asarray(corners, dtype=float)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = b - a
        along = np.clip((p[:, :2] - a) @ side / (side @ side), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(p[:, :2] - a - along[:, None] * side, axis=1))
    return nearest
