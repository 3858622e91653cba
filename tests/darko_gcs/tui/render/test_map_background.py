"""A map whose background is kept looks like one that is drawn anew."""

import math
import random

from darko_gcs.tui.render.map_drawing import MapBackground
from tests.support.gcs.maps import drawn_map
from tests.support.gcs.screens import lines_text

AREAS = [(((-20.0, -20.0), (60.0, -20.0), (60.0, 60.0)), "fence")]
WAYPOINTS = [(1, 10.0, 10.0, "done"), (2, 50.0, 40.0, "current")]


def drawing(track, background=None, **other):
    vehicle = (*track[-1], 1.0) if track else None
    given = {"home": (0.0, 0.0), "waypoints": WAYPOINTS, "areas": AREAS}
    given |= {"labels": [("P1", (30.0, 30.0), "plan")], "course": (70.0, 70.0)} | other
    return drawn_map(width=40, height=20, track=track, vehicle=vehicle, background=background, **given)


def test_a_track_that_grows_is_drawn_as_at_once():
    source, track, background = random.Random(3), [(0.0, 0.0)], MapBackground()
    for _ in range(60):
        north, east = track[-1]
        track += [(north + source.uniform(-1, 4), east + source.uniform(-3, 6)) for _ in range(source.randrange(4))]
        assert drawing(track, background) == drawing(track)


def test_another_track_scale_or_plan_is_drawn_anew():
    background, track = MapBackground(), [(float(k), float(k * k) / 9) for k in range(30)]
    for shown, other in (
        (track, {}), (track[5:], {}), (track[5:20], {}), ([(9.0, 1.0), *track[6:20]], {}), (track, {"scale": 4.0}),
        (track, {"scale": 4.0, "centre": (3.0, 3.0)}), (track, {"waypoints": WAYPOINTS[:1]}), ([], {}), (track, {}),
        ([*track, (math.nan, 1.0), (math.inf, 0.0), (40.0, 99.0)], {}), (track, {"areas": []}),
    ):  # fmt: skip
        assert drawing(shown, background, **other) == drawing(shown, **other)


def test_the_vehicle_leaves_nothing_behind():
    background = MapBackground()
    drawing([(0.0, 0.0), (0.0, 20.0)], background)
    lines, _ = drawing([(0.0, 0.0), (0.0, 20.0), (30.0, 20.0)], background)
    assert sum(lines_text(lines).count(arrow) for arrow in "↑↗→↘↓↙←↖") == 2  # the vehicle's, and that of "N↑"
