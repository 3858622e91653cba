"""A plan's fence and rally points: to the vehicle and back, on the map, and on the mission screen."""

import json
from dataclasses import replace

import pytest
from textual.widgets import Input, OptionList

from darko_gcs.app import GroundStation
from darko_gcs.plans import FENCE, MISSION, RALLY
from darko_gcs.screens.mission import Draft
from darko_gcs.store import reduce
from darko_gcs.widgets.limits import fence_areas, fence_circles, rally_points
from darko_gcs.widgets.map import MapPanel
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.events import MissionDownloaded, MissionFailed, MissionUploaded
from protocol.plans import load
from protocol.plans.geofence import fence_items, rally_items
from tests.darko_gcs.screens import FLYING, FakeFeed, screen_text, until
from tests.support.paths import DATA
from tests.support.station_pair import Pair

NORTH, EAST = 1 / 111_195.0, 1 / 80_560.0  # [deg] of a metre at the volière
HOME = (43.5648, 1.4811)


def at(north, east):
    return [HOME[0] + north * NORTH, HOME[1] + east * EAST]


SQUARE = {"inclusion": True, "polygon": [at(30, -30), at(30, 30), at(-30, 30), at(-30, -30)], "version": 1}
HOLE = {"circle": {"center": at(15, 15), "radius": 5.0}, "inclusion": False, "version": 1}


def plan_file(folder, **parts):
    content = json.loads((DATA / "square.plan").read_text()) | parts
    (folder / "limits.plan").write_text(json.dumps(content))
    return folder / "limits.plan"


@pytest.fixture
def path(tmp_path):
    return plan_file(
        tmp_path,
        geoFence={"version": 2, "polygons": [SQUARE], "circles": [HOLE]},
        rallyPoints={"version": 2, "points": [[*at(-5, -5), 10.0], [*at(5, -5), 12.0]]},
    )


@pytest.fixture
def plan(path):
    return load(path)


@pytest.fixture
def pair(tmp_path):
    made = Pair(tmp_path / "vehicle")
    made.run(2.5)
    return made


def limits(plan):
    return {"fence": fence_items(plan), "rally": rally_items(plan)}


def test_all_three_parts_of_a_plan_go_up_and_come_back(pair, plan):
    pair.station.upload(plan.items, pair.now, **limits(plan))
    pair.run(2.0)
    uploaded = [e.kind for e in pair.station.events() if isinstance(e, MissionUploaded)]
    assert uploaded == [FENCE, RALLY, MISSION]
    assert (pair.snapshot.fence, pair.snapshot.rally) == (fence_items(plan), rally_items(plan))
    pair.station.snapshot = replace(pair.snapshot, mission=(), fence=(), rally=())
    pair.station.download(pair.now)
    pair.run(2.0)
    assert pair.snapshot.mission == plan.items
    assert (pair.snapshot.fence, pair.snapshot.rally) == (fence_items(plan), rally_items(plan))


def test_a_refused_fence_keeps_the_mission_on_the_ground(pair, plan):
    hole = (replace(fence_items(plan)[-1], x=round(HOME[0] * 1e7), y=round(HOME[1] * 1e7), frame=1),)
    pair.station.upload(plan.items, pair.now, fence=hole)
    pair.run(2.0)
    assert [e.kind for e in pair.station.events() if isinstance(e, MissionFailed)] == [FENCE]
    assert pair.snapshot.mission == pair.snapshot.fence == ()
    assert any(line.text.startswith("Fence upload failed") for line in pair.snapshot.messages)
    pair.station.upload(plan.items, pair.now)  # nothing of the first is left over
    pair.run(2.0)
    assert (pair.snapshot.mission, pair.snapshot.rally) == (plan.items, ())


def test_an_order_during_a_download_comes_after_the_plan_under_way(pair, plan):
    pair.station.download(pair.now)
    pair.station.upload(plan.items, pair.now, **limits(plan))
    pair.run(2.0)
    assert (pair.snapshot.mission, len(pair.snapshot.fence), len(pair.snapshot.rally)) == (plan.items, 5, 2)
    downloaded = [e.kind for e in pair.station.events() if isinstance(e, MissionDownloaded)]
    assert downloaded == [MISSION]


def test_a_second_order_of_plans_waits_for_nothing_and_is_refused(pair, plan):
    pair.station.upload(plan.items, pair.now)
    pair.station.clear_plan(FENCE, pair.now)
    assert "clear" in pair.snapshot.messages[-1].text
    pair.run(2.0)
    assert pair.snapshot.mission == plan.items


def test_a_plan_without_limits_leaves_the_vehicles_own(pair, plan):
    pair.station.upload(plan.items, pair.now, **limits(plan))
    pair.run(2.0)
    pair.station.upload(plan.items[:2], pair.now)
    pair.run(2.0)
    assert pair.snapshot.mission == plan.items[:2]
    assert pair.snapshot.fence == fence_items(plan)


@pytest.mark.parametrize(("kind", "left"), [(FENCE, (6, 0, 2)), (RALLY, (6, 5, 0)), (255, (0, 0, 0))])
def test_one_part_or_all_are_deleted(pair, plan, kind, left):
    pair.station.upload(plan.items, pair.now, **limits(plan))
    pair.run(2.0)
    pair.station.clear_plan(kind, pair.now)
    pair.run(1.0)
    s = pair.snapshot
    assert (len(s.mission), len(s.fence), len(s.rally)) == left
    assert "cleared" in s.messages[-1].text


def test_the_mission_goes_on_at_another_item(pair, plan):
    pair.station.upload(plan.items, pair.now)
    pair.run(1.0)
    pair.station.set_current(3, pair.now)
    pair.run(1.0)
    assert pair.snapshot.mission_current == 3


def test_the_map_shows_where_the_vehicle_may_fly(plan):
    s = replace(FLYING, **limits(plan))
    ((corners, style),) = fence_areas(s)
    assert style == "fence"
    assert corners[0] == pytest.approx((30.0, -30.0), abs=0.1)
    assert fence_circles(s) == [(pytest.approx(15.0, abs=0.1), pytest.approx(15.0, abs=0.1), 5.0, "keep-out")]
    assert rally_points(s) == [pytest.approx((-5.0, -5.0), abs=0.1), pytest.approx((5.0, -5.0), abs=0.1)]
    lines = MapPanel("Map", id="map").draw(s, 60, 30)
    drawn = [(text, style) for line in lines for text, style in line]
    assert sum(len(text) for text, style in drawn if style == "fence") > 60
    assert any(style == "mark" for _, style in drawn)
    assert "R" in "".join(text for text, _ in drawn)


@pytest.mark.parametrize("count", [3.0, float("nan"), -1.0, 1e30])
def test_a_polygon_that_is_not_complete_is_not_drawn(plan, count):
    corner = replace(fence_items(plan)[0], params=(count, 0.0, 0.0, 0.0))
    assert fence_areas(replace(FLYING, fence=(corner, corner))) == []


def test_a_recorded_upload_shows_its_fence(plan):
    s, ground = FLYING, Codec(255, 190)
    for seq, item in enumerate(fence_items(plan)):
        (message,) = Codec(1, 1).decode(ground.encode(item.to_message(seq, 1, 1, kind=FENCE)))
        s = reduce(s, message, 1.0)
    assert s.fence == fence_items(plan)
    assert s.mission == FLYING.mission


def test_a_plan_whose_fence_is_none_is_refused_and_changes_nothing(tmp_path):
    draft = Draft()
    wrong = plan_file(tmp_path, geoFence={"version": 2, "circles": [], "polygons": [{"polygon": [[1, 2]]}]})
    with pytest.raises(FileError, match=r"geoFence\.polygons\[0\].*1 corners are no polygon"):
        draft.take(load(wrong), str(wrong))
    assert draft == Draft()


async def test_the_mission_screen_opens_sends_and_deletes_a_fence(path, plan, monkeypatch):
    monkeypatch.chdir(path.parent)
    feed = FakeFeed(replace(FLYING, mission=()))
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m", "o")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: "6 items, fence of 5, rally points of 2, not on the vehicle" in screen_text(app))
        await pilot.press("u")
        sent = ("upload", plan.items, *limits(plan).items())
        await until(pilot, lambda: feed.station.asked == [sent])
        feed.snapshot = replace(feed.snapshot, mission=plan.items, **limits(plan))
        await until(pilot, lambda: "2, as on the vehicle" in screen_text(app))
        await pilot.press("down", "down", "j")
        await until(pilot, lambda: feed.station.asked[-1] == ("set_current", 2))
        await pilot.press("c")
        await until(pilot, lambda: isinstance(app.focused, OptionList))
        await pilot.press("down", "enter")
        await until(pilot, lambda: feed.station.asked[-1] == ("clear_plan", mavlink.MAV_MISSION_TYPE_FENCE))


async def test_a_fence_that_the_vehicle_has_is_saved_with_the_plan(plan, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    feed = FakeFeed(replace(FLYING, mission=plan.items, **limits(plan)))
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m", "w")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: "Saved mission.plan" in screen_text(app))
    saved = load(tmp_path / "mission.plan")
    assert (fence_items(saved), rally_items(saved)) == (fence_items(plan), rally_items(plan))
