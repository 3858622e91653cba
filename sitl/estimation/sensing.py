"""Readings of the plant by the sensors of the air."""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.estimate import Readings
from sitl.model.aerodynamics import normal_force, wrench
from sitl.model.airframe import Airframe
from sitl.model.quaternions import rotate_inverse
from sitl.model.state import Plant
from sitl.model.vectors import Vector, add_scaled, scaled, subtract


class SensorNoise(NamedTuple):
    """Noise of the simulated sensors, one standard deviation per reading (one a tick)."""

    accelerometer: float  # [m/s2]
    velocity: float  # of motion capture or satellites, per axis [m/s]
    pitot: float  # [m/s]
    has_pitot: bool


class Normals(NamedTuple):
    """Independent unit normals, drawn afresh for every reading."""

    north: float
    west: float
    up: float
    normal_force: float
    airspeed: float


@kernel
def specific_force(plant: Plant, wind: Vector, a: Airframe) -> Vector:
    """Reading of an ideal accelerometer at the centre of mass off the ground, body frame FLU [m/s2]."""
    body = plant.body
    v_b = rotate_inverse(body.attitude, subtract(body.velocity, wind))
    F, _ = wrench(v_b, body.rates, plant.actuators, a)
    return scaled(F, 1.0 / a.m)


@kernel
def read(plant: Plant, wind: Vector, noise: Normals, sensors: SensorNoise, a: Airframe) -> Readings:
    """The readings of one control period.

    Args:
        plant: As it is.
        wind: Velocity of the air, world NWU [m/s].
        noise: Fresh unit normals.
        sensors: Their noise.
        a: The airframe as it is.
    """
    body = plant.body
    v_b = rotate_inverse(body.attitude, subtract(body.velocity, wind))
    force = normal_force(v_b, body.rates, plant.actuators, a) * (1.0 / a.m)
    return Readings(
        add_scaled(body.velocity, Vector(noise.north, noise.west, noise.up), sensors.velocity),
        force + sensors.accelerometer * noise.normal_force,
        v_b.x + sensors.pitot * noise.airspeed,
        sensors.has_pitot,
    )
