"""Law of a vehicle that stands: motors idle while they are armed, elevons straight."""

from sitl.compiled import kernel
from sitl.model.state import Actuators


@kernel
def step() -> tuple[Actuators, int]:
    """One tick: actuator commands (running motors stop at idle by themselves) and DARKO_SATURATION bits."""
    return Actuators(0.0, 0.0, 0.0, 0.0), 0
