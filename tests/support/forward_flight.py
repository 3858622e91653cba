"""Flights of the full plant under the linear forward law alone, compiled as one loop."""

import math

import numpy as np
from numba import njit

from sitl.airframe import load
from sitl.design.forward_linear import forward_gains
from sitl.kernels.integrate import plant_step
from sitl.kernels.quaternion import from_euler, from_rotation_vector, multiply
from sitl.kernels.state import ACTUATOR, SIZE, P, Q, V, W
from sitl.laws import forward_linear as law

NOMINAL = load("nominal").parameters
GAINS = forward_gains(NOMINAL)
ALOFT = 1000.0  # [m]
SAMPLE = 5  # control ticks of 2 ms between samples


@njit(cache=True)
def _fly(plant, wind, told, leg, airspeed, ramp, gains, a, rows):
    """Fly at 500 Hz over 1 ms of plant; a row per sample: t, V, x, u, plant.

    ``leg`` is its course, its climb and, for a circle to the left begun northwards at the origin, the radius.
    """
    x, u, command, origin = np.empty(law.STATES), np.empty(4), np.empty(4), np.array((0.0, 0.0, ALOFT))
    course, climb, radius = leg
    for tick in range(rows.shape[0] * SAMPLE):
        speed = airspeed + ramp * 0.002 * tick
        if radius > 0.0:  # the leg is the circle's tangent beside the vehicle
            bearing = math.atan2(plant[P + 1] - radius, plant[P])
            course = bearing + 0.5 * math.pi
            origin[0], origin[1] = radius * math.cos(bearing), radius + radius * math.sin(bearing)
        steep = law.error(plant, told, origin, course, climb, speed, gains, x)
        law.control(x, speed, steep, gains, u)
        if tick % SAMPLE == 0:
            row = rows[tick // SAMPLE]
            row[0], row[1] = 0.002 * tick, law.lyapunov(x, speed, gains)
            row[2:13], row[13:17], row[17:] = x, u, plant
        for i in range(2):
            command[i], command[2 + i] = math.sqrt(max(u[i], 0.0) / a.k_f), u[2 + i]
        for _ in range(2):
            plant_step(plant, command, wind, True, a, 0.001)


class Flight:
    """What a flight was, one row per 10 ms."""

    def __init__(self, rows):
        self.time, self.lyapunov, self.x, self.u = rows[:, 0], rows[:, 1], rows[:, 2:13], rows[:, 13:17]
        self.plant = rows[:, 17:]
        self.offset = np.hypot(self.x[:, 0], self.x[:, 1])  # from the leg [m]
        self.attitude = 2.0 * np.arcsin(np.minimum(np.linalg.norm(self.x[:, 5:8], axis=1), 1.0))  # [rad]
        self.saturated = (np.abs(self.plant[:, ACTUATOR + 2 : ACTUATOR + 4]) > NOMINAL.delta_max - 1e-6).any(axis=1)

    def converged(self, *, offset=0.1, speed=0.1, attitude=0.02):
        """Whether it ends on the leg, at its speed and attitude."""
        return bool(
            self.offset[-1] < offset
            and np.linalg.norm(self.x[-1, 2:5]) < speed
            and self.attitude[-1] < attitude
            and np.linalg.norm(self.x[-1, 8:]) < 0.1
        )


def on_leg(airspeed, *, course=0.0, climb=0.0, wind=(0.0, 0.0, 0.0), gains=GAINS, a=NOMINAL):
    """The plant in the law's own trim on a leg through the origin, (SIZE,)."""
    u = np.array(law.wind_triangle(np.array(wind, dtype=float), course, climb, airspeed))
    steep = math.atan2(u[2], math.hypot(u[0], u[1])) if airspeed > 0 else climb
    azimuth = math.atan2(u[1], u[0]) if airspeed > 0 else course
    cell = *law._cell(airspeed, gains.speeds), *law._cell(steep, gains.climbs)
    theta, thrust, delta = (law._bilinear(table, *cell) for table in (gains.theta, gains.thrust, gains.delta))
    plant = np.full(SIZE, np.nan)
    plant[P : P + 3], plant[V : V + 3], plant[W : W + 3] = (0.0, 0.0, ALOFT), u + np.array(wind), 0.0
    plant[Q : Q + 4] = from_euler(0.0, -theta, azimuth)
    plant[ACTUATOR : ACTUATOR + 2] = math.sqrt(max(thrust, 0.0) / a.k_f)
    plant[ACTUATOR + 2 : ACTUATOR + 4] = delta
    return plant


def disturb(plant, rng, *, offset, speed, attitude, rate):
    """A copy disturbed in a random direction of each of four kinds by these sizes [m, m/s, rad, rad/s]."""
    unit = rng.normal(size=(4, 3))
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    x = plant.copy()
    x[P : P + 3] += offset * unit[0]
    x[V : V + 3] += speed * unit[1]
    x[Q : Q + 4] = multiply(x[Q : Q + 4].copy(), from_rotation_vector(attitude * unit[2]))
    x[W : W + 3] += rate * unit[3]
    return x


def fly(
    plant, airspeed, *, duration, course=0.0, climb=0.0, radius=0.0, wind=(0, 0, 0), told=None, ramp=0.0,
    gains=GAINS, a=NOMINAL,
):  # fmt: skip
    """Fly a leg through the origin from a state, see :func:`_fly`; ``told`` is the wind that the law knows of."""
    rows, air = np.empty((round(duration / 0.002 / SAMPLE), 17 + SIZE)), np.array(wind, dtype=float)
    known = air if told is None else np.array(told, dtype=float)
    _fly(plant.copy(), air, known, (course, climb, radius), float(airspeed), float(ramp), gains, a, rows)
    return Flight(rows)
