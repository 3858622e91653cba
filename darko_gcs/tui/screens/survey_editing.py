"""The form of a survey, and its waypoints in the plan."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from darko_gcs.state.fence_edits import STAY_IN
from darko_gcs.state.fence_shapes import Place, item_position, polygon_spans
from darko_gcs.state.mission_items import WAYPOINT, new_item, shifted
from darko_gcs.state.number_ranges import HEIGHT, fault_words
from darko_gcs.state.survey import rectangle, survey_lines
from darko_gcs.tui.screens.dialogs import AskScreen, ChooseScreen, FormField
from protocol.errors import LocalProtocolError
from protocol.frames import Geodetic, Vector
from protocol.plans import MissionItem
from protocol.ranges import finite

if TYPE_CHECKING:
    from darko_gcs.tui.screens.mission_screen import MissionScreen

SPACING = finite("spacing", 1.0, 10_000.0, "m", default=False)
HEADING = finite("heading", -360.0, 360.0, "deg", default=False)
LENGTH = finite("length", 1.0, 10_000.0, "m", default=False)
LINE_FIELDS = (
    FormField("Spacing of the lines [m]", "20", "From line to line; half of it at the edges"),
    FormField("Heading of the lines [deg]", "0", "Clockwise from north; the first line goes this way"),
    FormField("Height above home [m]", "20", "Of all waypoints"),
)
SIZE_FIELDS = (
    FormField("Length along the lines [m]", "100", "Of the rectangle, around the last click or map's middle"),
    FormField("Width across them [m]", "80", "Of the rectangle"),
)
Insert = Callable[[Sequence[MissionItem]], None]


def ask_survey(screen: MissionScreen, insert: Insert) -> None:
    """Ask for the area and the lines, then put their waypoints into the mission.

    Args:
        screen: Shows the plan; its notice says why nothing is asked.
        insert: Puts items into the mission.
    """
    home, home_p = screen.snapshot.position.home, screen.snapshot.position.home_p
    if home is None:
        screen.show_notice("Survey: home is not known yet")
        return
    fence = _fence_corners(screen)

    def ask(corners: Sequence[Place]) -> None:
        def check(values: tuple[str, ...]) -> str | None:
            try:
                insert(_waypoints(corners, screen.map.pressed or screen.map.middle, values, (home, home_p)))
            except (ValueError, LocalProtocolError) as error:
                return fault_words(error)
            return None

        fields = LINE_FIELDS if corners else (*LINE_FIELDS, *SIZE_FIELDS)
        ranges = (SPACING, HEADING, HEIGHT) if corners else (SPACING, HEADING, HEIGHT, LENGTH, LENGTH)
        title = "Survey inside the fence" if corners else "Survey of a rectangle"
        screen.app.push_screen(AskScreen(title, fields, check, ranges=ranges))

    screen.show_notice("")
    if not fence:
        ask(())
        return
    choices = ("Inside the fence's polygon", "In a rectangle")
    screen.app.push_screen(
        ChooseScreen("Survey", choices), lambda chosen: None if chosen is None else ask(() if chosen else fence)
    )


def _waypoints(
    corners: Sequence[Place], middle: Place, values: tuple[str, ...], home: tuple[Geodetic, Vector]
) -> list[MissionItem]:
    spacing, heading, height, *size = (float(value) for value in values)
    course = math.radians(heading)
    area = corners or rectangle(middle, size[0], size[1], course)
    places = survey_lines(area, spacing, course, inset=spacing / 2.0 if corners else 0.0)
    where, home_p = home
    at_home = new_item(WAYPOINT, None, (where.lat_deg, where.lon_deg, height))
    if at_home is None:
        return []
    return [shifted(at_home, (n - home_p[0], e - home_p[1], 0.0), where, home_p) for n, e in places]


def _fence_corners(screen: MissionScreen) -> tuple[Place, ...]:
    """Corners of the plan's first polygon to stay inside; none without one."""
    fence = screen.draft.fence
    inside = (span for span in polygon_spans(fence) if fence[span.start].command == STAY_IN)
    places = [item_position(screen.snapshot, fence[seq]) for seq in next(inside, range(0))]
    return tuple(place for place in places if place is not None)
