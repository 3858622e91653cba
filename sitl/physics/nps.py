"""The plant below Paparazzi's simulator NPS, by the pattern of its PyBullet module.

``sw/simulator/nps/nps_fdm_pybullet.c`` of Paparazzi embeds Python, imports the module that
``NPS_PYBULLET_MODULE`` names, makes a ``BulletFDM`` of it and has it step with the commands of ``NPS_ACTUATORS_ORDER``:
left motor, right motor (0 to 1), left elevon, right elevon (-1 to 1). What it takes back are tuples in PyBullet's
conventions: world east, north, up, attitude (x, y, z, w), rates in the world's axes. Its body is that of the hover
frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from protocol.frames import hover_attitude, hover_axes, multiply, rotate
from sitl.model.airframe_files import load
from sitl.physics.driven_vehicle import DrivenVehicle, Seen, Triple
from sitl.physics.journal import Journal
from sitl.physics.outputs import Output, OutputMap
from sitl.physics.rig import Rig
from sitl.sensors.draws import PERIOD
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.start import Start

_COMMANDS = OutputMap(Output(1, 0.0, 1.0), Output(2, 0.0, 1.0), Output(3, -1.0, 1.0), Output(4, -1.0, 1.0))
_QUARTER_BACK = (math.sqrt(0.5), 0.0, 0.0, -math.sqrt(0.5))  # the C turns the attitude by +90 deg about its z


class BulletFDM:
    """One DarkO for NPS.

    Args:
        dt: Time between two steps [s].
        GUI: PyBullet's window; there is none.
        urdf: A shipped airframe, or a TOML file (``NPS_PYBULLET_URDF``).

    Raises:
        SitlError: If there is no such airframe.
    """

    def __init__(self, dt: float, GUI: bool = False, urdf: str = "darko") -> None:  # noqa: ARG002
        airframe = load(urdf).parameters
        vehicle = DrivenVehicle(airframe, seed=1, start=Start(), sensors=load_sensors())
        self.rig = Rig(vehicle, _COMMANDS, Journal(lambda text: print(f"darko: {text}", flush=True)))
        self._dt, self._owed, self._turned = dt, 0.0, (0.0, 0.0, 0.0)
        self._told = self._observation(self.rig.fly(1), PERIOD)

    def step(self, commands: Sequence[float]) -> dict[str, tuple[float, ...]]:
        """Fly for one step of NPS, in whole control periods; between two of them nothing moves."""
        self.rig.take([float(command) for command in commands])
        self._owed += self._dt / PERIOD
        if periods := int(self._owed + 1e-6):
            self._owed -= periods
            self._told = self._observation(self.rig.fly(periods), periods * PERIOD)
        return self._told

    def _observation(self, seen: Seen, seconds: float) -> dict[str, tuple[float, ...]]:
        attitude = hover_attitude(seen.attitude)
        w, x, y, z = multiply(attitude, _QUARTER_BACK)
        turned = _east_north_up(rotate(attitude, hover_axes(seen.true_rates)))
        before, self._turned = self._turned, turned
        return {
            "pos": _east_north_up(seen.position),
            "vel": _east_north_up(seen.velocity),
            "accel": _east_north_up(seen.acceleration),
            "quat": (y, x, -z, w),
            "ang_v": turned,
            "ang_accel": tuple((now - then) / seconds for now, then in zip(turned, before, strict=True)),
        }


def _east_north_up(v: Triple) -> Triple:
    return v[1], v[0], -v[2]
