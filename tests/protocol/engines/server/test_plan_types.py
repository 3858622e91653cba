"""Flight plan, fence and rally points are independent plans with ids of their own; the older float items."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.client.mission_client import MissionClient
from protocol.engines.server.mission_server import MissionServer, plan_id
from protocol.events import MissionCleared, MissionDownloaded, MissionFailed, MissionReceived, MissionUploaded
from protocol.plans.plan import MissionItem, Refusal
from protocol.wire.message import Peer
from tests.support.links.link import plan
from tests.support.vehicle.fence_shapes import POINTS, SHAPES

GROUND, VEHICLE = Peer(255, 190, "ground"), (1, 1)


PLAN, FENCE, RALLY, ALL = 0, 1, 2, 255


OLD = {PLAN: plan(2, 500), FENCE: plan(3, 600), RALLY: plan(1, 700)}


ACCEPTED, UNSUPPORTED, INVALID_X, DENIED = 0, 3, 10, 14


NAN = math.nan


def server(refuse=None):
    """A vehicle with all three plans; ``refuse`` is a type whose new plans are refused."""

    def check(kind):
        return lambda _items: Refusal("no", 5) if kind == refuse else None

    others = {kind: (OLD[kind], check(kind)) for kind in (FENCE, RALLY)}
    return MissionServer(*VEHICLE, OLD[PLAN], validate=check(PLAN), others=others)


def plans(engine):
    return {kind: engine.plan(kind) for kind in OLD}


def talk(client, engine, now=0.0):
    """Carry messages between both ends until both are silent; returns those to the ground station."""
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
def test_an_upload_replaces_only_the_plan_of_its_type(kind):
    client, engine, new = MissionClient(255, 190), server(), plan(4, 900)
    client.upload(VEHICLE, new, 0.0, kind)
    assert acks(talk(client, engine)) == [(kind, ACCEPTED)]
    assert plans(engine) == {**OLD, kind: new}
    assert engine.events() == [MissionReceived(new, kind)]
    assert client.events()[-1] == MissionUploaded(4, kind)


@pytest.mark.parametrize("kind", [PLAN, FENCE, RALLY])
def test_a_download_returns_the_plan_of_its_type(kind):
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
    assert plans(engine) == {**OLD, kind: ()}
    assert client.events() == [MissionCleared(kind)]


def test_a_clear_of_all_types_clears_all_and_is_answered_once():
    client, engine = MissionClient(255, 190), server()
    client.clear(VEHICLE, 0.0, ALL)
    assert acks(talk(client, engine)) == [(ALL, ACCEPTED)]
    assert plans(engine) == {PLAN: (), FENCE: (), RALLY: ()}
    assert engine.events() == [MissionCleared(kind) for kind in (PLAN, FENCE, RALLY)]


def test_a_clear_of_all_types_is_denied_while_another_station_uploads():
    engine, other = server(), Peer(245, 190, "other")
    engine.receive(mavlink.MAVLink_mission_count_message(1, 1, 3, RALLY), 0.0, other)
    engine.receive(mavlink.MAVLink_mission_clear_all_message(1, 1, ALL), 0.0, GROUND)
    assert acks(out.message for out in engine.messages_to_send()) == [(ALL, DENIED)]
    assert plans(engine) == OLD


def test_uploads_of_two_types_do_not_disturb_each_other():
    engine, new = server(), plan(2, 900)
    for kind in (FENCE, RALLY):
        engine.receive(mavlink.MAVLink_mission_count_message(1, 1, 2, kind), 0.0, GROUND)
    for seq in range(2):
        for kind in (RALLY, FENCE):
            engine.receive(new[seq].to_message(seq, 1, 1, kind=kind), 0.0, GROUND)
    assert plans(engine) == {**OLD, FENCE: new, RALLY: new}


def test_a_refused_fence_keeps_the_old_one_and_reports_its_type():
    client, engine = MissionClient(255, 190), server(refuse=FENCE)
    client.upload(VEHICLE, plan(3), 0.0, FENCE)
    talk(client, engine)
    assert plans(engine) == OLD
    assert client.events()[-1] == MissionFailed("upload", 5, "INVALID", FENCE)


def test_an_undefined_plan_type_is_unsupported():
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


def test_the_float_items_of_old_clients_are_accepted():
    engine = server()
    engine.receive(mavlink.MAVLink_mission_count_message(1, 1, 2), 0.0, GROUND)
    engine.receive(old_item(0, 43.5), 0.0, GROUND)
    engine.receive(old_item(1, 20.0, mavlink.MAV_FRAME_LOCAL_NED), 0.0, GROUND)
    expected = (
        MissionItem(command=16, frame=3, params=(0.0, 0.0, 0.0, NAN), x=435_000_000, y=-15_000_000, z=10.0),
        MissionItem(command=16, frame=1, params=(0.0, 0.0, 0.0, NAN), x=200_000, y=-15_000, z=10.0),
    )
    assert engine.items == expected


def test_a_float_item_without_a_valid_position_ends_the_upload():
    engine = server()
    engine.receive(mavlink.MAVLink_mission_count_message(1, 1, 1), 0.0, GROUND)
    engine.receive(old_item(0, 1e9), 0.0, GROUND)
    assert acks(out.message for out in engine.messages_to_send()) == [(PLAN, INVALID_X)]
    assert plans(engine) == OLD
    assert not engine.is_receiving


def test_uploads_downloads_and_the_current_item_carry_the_plan_id():
    client, engine, new = MissionClient(255, 190), server(), plan(3, 900)
    client.upload(VEHICLE, new, 0.0, FENCE)
    (told,) = [m.opaque_id for m in talk(client, engine) if m.get_type() == "MISSION_ACK"]
    client.download(VEHICLE, 0.0, FENCE)
    counts = [m.opaque_id for m in talk(client, engine) if m.get_type() == "MISSION_COUNT"]
    current = mavlink.MAVLink_mission_current_message(1, 2)
    engine.mark(current)
    assert counts == [told] == [current.fence_id]
    assert len({0, current.mission_id, current.fence_id, current.rally_points_id}) == 4


def test_a_plan_id_depends_on_the_bits_of_its_items():
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
def test_the_messages_with_plan_ids_have_their_standard_crc(name, crc, size):
    message = getattr(mavlink, f"MAVLink_{name}_message")
    assert (message.crc_extra, message.unpacker.size) == (crc, size)
