"""The map of the mission screen: items are added and chosen by the mouse, and moved by the mouse or by arrow keys."""

from __future__ import annotations

from textual.message import Message

from darko_gcs.state.missions.plan_parts import Items
from darko_gcs.state.snapshot import Snapshot, updated
from darko_gcs.tui.maps.fence_overlay import fence_circles, fence_polygons, rally_points
from darko_gcs.tui.maps.item_position import item_position
from darko_gcs.tui.maps.map_panel import home_place, loiter_circles, position_ahead, target_place, waypoints
from darko_gcs.tui.maps.movable_map import MovableMap
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.map_drawing import NorthEast, draw_map
from protocol.frames import Vector

__all__ = ["MissionMapPanel"]


class MissionMapPanel(MovableMap):
    """The items of the plan that is edited, the vehicle's progress on them, track and vehicle, north up."""

    class ItemShifted(Message):
        """An item is to be moved: north, east and up [m]."""

        def __init__(self, seq: int, by: Vector) -> None:
            super().__init__()
            self.seq, self.by = seq, by

    class PlaceClicked(Message):
        """The mouse was pressed where no item is."""

        def __init__(self, place: NorthEast) -> None:
            super().__init__()
            self.place = place

    def __init__(self, title: str, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(title, id=id)
        self._plans: tuple[Items, Items, Items] = ((), (), ())
        self._is_flown = False

    def show(self, plans: tuple[Items, Items, Items], *, is_on_vehicle: bool) -> None:
        """Show a mission, its fence and its rally points; the vehicle's progress if it has them."""
        if (plans, is_on_vehicle) != (self._plans, self._is_flown):
            self._plans, self._is_flown = plans, is_on_vehicle
            self.redraw()

    def subtitle(self, s: Snapshot) -> str:
        """How far a key moves an item, unless the values are old."""
        return super().subtitle(s) or self.step_text

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """Everything fits unless the pilot zooms; zoomed in, the chosen item is in the middle."""
        s = self._edited(s)
        placed, areas, circles = waypoints(s), fence_polygons(s), fence_circles(s)
        here = None if s.p is None else (s.p[0], s.p[1])
        all_places = [(north, east) for _, north, east, _ in placed] + [p for p in (home_place(s), here) if p]
        all_places += [corner for corners, _ in areas for corner in corners]
        all_places += [(n + k * r, e + k * r) for n, e, r, _ in [*circles, *loiter_circles(s)] for k in (-1.0, 1.0)]
        chosen = self.places().get(self.chosen)
        scale, centre = self.fit(all_places, width, height, about=chosen)
        labels = [] if chosen is None else [(f"{self.chosen}◆", chosen, "warn")]
        if self.held is not None:
            labels.append(("◇", self.held, "warn"))
        lines, _ = draw_map(
            width=width,
            height=height,
            scale=scale,
            centre=centre,
            home=home_place(s),
            track=s.track,
            waypoints=placed,
            vehicle=None if s.p is None else (s.p[0], s.p[1], s.heading or 0.0),
            target=target_place(s),
            circles=[*loiter_circles(s), *circles],
            course=position_ahead(s),
            areas=areas,
            rally=rally_points(s),
            labels=labels,
        )
        return lines

    def places(self) -> dict[int, NorthEast]:
        """Where the items are that have a place."""
        placed = ((seq, item_position(self.snapshot, item)) for seq, item in enumerate(self._plans[0]))
        return {seq: place for seq, place in placed if place is not None}

    def move_by(self, east: float, north: float, up: float) -> None:
        """Ask for the chosen item to be moved."""
        if self.chosen in self.places():
            self.post_message(self.ItemShifted(self.chosen, (north, east, up)))

    def drop(self, number: int, place: NorthEast) -> None:
        """Ask for an item to be put there."""
        here = self.places().get(number)
        if here is not None:
            self.post_message(self.ItemShifted(number, (place[0] - here[0], place[1] - here[1], 0.0)))

    def click(self, place: NorthEast) -> None:
        """Ask for an item there."""
        self.post_message(self.PlaceClicked(place))

    def _edited(self, s: Snapshot) -> Snapshot:
        """The snapshot as if the vehicle had the plan that is edited; without progress if it has another one."""
        mission, fence, rally = self._plans
        s = updated(s, mission=mission, fence=fence or s.fence, rally=rally or s.rally)
        return s if self._is_flown else updated(s, reached=frozenset(), mission_current=None)
