"""Ground and arena about a flight, as the compiled loop takes them, and the changes made to them while flying."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sitl.enclosure.arena_files import Arena, WindWall, solids, touched_name
from sitl.enclosure.wind_field import Wall, WindField
from sitl.enclosure.wind_wall import Outlet
from sitl.model.ground import LEVEL_GROUND
from sitl.model.vectors import Vector
from sitl.storage import record_of, zero

OPEN_AIR_LENGTH = 1.0  # shortest length of turbulence where there is no wall [m]
MAX_BURSTS = 64  # that are remembered; older ones have long passed


class Surroundings:
    """Ground, wind field and solids of one flight.

    Args:
        span: Of the wing [m].
    """

    def __init__(self, span: float) -> None:
        nowhere = Outlet(Vector(0.0, 0.0, 0.0), Vector(1.0, 0.0, 0.0), 0.0, 0.0)
        calm = zero(WindField)._replace(outlet=nowhere, length=OPEN_AIR_LENGTH, span=span)
        self.fields = record_of(WindField, calm)
        self.schedule, self.bursts, self.solids = np.zeros((0, 2)), np.zeros((0, 3)), np.zeros((0, 9))
        self.arena: Arena | None = None
        self.ground = LEVEL_GROUND

    @property
    def blows(self) -> bool:
        """Whether there is more than the uniform wind and its gusts."""
        return len(self.schedule) > 0 or len(self.bursts) > 0 or bool(self.fields["wind_at_6_m"][0] > 0.0)

    @property
    def is_open(self) -> bool:
        """Whether there is neither a wind field nor anything to touch."""
        return not self.blows and len(self.solids) == 0

    @property
    def touched(self) -> str:
        """Name of the thing that broke the vehicle; empty if nothing but the ground did."""
        number = int(self.fields["touched"][0])
        return touched_name(self.arena, number) if self.arena is not None and number else ""

    def reset_contact(self) -> None:
        """Nothing is touched any more."""
        self.fields["touched"] = 0

    def enclose(self, arena: Arena) -> None:
        """Put the vehicle into an arena: its net, its obstacles, and its wind wall by its schedule."""
        self.arena, self.solids = arena, solids(arena)
        if arena.wall is not None:
            self.put_wall(arena.wall)

    def put_wall(self, wall: WindWall) -> None:
        """Have a wind wall blow by its schedule."""
        self.fields["outlet"][0] = wall.outlet
        self.fields["intensity"], self.fields["length"] = wall.intensity, wall.length
        self.schedule = np.array(wall.schedule, float).reshape(-1, 2)
        self.bursts = np.array(wall.bursts, float).reshape(-1, 3)

    @property
    def wall(self) -> Wall:
        """The schedule and the gusts of the wind wall."""
        return Wall(self.schedule, self.bursts)

    def set_speed(self, speed: float) -> None:
        """Have the wall blow steadily [m/s]; its schedule is over."""
        self.schedule = np.array([(0.0, speed)])

    def begin_burst(self, time: float, duration: float, rise: float) -> None:
        """A 1-cos gust of the wall from a time on [s]."""
        self.bursts = np.vstack([self.bursts[-MAX_BURSTS + 1 :], (time, duration, rise)])

    def set_intensity(self, intensity: float) -> None:
        """Of the wall's own turbulence [-]."""
        self.fields["intensity"] = intensity

    def set_open_air(self, wind_at_6_m: float) -> None:
        """Turbulence of the open air by the steady wind 6 m above the ground [m/s]; 0: none."""
        self.fields["wind_at_6_m"] = wind_at_6_m

    def end(self) -> npt.NDArray[Any]:
        """The part that the field still has of the gust, world NWU; from now on none."""
        part: npt.NDArray[Any] = self.fields["part"][0].copy()
        self.fields["part"], self.fields["rotation"] = 0.0, 0.0
        return part
