"""The arena: the volume that the vehicle may be sent into."""

from __future__ import annotations

from typing import NamedTuple

from sitl.control.reference import Point


class Arena(NamedTuple):
    """A box about the origin of the world frame (NWU), its floor the ground."""

    name: str
    half_north: float  # [m]
    half_west: float  # [m]
    ceiling: float  # [m]

    def refuse(self, p: Point) -> str | None:
        """Why a point is not allowed, or None if it is.

        Args:
            p: Position, world NWU [m].
        """
        north, west, up = p
        if abs(north) > self.half_north:
            return f"{north:.1f} m north is outside the arena '{self.name}' ({self.half_north:g} m each way)"
        if abs(west) > self.half_west:
            return f"{-west:.1f} m east is outside the arena '{self.name}' ({self.half_west:g} m each way)"
        if not 0.0 <= up <= self.ceiling:
            return f"altitude {up:.1f} m is outside the arena '{self.name}' (0 to {self.ceiling:g} m)"
        return None


# "open" holds every flight of the report; "voliere" is an indoor flying room, of a size assumed here
# because the report gives none.
ARENAS = {
    "open": Arena("open", half_north=1500.0, half_west=1500.0, ceiling=1500.0),
    "voliere": Arena("voliere", half_north=5.0, half_west=5.0, ceiling=8.0),
}
