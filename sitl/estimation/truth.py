"""An estimate that is the truth: of everything but the wind, which the vehicle has to find."""

from sitl.compiled import kernel
from sitl.control.estimate import Ages, Estimate
from sitl.model.airframe import Airframe
from sitl.model.ground import is_touching
from sitl.model.state import Plant
from sitl.model.vectors import Vector


@kernel
def observe(plant: Plant, acceleration: Vector, wind_estimate: Vector, a: Airframe) -> Estimate:
    """The plant as a perfect, immediate measurement.

    Args:
        plant: As it is.
        acceleration: Mean of the last control period, world NWU [m/s2].
        wind_estimate: Velocity of the air as the vehicle knows it, world NWU [m/s].
        a: The airframe as it is: where its contacts are.
    """
    body = plant.body
    return Estimate(
        body.position,
        body.velocity,
        acceleration,
        body.attitude,
        body.rates,
        wind_estimate,
        plant.actuators,
        is_touching(plant, a),
        Ages(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    )
