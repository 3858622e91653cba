"""The operator's requests about mission, fence, rally points and flight plan, and the transfers of the first three."""

from dataclasses import replace

import pytest

from darko_gcs.state.reduce import reduce
from darko_gcs.state.values import ALL_PLANS, FENCE, MISSION, RALLY
from protocol.dialect import mavlink
from protocol.events import MissionDownloaded, MissionFailed, MissionUploaded
from protocol.plans import load
from protocol.plans.fence_rally import fence_items, rally_items
from protocol.wire.codec import Codec
from sitl.defaults import HOME
from tests.support.gcs.limited_plan import write_limited_plan
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.snapshots import HOVERING, snapshot_with

VEHICLE_SIDE = Codec(1, 1)


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
    link.station.plans.upload(plan.items, link.now, **limits(plan))
    link.run(2.0)
    assert kinds(link, MissionUploaded) == [FENCE, RALLY, MISSION]
    assert (link.snapshot.plans.fence, link.snapshot.plans.rally) == (fence_items(plan), rally_items(plan))
    link.station.snapshot = snapshot_with(link.snapshot, plans={"mission": (), "fence": (), "rally": ()})
    link.station.plans.download(link.now)
    link.run(2.0)
    assert link.snapshot.plans.mission == plan.items
    assert (link.snapshot.plans.fence, link.snapshot.plans.rally) == (fence_items(plan), rally_items(plan))


def test_a_fence_alone_leaves_the_mission(link, plan):
    link.station.plans.upload(plan.items, link.now)
    link.run(2.0)
    link.station.plans.upload(None, link.now, fence=fence_items(plan), verify=True)
    link.run(2.0)
    assert kinds(link, MissionUploaded) == [MISSION, FENCE]
    assert (link.snapshot.plans.mission, link.snapshot.plans.fence) == (plan.items, fence_items(plan))


def test_after_a_refused_fence_no_mission_is_uploaded(link, plan):
    circle = fence_items(plan)[-1]
    hole = (
        replace(circle, x=round(HOME.lat_deg * 1e7), y=round(HOME.lon_deg * 1e7), frame=mavlink.MAV_FRAME_LOCAL_NED),
    )
    link.station.plans.upload(plan.items, link.now, fence=hole)
    link.run(2.0)
    assert kinds(link, MissionFailed) == [FENCE]
    assert link.snapshot.plans.mission == link.snapshot.plans.fence == ()
    assert any(line.startswith("Fence upload failed") for line in link.lines)
    link.station.plans.upload(plan.items, link.now)  # nothing of the first upload is left
    link.run(2.0)
    assert (link.snapshot.plans.mission, link.snapshot.plans.rally) == (plan.items, ())


def test_a_request_during_a_download_follows_the_plan_under_way(link, plan):
    link.station.plans.download(link.now)
    link.station.plans.upload(plan.items, link.now, **limits(plan))
    link.run(2.0)
    assert (link.snapshot.plans.mission, len(link.snapshot.plans.fence), len(link.snapshot.plans.rally)) == (
        plan.items,
        5,
        2,
    )
    assert kinds(link, MissionDownloaded) == [MISSION]


def test_a_request_during_an_upload_is_refused(link, plan):
    link.station.plans.upload(plan.items, link.now)
    link.station.plans.clear(FENCE, link.now)
    assert "clear" in link.lines[-1]
    link.run(2.0)
    assert link.snapshot.plans.mission == plan.items


def test_a_plan_without_limits_leaves_the_vehicles_own(link, plan):
    link.station.plans.upload(plan.items, link.now, **limits(plan))
    link.run(2.0)
    link.station.plans.upload(plan.items[:2], link.now)
    link.run(2.0)
    assert link.snapshot.plans.mission == plan.items[:2]
    assert link.snapshot.plans.fence == fence_items(plan)


@pytest.mark.long
@pytest.mark.parametrize(("kind", "left"), [(FENCE, (6, 0, 2)), (RALLY, (6, 5, 0)), (ALL_PLANS, (0, 0, 0))])
def test_one_part_or_all_are_deleted(link, plan, kind, left):
    link.station.plans.upload(plan.items, link.now, **limits(plan))
    link.run(2.0)
    link.station.plans.clear(kind, link.now)
    link.run(1.0)
    s = link.snapshot
    assert (len(s.plans.mission), len(s.plans.fence), len(s.plans.rally)) == left
    assert "cleared" in link.lines[-1]


def test_the_mission_continues_at_another_item(link, plan):
    link.station.plans.upload(plan.items, link.now)
    link.run(1.0)
    link.station.plans.set_current(3, link.now)
    link.run(1.0)
    assert link.snapshot.mission.current == 3


def test_a_recorded_upload_shows_its_fence(plan):
    s, ground = HOVERING, Codec(255, 190)
    for seq, item in enumerate(fence_items(plan)):
        (message,) = Codec(1, 1).decode(ground.encode(item.to_message(seq, 1, 1, kind=FENCE)))
        s = reduce(s, message, 1.0)
    assert s.plans.fence == fence_items(plan)
    assert s.plans.mission == HOVERING.plans.mission


def items_written(link):
    """Numbers of the mission items that reached the vehicle since the beginning."""
    messages = [message for data in link.sent for message in VEHICLE_SIDE.decode(data)]
    return [message.seq for message in messages if message.get_type() == "MISSION_ITEM_INT"]


def test_an_upload_is_read_back_before_it_is_shown(link, plan):
    link.station.plans.upload(plan.items, link.now, **limits(plan), verify=True)
    assert link.run(3.0, lambda: bool(link.events_of(MissionUploaded)))
    assert link.snapshot.plans.fence == ()
    link.run(3.0)
    assert link.snapshot.plans.mission == plan.items
    assert [line for line in link.lines if "read back" in line] == [
        "Fence of 5 items is on the vehicle, read back as sent",
        "Rally plan of 2 items is on the vehicle, read back as sent",
        "Mission of 6 items is on the vehicle, read back as sent",
    ]
    assert not [line for line in link.lines if "uploaded" in line or "downloaded" in line]


def test_a_vehicle_that_holds_something_else_is_told_by_item_and_field(link, plan):
    link.station.plans.upload(plan.items, link.now, verify=True)
    store = link.vehicle.endpoint._mission._plan

    def alter():
        if store.items == plan.items:
            store.items = (replace(plan.items[0], z=7.0), *plan.items[1:])
        return bool(link.events_of(MissionDownloaded))

    assert link.run(3.0, alter)
    assert link.lines[-1] == "Mission read back: the vehicle holds something else: ~ 0  alt 3 -> 7"
    assert link.snapshot.plans.mission[0].z == 7.0


def test_single_items_are_replaced(link, plan):
    link.station.plans.upload(plan.items, link.now)
    link.run(2.0)
    link.sent.clear()
    new = (*plan.items[:2], *(replace(item, z=6.0) for item in plan.items[2:4]), *plan.items[4:])
    link.station.plans.replace_items(new, range(2, 4), link.now)
    link.run(2.0)
    assert items_written(link) == [2, 3]
    assert link.snapshot.plans.mission == link.vehicle.endpoint.mission == new
    assert "Mission: 2 items replaced" in link.lines
    assert link.lines[-1] == "Mission of 6 items is on the vehicle, read back as sent"


@pytest.mark.long
def test_a_vehicle_that_takes_no_single_items_gets_all_of_them_and_keeps_its_current_one(link, plan):
    link.station.plans.upload(plan.items, link.now)
    link.run(2.0)
    link.station.plans.set_current(3, link.now)
    link.run(2.0)
    link.sent.clear()
    server = link.vehicle.endpoint._mission
    server._handlers["MISSION_WRITE_PARTIAL_LIST"] = server._refuse_partial
    new = (*plan.items[:2], replace(plan.items[2], z=6.0), *plan.items[3:])
    link.station.plans.replace_items(new, range(2, 3), link.now)
    link.run(4.0)
    assert items_written(link) == [0, 1, 2, 3, 4, 5]
    assert link.snapshot.plans.mission == new
    assert link.snapshot.mission.current == 3


def test_an_upload_may_name_the_item_to_go_on_with(link, plan):
    link.station.plans.upload(plan.items, link.now, verify=True, current=2)
    link.run(3.0)
    assert link.snapshot.mission.current == 2
    assert link.snapshot.plans.mission == plan.items


def test_a_command_is_answered_in_the_words_that_it_was_asked_in(link):
    link.station.hold(link.now)
    link.run(1.0)
    assert link.lines[-1].startswith("mode HOLD: ")
    assert link.snapshot.operator.asked == {}
