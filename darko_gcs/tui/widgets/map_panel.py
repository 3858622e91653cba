"""The map panel, and where the mission's items lie on it."""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.map_drawing import NorthEast, draw_map
from darko_gcs.tui.widgets.decision_panel import decision_summary
from darko_gcs.tui.widgets.fence_overlay import fence_circles, fence_polygons, rally_points
from darko_gcs.tui.widgets.item_position import item_position
from darko_gcs.tui.widgets.panel import Panel
from darko_gcs.tui.widgets.plan_overlay import plan_labels, plan_polygons
from protocol.dialect import mavlink
from protocol.plans import MissionItem

__all__ = ["MapPanel", "loiter_circles", "position_ahead", "waypoints"]

ZOOM_FACTOR = 2.0
COURSE_TIME = 3.0  # of flight that the course line shows [s]
MIN_COURSE_SPEED = 0.5  # below which there is no course line [m/s]
LOITER_COMMANDS = frozenset(
    {mavlink.MAV_CMD_NAV_LOITER_UNLIM, mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_TIME}
)


class MapPanel(Panel):
    """Home, fence and rally points, mission legs and circles, track, vehicle and its course, north up.

    The lower border shows the decision on the current leg.
    """

    scale: float | None = None  # metres per cell height; None: fit everything
    _shown_scale: float = 1.0

    def subtitle(self, s: Snapshot) -> str:
        """The decision, unless the values are old."""
        return super().subtitle(s) or decision_summary(s)

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """The map fills the panel."""
        on_ground = s.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
        lines, self._shown_scale = draw_map(
            width=width,
            height=height,
            scale=self.scale,
            centre=None if self.scale is None or s.p is None else (s.p[0], s.p[1]),
            home=s.home_p[:2],
            track=s.track,
            waypoints=[] if s.flies_plan else waypoints(s),
            circles=fence_circles(s) if s.flies_plan else [*loiter_circles(s), *fence_circles(s)],
            areas=[*fence_polygons(s), *plan_polygons(s)],
            labels=plan_labels(s),
            rally=rally_points(s),
            vehicle=None if s.p is None else (s.p[0], s.p[1], s.heading or 0.0),
            course=position_ahead(s),
            target=None if s.goal is None or on_ground else s.goal[:2],
        )
        return lines

    def zoom(self, step: int) -> None:
        """In (+1), out (-1), or fit everything again (0)."""
        self.scale = None if step == 0 else (self.scale or self._shown_scale) / ZOOM_FACTOR**step
        self.redraw()


def position_ahead(s: Snapshot) -> NorthEast | None:
    """Position of the vehicle in a few seconds, north and east [m]; None while it stands still."""
    if s.p is None or s.v is None or math.hypot(s.v[0], s.v[1]) < MIN_COURSE_SPEED:
        return None
    return s.p[0] + COURSE_TIME * s.v[0], s.p[1] + COURSE_TIME * s.v[1]


def waypoints(s: Snapshot) -> list[tuple[int, float, float, str]]:
    """Number, north, east [m] and state of every mission item with a place."""
    return [(seq, *place, _state(s, seq)) for seq, _, place in _placed_items(s)]


def loiter_circles(s: Snapshot) -> list[tuple[float, float, float, str]]:
    """North, east, radius [m] and state of every circle that the mission loiters on."""
    loiters = [(seq, place, abs(item.params[2])) for seq, item, place in _placed_items(s) if _is_loiter(item)]
    return [(*place, radius, _state(s, seq)) for seq, place, radius in loiters if radius > 0.0]


def _is_loiter(item: MissionItem) -> bool:
    return item.command in LOITER_COMMANDS


def _state(s: Snapshot, seq: int) -> str:
    is_current = s.mission_current == seq and s.mission_state != mavlink.MISSION_STATE_COMPLETE
    return "done" if seq in s.reached else "current" if is_current else "todo"


def _placed_items(s: Snapshot) -> list[tuple[int, MissionItem, NorthEast]]:
    places = ((seq, item, item_position(s, item)) for seq, item in enumerate(s.mission))
    return [(seq, item, place) for seq, item, place in places if place is not None]
