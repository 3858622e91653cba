"""The plant seen by laws without instruments: a perfect estimate, but for the wind, which sensors of the air tell."""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.estimate import Ages, Estimate, Readings
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
def observe(plant: Plant, acceleration: Vector, wind_estimate: Vector, on_ground: bool) -> Estimate:
    """The plant as a perfect, immediate measurement.

    Args:
        plant: As it is.
        acceleration: Mean of the last control period, world NWU [m/s2].
        wind_estimate: Velocity of the air as the vehicle knows it, world NWU [m/s].
        on_ground: Whether something touches the ground.
    """
    body = plant.body
    return Estimate(
        position=body.position,
        velocity=body.velocity,
        acceleration=acceleration,
        attitude=body.attitude,
        rates=body.rates,
        wind=wind_estimate,
        actuators=plant.actuators,
        on_ground=on_ground,
        age=Ages(
            position=0.0, velocity=0.0, acceleration=0.0, attitude=0.0, rates=0.0, wind=0.0, actuators=0.0, contact=0.0
        ),
    )


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
