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
