"""An estimate that is the truth: of everything but the wind, which the vehicle has to find."""

from sitl.compiled import kernel
from sitl.control.estimate import Ages, Estimate
from sitl.model.state import Plant
from sitl.model.vectors import Vector


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
        body.position,
        body.velocity,
        acceleration,
        body.attitude,
        body.rates,
        wind_estimate,
        plant.actuators,
        on_ground,
        Ages(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    )
