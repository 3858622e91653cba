"""The map panel, and where the mission's items lie on it."""

from __future__ import annotations

import math

from darko_gcs.render.map import draw_map
from darko_gcs.snapshot import Snapshot
from darko_gcs.widgets.limits import fence_areas, fence_circles, rally_points
from darko_gcs.widgets.panel import Line, Panel
from darko_gcs.widgets.places import place_of
from darko_gcs.words import label
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Way
from protocol.plans.mission import MissionItem

__all__ = ["MapPanel", "circles", "course", "decision_words", "waypoints"]

ZOOM = 2.0
COURSE_AHEAD = 3.0  # [s] of flight that the course line shows
SLOW = 0.5  # below, a course is noise [m/s]
LOITERS = frozenset(
    {mavlink.MAV_CMD_NAV_LOITER_UNLIM, mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_TIME}
)


class MapPanel(Panel):
    """Home, fence and rally points, mission legs and circles, track, vehicle and its course, north up.

    Below: how the leg was decided.
    """

    scale: float | None = None  # metres per cell height; None: fit everything

    def watch_snapshot(self) -> None:
        """The border tells the decision."""
        words = decision_words(self.snapshot)
        if self.border_subtitle != words:
            self.border_subtitle = words
        super().watch_snapshot()

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """The whole panel is map."""
        here = None if s.p is None else (s.p[0], s.p[1], s.heading or 0.0)
        lines, self._shown = draw_map(
            width=width,
            height=height,
            scale=self.scale,
            centre=None if self.scale is None or s.p is None else (s.p[0], s.p[1]),
            home=s.home_p[:2],
            track=s.track,
            waypoints=waypoints(s),
            circles=[*circles(s), *fence_circles(s)],
            areas=fence_areas(s),
            rally=rally_points(s),
            vehicle=here,
            course=course(s),
            target=None if s.target is None or s.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND else s.target[:2],
        )
        return lines

    def zoom(self, step: int) -> None:
        """In (+1), out (-1), or fit everything again (0)."""
        self.scale = None if step == 0 else (self.scale or self._shown) / ZOOM**step
        self.redraw()

    _shown: float = 1.0


def decision_words(s: Snapshot) -> str:
    """The decision in a line: leg, way, energy against the other way's, reason."""
    d = s.decision
    if d is None:
        return ""
    leg = "leg" if d.seq is None else f"to {d.seq}"
    saving = f" {-100.0 * d.saving:+.0f} %" if math.isfinite(d.saving) else ""
    return f"{leg}: {label(Way, d.way)}{saving}, {label(DecisionReason, d.reason)}"


def course(s: Snapshot) -> tuple[float, float] | None:
    """Where the vehicle will be in some seconds, north and east [m]; None while it stands."""
    if s.p is None or s.v is None or math.hypot(s.v[0], s.v[1]) < SLOW:
        return None
    return s.p[0] + COURSE_AHEAD * s.v[0], s.p[1] + COURSE_AHEAD * s.v[1]


def waypoints(s: Snapshot) -> list[tuple[int, float, float, str]]:
    """Number, north, east [m] and state of every mission item that names a place."""
    return [(seq, *place, _state(s, seq)) for seq, _, place in _placed(s)]


def circles(s: Snapshot) -> list[tuple[float, float, float, str]]:
    """North, east, radius [m] and state of every circle that the mission loiters on."""
    radius = {seq: abs(item.params[2]) for seq, item, _ in _placed(s) if item.command in LOITERS}
    return [(*place, radius[seq], _state(s, seq)) for seq, _, place in _placed(s) if radius.get(seq, 0.0) > 0.0]


def _state(s: Snapshot, seq: int) -> str:
    active = s.mission_current == seq and s.mission_state != mavlink.MISSION_STATE_COMPLETE
    return "done" if seq in s.reached else "current" if active else "todo"


def _placed(s: Snapshot) -> list[tuple[int, MissionItem, tuple[float, float]]]:
    places = ((seq, item, place_of(s, item)) for seq, item in enumerate(s.mission))
    return [(seq, item, place) for seq, item, place in places if place is not None]
