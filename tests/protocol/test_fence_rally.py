"""Fence and rally points are plans of their own: up, down, cleared, kept apart; and the older float items."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.engines.base import Peer
from protocol.engines.mission_client import MissionClient
from protocol.engines.mission_server import MissionServer, Refusal
from protocol.engines.plan_store import plan_id
from protocol.errors import FileError, LocalProtocolError
from protocol.events import MissionCleared, MissionDownloaded, MissionFailed, MissionReceived, MissionUploaded
from protocol.plans import Plan, load, save
from protocol.plans.geofence import fence_items, rally_items, with_fence, with_rally
from protocol.plans.mission import MissionItem
from tests.support.link import plan

GROUND, VEHICLE = Peer(255, 190, "ground"), (1, 1)
PLAN, FENCE, RALLY, ALL = 0, 1, 2, 255
OLD = {PLAN: plan(2, 500), FENCE: plan(3, 600), RALLY: plan(1, 700)}
ACCEPTED, UNSUPPORTED, INVALID_X, DENIED = 0, 3, 10, 14
NAN = math.nan


def server(refuse=None):
    """A vehicle with all three plans; ``refuse`` is a type whose new plans are refused."""

    def check(kind):
        return lambda _items: Refusal(5, "no") if kind == refuse else None

    others = {kind: (OLD[kind], check(kind)) for kind in (FENCE, RALLY)}
    return MissionServer(*VEHICLE, OLD[PLAN], validate=check(PLAN), others=others)


def held(engine):
    return {kind: engine.held(kind) for kind in OLD}


def talk(client, engine, now=0.0):
    """Carry messages between both ends until they fall silent; what went to the ground station."""
    heard = []
    while True:
        up, down = client.messages_to_send(), [out.message for out in engine.messages_to_send()]
        if not up and not down:
            return heard
        for message in up:
            engine.receive(message, now, GROUND)
        for message in down:
            client.receive(message, now)
        heard += down


def acks(messages):
    return [(m.mission_type, m.type) for m in messages if m.get_type() == "MISSION_ACK"]


@pytest.mark.parametrize("kind", [PLAN, FENCE, RALLY])
def test_an_upload_replaces_the_plan_of_its_type_and_no_other(kind):
    client, engine, new = MissionClient(255, 190), server(), plan(4, 900)
    client.upload(VEHICLE, new, 0.0, kind)
    assert acks(talk(client, engine)) == [(kind, ACCEPTED)]
    assert held(engine) == {**OLD, kind: new}
    assert engine.events() == [MissionReceived(new, kind)]
    assert client.events()[-1] == MissionUploaded(4, kind)


@pytest.mark.parametrize("kind", [PLAN, FENCE, RALLY])
def test_a_download_gives_the_plan_of_its_type_with_its_type_in_every_item(kind):
    client, engine = MissionClient(255, 190), server()
    client.download(VEHICLE, 0.0, kind)
    heard = talk(client, engine)
    assert {m.mission_type for m in heard} == {kind}
    assert client.events()[-1] == MissionDownloaded(OLD[kind], kind)


@pytest.mark.parametrize("kind", [PLAN, FENCE, RALLY])
def test_a_clear_clears_its_type_only(kind):
    client, engine = MissionClient(255, 190), server()
    client.clear(VEHICLE, 0.0, kind)
    talk(client, engine)
    assert held(engine) == {**OLD, kind: ()}
    assert client.events() == [MissionCleared(kind)]


def test_a_clear_of_all_types_clears_all_and_is_answered_once():
    client, engine = MissionClient(255, 190), server()
    client.clear(VEHICLE, 0.0, ALL)
    assert acks(talk(client, engine)) == [(ALL, ACCEPTED)]
    assert held(engine) == {PLAN: (), FENCE: (), RALLY: ()}
    assert engine.events() == [MissionCleared(kind) for kind in (PLAN, FENCE, RALLY)]


def test_a_clear_of_all_types_clears_none_while_another_station_uploads_one():
    engine, other = server(), Peer(245, 190, "other")
    engine.receive(mavlink.MAVLink_mission_count_message(1, 1, 3, RALLY), 0.0, other)
    engine.receive(mavlink.MAVLink_mission_clear_all_message(1, 1, ALL), 0.0, GROUND)
    assert acks(out.message for out in engine.messages_to_send()) == [(ALL, DENIED)]
    assert held(engine) == OLD


def test_uploads_of_two_types_do_not_disturb_each_other():
    engine, new = server(), plan(2, 900)
    for kind in (FENCE, RALLY):
        engine.receive(mavlink.MAVLink_mission_count_message(1, 1, 2, kind), 0.0, GROUND)
    for seq in range(2):
        for kind in (RALLY, FENCE):
            engine.receive(new[seq].to_message(seq, 1, 1, kind=kind), 0.0, GROUND)
    assert held(engine) == {**OLD, FENCE: new, RALLY: new}


def test_a_refused_fence_leaves_the_old_one_and_says_its_type():
    client, engine = MissionClient(255, 190), server(refuse=FENCE)
    client.upload(VEHICLE, plan(3), 0.0, FENCE)
    talk(client, engine)
    assert held(engine) == OLD
    assert client.events()[-1] == MissionFailed("upload", 5, "INVALID", FENCE)


def test_a_type_nobody_defined_is_unsupported():
    engine = server()
    for message in (
        mavlink.MAVLink_mission_count_message(1, 1, 3, 7),
        mavlink.MAVLink_mission_request_list_message(1, 1, 7),
        mavlink.MAVLink_mission_request_int_message(1, 1, 0, 7),
        mavlink.MAVLink_mission_clear_all_message(1, 1, 7),
        mavlink.MAVLink_mission_write_partial_list_message(1, 1, 0, 0, 7),
    ):
        engine.receive(message, 0.0, GROUND)
    assert acks(out.message for out in engine.messages_to_send()) == [(7, UNSUPPORTED)] * 5


@pytest.mark.parametrize("kind", [FENCE, RALLY])
def test_a_partial_write_is_refused_with_its_type(kind):
    engine = server()
    engine.receive(mavlink.MAVLink_mission_write_partial_list_message(1, 1, 9, 9, kind), 0.0, GROUND)
    assert acks(out.message for out in engine.messages_to_send()) == [(kind, mavlink.MAV_MISSION_INVALID_SEQUENCE)]


def old_item(seq, latitude, frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT):
    return mavlink.MAVLink_mission_item_message(1, 1, seq, frame, 16, 0, 1, 0, 0, 0, NAN, latitude, -1.5, 10.0)


def test_the_float_items_of_old_clients_are_taken():
    engine = server()
    engine.receive(mavlink.MAVLink_mission_count_message(1, 1, 2), 0.0, GROUND)
    engine.receive(old_item(0, 43.5), 0.0, GROUND)
    engine.receive(old_item(1, 20.0, mavlink.MAV_FRAME_LOCAL_NED), 0.0, GROUND)
    expected = (
        MissionItem(16, 3, (0.0, 0.0, 0.0, NAN), 435_000_000, -15_000_000, 10.0),
        MissionItem(16, 1, (0.0, 0.0, 0.0, NAN), 200_000, -15_000, 10.0),
    )
    assert engine.items == expected


def test_a_float_item_that_is_no_position_ends_the_upload():
    engine = server()
    engine.receive(mavlink.MAVLink_mission_count_message(1, 1, 1), 0.0, GROUND)
    engine.receive(old_item(0, 1e9), 0.0, GROUND)
    assert acks(out.message for out in engine.messages_to_send()) == [(PLAN, INVALID_X)]
    assert held(engine) == OLD
    assert not engine.is_receiving


def corner(count, latitude, longitude, command=5001, frame=0):
    return MissionItem(command, frame, (float(count), 0.0, 0.0, 0.0), latitude, longitude, 0.0)


SHAPES = (
    corner(3, 435_000_001, 14_000_000),
    corner(3, 435_100_000, 14_000_000),
    corner(3, 435_100_000, 14_100_003),
    *[corner(4, 435_050_000 + n * 1000, 14_050_000 + n * n * 1000, 5002, 3) for n in range(4)],
    MissionItem(5003, 0, (np.float32(123.4).item(), 0.0, 0.0, 0.0), 435_000_000, 14_000_000, 0.0),
    MissionItem(5004, 0, (7.5, 0.0, 0.0, 0.0), 435_000_000, 14_000_000, 0.0),
)
POINTS = (
    MissionItem(5100, 3, (0.0, 0.0, 0.0, 0.0), 435_000_000, 14_000_000, np.float32(12.3).item()),
    MissionItem(5100, 0, (0.0, 0.0, 0.0, 0.0), 435_000_001, -14_000_000, 162.5),
)


def test_fence_and_rally_points_survive_a_plan_file(tmp_path):
    path = tmp_path / "x.plan"
    save(with_rally(with_fence(Plan(), SHAPES), POINTS), path)
    back = load(path)
    assert fence_items(back) == SHAPES
    assert rally_items(back) == POINTS


def test_a_fence_as_qgroundcontrol_writes_it_becomes_items():
    fence = {
        "circles": [{"circle": {"center": [43.5, 1.4], "radius": 20}, "inclusion": False, "version": 1}],
        "polygons": [{"polygon": [[43.5, 1.4], [43.6, 1.4], [43.6, 1.5]], "inclusion": True, "version": 1}],
        "version": 2,
    }
    items = fence_items(Plan(geo_fence=fence, rally_points={"points": [[43.5, 1.4, 30]], "version": 2}))
    assert [(item.command, item.params[0], item.frame) for item in items] == [(5001, 3.0, 0)] * 3 + [(5004, 20.0, 0)]


@pytest.mark.parametrize(
    ("fence", "said"),
    [
        ({"polygons": [{"polygon": [[1, 2], [3, 4]]}]}, r"geoFence\.polygons\[0\]\.polygon: 2 corners"),
        ({"polygons": [{"polygon": [[1, 2], [3, 4], [95, 4]]}]}, r"polygon\[2\]: 95, 4, 0 is not on the globe"),
        ({"polygons": [{"polygon": [[1, 2], [3, "x"], [5, 4]]}]}, r"polygon\[1\]: \"x\" is not a number"),
        ({"circles": [{"circle": {"center": [1, 2], "radius": -5}}]}, r"circles\[0\]\.circle\.radius: -5 m"),
        ({"circles": [{"circle": {"center": [1, 2], "radius": 5}, "frame": 1}]}, "frame: 1 is no global MAV_FRAME"),
        ({"circles": 3}, r"circles: 3 is not a list"),
    ],
)
def test_a_file_with_no_fence_in_it_is_refused_by_place_and_value(fence, said):
    with pytest.raises(FileError, match=said):
        fence_items(Plan(geo_fence=fence))


def test_an_incomplete_polygon_is_not_written():
    with pytest.raises(LocalProtocolError, match="begins no polygon"):
        with_fence(Plan(), SHAPES[:2])
    with pytest.raises(LocalProtocolError, match="ends before its last"):
        with_fence(Plan(), (*SHAPES[:2], SHAPES[3]))


def test_a_plan_has_an_id_that_uploads_downloads_and_the_current_item_tell():
    client, engine, new = MissionClient(255, 190), server(), plan(3, 900)
    client.upload(VEHICLE, new, 0.0, FENCE)
    (told,) = [m.opaque_id for m in talk(client, engine) if m.get_type() == "MISSION_ACK"]
    client.download(VEHICLE, 0.0, FENCE)
    counts = [m.opaque_id for m in talk(client, engine) if m.get_type() == "MISSION_COUNT"]
    current = mavlink.MAVLink_mission_current_message(1, 2)
    engine.mark(current)
    assert counts == [told] == [current.fence_id]
    assert len({0, current.mission_id, current.fence_id, current.rally_points_id}) == 4


def test_the_id_of_a_plan_is_that_of_its_bits():
    assert plan_id(()) == 0
    assert plan_id(SHAPES) == plan_id(list(SHAPES))
    assert len({plan_id(SHAPES), plan_id(SHAPES[::-1]), plan_id(SHAPES[:-1]), plan_id(POINTS)}) == 4


def test_a_refused_plan_has_no_id():
    client, engine = MissionClient(255, 190), server(refuse=FENCE)
    client.upload(VEHICLE, plan(3), 0.0, FENCE)
    assert [m.opaque_id for m in talk(client, engine) if m.get_type() == "MISSION_ACK"] == [0]


@pytest.mark.parametrize(
    ("name", "crc", "size"), [("mission_current", 28, 18), ("mission_count", 221, 9), ("mission_ack", 153, 8)]
)
def test_the_messages_that_carry_ids_are_still_the_standard_ones(name, crc, size):
    message = getattr(mavlink, f"MAVLink_{name}_message")
    assert (message.crc_extra, message.unpacker.size) == (crc, size)
