"""Mission, fence and rally points to the real vehicle node and back."""

from dataclasses import replace

import pytest

from darko_gcs.state.plan_parts import ALL_PLANS, FENCE, MISSION, RALLY
from darko_gcs.state.reduce import reduce
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.events import MissionDownloaded, MissionFailed, MissionUploaded
from protocol.plans import load
from protocol.plans.fence_rally import fence_items, rally_items
from sitl.defaults import HOME
from tests.support.gcs.limited_plan import write_limited_plan
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.snapshots import HOVERING


@pytest.fixture
def plan(tmp_path):
    return load(write_limited_plan(tmp_path))


@pytest.fixture
def link(tmp_path):
    linked = LinkedStation(tmp_path / "vehicle")
    linked.run(2.5)
    return linked


def limits(plan):
    return {"fence": fence_items(plan), "rally": rally_items(plan)}


def kinds(link, event):
    return [e.kind for e in link.events_of(event)]


def test_all_three_parts_of_a_plan_are_uploaded_and_downloaded(link, plan):
    link.station.upload(plan.items, link.now, **limits(plan))
    link.run(2.0)
    assert kinds(link, MissionUploaded) == [FENCE, RALLY, MISSION]
    assert (link.snapshot.fence, link.snapshot.rally) == (fence_items(plan), rally_items(plan))
    link.station.snapshot = replace(link.snapshot, mission=(), fence=(), rally=())
    link.station.download(link.now)
    link.run(2.0)
    assert link.snapshot.mission == plan.items
    assert (link.snapshot.fence, link.snapshot.rally) == (fence_items(plan), rally_items(plan))


def test_after_a_refused_fence_no_mission_is_uploaded(link, plan):
    circle = fence_items(plan)[-1]
    hole = (
        replace(circle, x=round(HOME.lat_deg * 1e7), y=round(HOME.lon_deg * 1e7), frame=mavlink.MAV_FRAME_LOCAL_NED),
    )
    link.station.upload(plan.items, link.now, fence=hole)
    link.run(2.0)
    assert kinds(link, MissionFailed) == [FENCE]
    assert link.snapshot.mission == link.snapshot.fence == ()
    assert any(line.startswith("Fence upload failed") for line in link.lines)
    link.station.upload(plan.items, link.now)  # nothing of the first upload is left
    link.run(2.0)
    assert (link.snapshot.mission, link.snapshot.rally) == (plan.items, ())


def test_a_request_during_a_download_follows_the_plan_under_way(link, plan):
    link.station.download(link.now)
    link.station.upload(plan.items, link.now, **limits(plan))
    link.run(2.0)
    assert (link.snapshot.mission, len(link.snapshot.fence), len(link.snapshot.rally)) == (plan.items, 5, 2)
    assert kinds(link, MissionDownloaded) == [MISSION]


def test_a_request_during_an_upload_is_refused(link, plan):
    link.station.upload(plan.items, link.now)
    link.station.clear_plan(FENCE, link.now)
    assert "clear" in link.lines[-1]
    link.run(2.0)
    assert link.snapshot.mission == plan.items


def test_a_plan_without_limits_leaves_the_vehicles_own(link, plan):
    link.station.upload(plan.items, link.now, **limits(plan))
    link.run(2.0)
    link.station.upload(plan.items[:2], link.now)
    link.run(2.0)
    assert link.snapshot.mission == plan.items[:2]
    assert link.snapshot.fence == fence_items(plan)


@pytest.mark.parametrize(("kind", "left"), [(FENCE, (6, 0, 2)), (RALLY, (6, 5, 0)), (ALL_PLANS, (0, 0, 0))])
def test_one_part_or_all_are_deleted(link, plan, kind, left):
    link.station.upload(plan.items, link.now, **limits(plan))
    link.run(2.0)
    link.station.clear_plan(kind, link.now)
    link.run(1.0)
    s = link.snapshot
    assert (len(s.mission), len(s.fence), len(s.rally)) == left
    assert "cleared" in link.lines[-1]


def test_the_mission_continues_at_another_item(link, plan):
    link.station.upload(plan.items, link.now)
    link.run(1.0)
    link.station.set_current(3, link.now)
    link.run(1.0)
    assert link.snapshot.mission_current == 3


def test_a_recorded_upload_shows_its_fence(plan):
    s, ground = HOVERING, Codec(255, 190)
    for seq, item in enumerate(fence_items(plan)):
        (message,) = Codec(1, 1).decode(ground.encode(item.to_message(seq, 1, 1, kind=FENCE)))
        s = reduce(s, message, 1.0)
    assert s.fence == fence_items(plan)
    assert s.mission == HOVERING.mission
