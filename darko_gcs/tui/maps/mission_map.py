"""Content of the mission screen's map: the plan that is edited, and the vehicle."""

from __future__ import annotations

from darko_gcs.state.missions.mission_frames import place_of
from darko_gcs.state.missions.mission_labels import mission_command_of
from darko_gcs.state.missions.mission_legs import low_legs
from darko_gcs.state.missions.plan_parts import Items
from darko_gcs.state.snapshot import Snapshot, updated
from darko_gcs.tui.maps.fence_overlay import fence_circles, fence_polygons, rally_points
from darko_gcs.tui.maps.flight_content import flight_content, home_place, loiter_circles, waypoints
from darko_gcs.tui.maps.plan_overlay import item_position
from darko_gcs.tui.render.map_drawing import MapContent, MapLabel, NorthEast

__all__ = ["EditedMission"]


class EditedMission:
    """The items of the plan that is edited, and the vehicle's progress on them."""

    def __init__(self) -> None:
        self._plans: tuple[Items, Items, Items] = ((), (), ())
        self._is_flown = False

    def show(self, plans: tuple[Items, Items, Items], *, is_on_vehicle: bool) -> bool:
        """Show a mission, its fence and its rally points; the vehicle's progress if it has them. False: as before."""
        is_new = (plans, is_on_vehicle) != (self._plans, self._is_flown)
        self._plans, self._is_flown = plans, is_on_vehicle
        return is_new

    def places(self, s: Snapshot) -> dict[int, NorthEast]:
        """Positions of the items that have a place, by number [m]."""
        placed = ((seq, item_position(s, item)) for seq, item in enumerate(self._plans[0]))
        return {seq: place for seq, place in placed if place is not None}

    def content(self, s: Snapshot, chosen: int) -> MapContent:
        """All that is on the map, with a mark on the chosen item."""
        place = self.places(s).get(chosen)
        mission, fence, rally = self._plans
        s = updated(s, mission=mission, fence=fence or s.fence, rally=rally or s.rally)
        s = s if self._is_flown else updated(s, reached=frozenset(), mission_current=None)
        return flight_content(
            s,
            home=home_place(s),
            waypoints=waypoints(s),
            circles=[*loiter_circles(s), *fence_circles(s)],
            areas=fence_polygons(s),
            rally=rally_points(s),
            labels=[*self._heights(s, chosen), *([] if place is None else [(f"{chosen}◆", place, "warn")])],
        )

    def _heights(self, s: Snapshot, chosen: int) -> list[MapLabel]:
        """Number and height above home of each other item with a place; low ones in the colour of a warning."""
        if s.home is None:
            return []
        low = low_legs(self._plans[0], s)
        return [
            (f"{seq} {s.home_p[2] - place[2]:.0f}m", place[:2], "warn" if seq in low else "dim")
            for seq, item in enumerate(self._plans[0])
            if seq != chosen
            and mission_command_of(item).has_place
            and (place := place_of(item, s.home, s.home_p)) is not None
        ]

    def is_empty(self, s: Snapshot) -> bool:
        """True while nothing was put on the map, and no fence says how large the place is."""
        return not any(self._plans) and not s.fence
