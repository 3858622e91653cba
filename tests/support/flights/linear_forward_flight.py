"""Flights of the full plant under the linear forward law only, compiled as one loop."""

import math

import numpy as np

from sitl.compiled import entry
from sitl.control.forward_flight import forward_linear as law
from sitl.control.reference import LEG, Path
from sitl.design.forward_schedule import forward_gains
from sitl.estimation.sensing import observe
from sitl.model.airframe_files import load
from sitl.model.arithmetic import arctangent, sine_cosine
from sitl.model.ground import feet_aloft
from sitl.model.plant import step
from sitl.model.quaternions import from_euler, multiply
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector, add
from tests.support.flights.estimates import rotation, vector

NOMINAL = load("nominal").parameters
GAINS = forward_gains(NOMINAL)
ALTITUDE = 1000.0  # [m]
PERIOD, SUBSTEPS = 0.002, 2
SAMPLE = 5  # control periods between samples
COLUMNS = 18  # t, V, x, position, elevons


@entry
def _fly(plant, wind, known_wind, course, climb, radius, airspeed, ramp, gains, a, rows):
    """Fly at 500 Hz over 1 ms of plant, a row per sample; with a radius a circle to the left, begun northwards."""
    still = Vector(0.0, 0.0, 0.0)
    start = Vector(0.0, 0.0, ALTITUDE)
    for period in range(rows.shape[0] * SAMPLE):
        if radius > 0.0:  # the leg is the circle's tangent beside the vehicle
            bearing = arctangent(plant.body.position.y - radius, plant.body.position.x)
            course = bearing + 0.5 * math.pi
            s, c = sine_cosine(bearing)
            start = Vector(radius * c, radius + radius * s, ALTITUDE)
        s, c = sine_cosine(course)
        sc, cc = sine_cosine(climb)
        speed = airspeed + ramp * PERIOD * period
        path = Path(LEG, start, add(start, Vector(cc * c, cc * s, sc)), speed, False, 0.0, 0.0, 0.0)
        x, steep = law.error(observe(plant, still, known_wind, False), path, gains)
        T1, T2, d1, d2 = law.control(x, speed, steep, gains)
        if period % SAMPLE == 0:
            row = rows[period // SAMPLE]
            row[0], row[1] = PERIOD * period, law.quadratic(x, speed, gains)
            row[2], row[3], row[4], row[5], row[6], row[7] = x.left, x.above, x.v_ahead, x.v_left, x.v_up, x.e_x
            row[8], row[9], row[10], row[11], row[12] = x.e_y, x.e_z, x.p, x.q, x.r
            row[13], row[14], row[15] = plant.body.position.x, plant.body.position.y, plant.body.position.z
            row[16], row[17] = plant.actuators.left_elevon, plant.actuators.right_elevon
        command = Actuators(math.sqrt(max(T1, 0.0) / a.k_f), math.sqrt(max(T2, 0.0) / a.k_f), d1, d2)
        for _ in range(SUBSTEPS):
            plant = step(plant, command, wind, True, a, PERIOD / SUBSTEPS)


class Flight:
    """The record of a flight, one row per 10 ms."""

    def __init__(self, rows):
        self.time, self.v_hover, self.x, self.p = rows[:, 0], rows[:, 1], rows[:, 2:13], rows[:, 13:16]
        self.offset = np.hypot(self.x[:, 0], self.x[:, 1])  # from the leg [m]
        self.attitude = 2.0 * np.arcsin(np.minimum(np.linalg.norm(self.x[:, 5:8], axis=1), 1.0))  # [rad]

    def converged(self, *, offset=0.1, speed=0.1, attitude=0.02):
        """Whether it ends on the leg, at its speed and attitude."""
        return bool(
            self.offset[-1] < offset
            and np.linalg.norm(self.x[-1, 2:5]) < speed
            and self.attitude[-1] < attitude
            and np.linalg.norm(self.x[-1, 8:]) < 0.1
        )


def on_leg(airspeed, *, course=0.0, climb=0.0, wind=(0.0, 0.0, 0.0), gains=GAINS, a=NOMINAL):
    """The plant in the law's own trim on a leg through the origin."""
    along = Vector(math.cos(climb) * math.cos(course), math.cos(climb) * math.sin(course), math.sin(climb))
    u = law.wind_triangle(vector(wind), along, float(airspeed))
    steep = math.atan2(u.z, math.hypot(u.x, u.y)) if airspeed > 0 else climb
    azimuth = math.atan2(u.y, u.x) if airspeed > 0 else course
    at, up = law.cell(airspeed, gains.speeds), law.cell(steep, gains.climbs)
    theta, thrust, delta = (law.bilinear(table, at, up) for table in (gains.theta, gains.thrust, gains.delta))
    omega = math.sqrt(max(thrust, 0.0) / a.k_f)
    still = Vector(0.0, 0.0, 0.0)
    body = Body(Vector(0.0, 0.0, ALTITUDE), add(u, vector(wind)), from_euler(0.0, -theta, azimuth), still)
    return Plant(body, Actuators(omega, omega, float(delta), float(delta)), feet_aloft())


def moved(plant, *, west=0.0, up=0.0):
    """The plant elsewhere."""
    return plant._replace(body=plant.body._replace(position=add(plant.body.position, Vector(0.0, west, up))))


def disturb(plant, rng, *, offset, speed, attitude, rate):
    """The plant disturbed in a random direction of each of four kinds by these sizes [m, m/s, rad, rad/s]."""
    unit = rng.normal(size=(4, 3))
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    body = plant.body
    return plant._replace(
        body=Body(
            add(body.position, vector(offset * unit[0])),
            add(body.velocity, vector(speed * unit[1])),
            multiply(body.attitude, rotation(attitude * unit[2])),
            add(body.rates, vector(rate * unit[3])),
        )
    )


def fly(
    plant, airspeed, *, duration, course=0.0, climb=0.0, radius=0.0, wind=(0, 0, 0), known_wind=None, ramp=0.0,
    gains=GAINS, a=NOMINAL,
):  # fmt: skip
    """Fly a leg through the origin from a state, see :func:`_fly`; ``known_wind`` is the wind as the law knows it."""
    rows = np.empty((round(duration / PERIOD / SAMPLE), COLUMNS))
    known_wind = vector(wind if known_wind is None else known_wind)
    leg = float(course), float(climb), float(radius), float(airspeed), float(ramp)
    _fly(plant, vector(wind), known_wind, *leg, gains, a, rows)
    return Flight(rows)
