"""Simulations that navigate by their sensors, and how far their estimate is from the truth."""

import math

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl.control.reference import hover_at
from sitl.model.airframe_files import load
from sitl.model.quaternions import conjugate, multiply
from sitl.sensors.draws import Timing
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start

NOMINAL = load("nominal").parameters
SENSORS, MOCAP = Navigation.SENSORS, Navigation.MOCAP
UP = 30.0  # [m]
EVERY = 0.1  # between two looks at a flight [s]


def hovering(navigation=SENSORS, seed=1, *, sensors=None, airframe=NOMINAL, gusts=0.3, wind=(2.0, 1.0, 0.0)):
    """Holding a place in a gusty wind, by the zero-moment law and the linear one."""
    made = Simulation(
        airframe, seed=seed, start=Start(up=UP, airborne=True), design_model=NOMINAL, navigation=navigation,
        sensors=sensors,
    )  # fmt: skip
    made.set_wind(wind, gusts)
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.reference = hover_at((0.0, 0.0, UP), 0.0)
    return made


def on_ground(navigation=SENSORS, seed=1, *, heading=0.0, sensors=None, aligned=True):
    """Standing, switched off."""
    start = Start(heading=heading)
    return Simulation(NOMINAL, seed=seed, start=start, navigation=navigation, sensors=sensors, aligned=aligned)


def changed(**parts):
    """The shipped instruments with some values of theirs changed: ``changed(gnss={"noise_up": 1.0})``."""
    sensors = load_sensors()
    for name, values in parts.items():
        part = getattr(sensors, name)
        timing = {key: value for key, value in values.items() if key in Timing._fields}
        if timing:
            part = part._replace(timing=part.timing._replace(**timing))
        part = part._replace(**{key: value for key, value in values.items() if key not in timing})
        sensors = sensors._replace(**{name: part})
    return sensors


def place_error(simulation):
    """Distance between estimate and truth [m]."""
    return math.dist(simulation.estimate.position, simulation.truth.body.position)


def turn_error(simulation):
    """The rotation from the true attitude to the estimated one, by its three axes of the body [rad]."""
    off = multiply(conjugate(simulation.truth.body.attitude), simulation.estimate.attitude)
    return 2.0 * math.copysign(1.0, off.w) * np.array(off[1:])


def watched(simulation, seconds, *looks):
    """Fly for a time and look every tenth of a second: an array of what each function of the simulation gave."""
    rows = []
    for _ in range(round(seconds / EVERY)):
        simulation.step(EVERY)
        rows.append([look(simulation) for look in looks])
    return np.array(rows)


def state_of_all(simulation):
    """Every bit of a flight, of its instruments and of its filter."""
    arrays = simulation._arrays
    flight = arrays.flights.copy()
    flight["limits"] = 0
    return flight.tobytes() + arrays.avionics.records.tobytes() + arrays.avionics.steps.tobytes()
