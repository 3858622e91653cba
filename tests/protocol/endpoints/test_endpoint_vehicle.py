"""The vehicle's endpoint as its owner uses it."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.server.replies import split_text
from protocol.errors import LocalProtocolError
from protocol.events import MessageReceived, MessageRequested, SetpointReceived
from protocol.wire.codec import Codec
from tests.support.links.link import ARM, frame, plan
from tests.support.links.vehicle_endpoint import ATTITUDE, HOME, VERSION, ask, endpoint, heard, long, names

ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3


def test_the_heartbeat_comes_once_a_second_and_no_request_changes_that():
    vehicle = endpoint()
    get, change = mavlink.MAV_CMD_GET_MESSAGE_INTERVAL, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
    for request in (long(get, 0), long(change, 0, 20_000), long(get, 0)):
        messages = [message for _, message in ask(vehicle, request)]
        told = [message.interval_us for message in messages if message.get_type() == "MESSAGE_INTERVAL"]
        assert told == ([1_000_000] if request.command == get else [])


def test_answers_go_to_the_asking_peer_and_telemetry_to_all():
    vehicle = endpoint(peers=["a", "b"])
    assert [key for key, _ in ask(vehicle, long(999), key="b")] == ["b"]
    vehicle.publish(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
    assert [key for key, _ in heard(vehicle)] == ["a", "b"]


def test_without_peers_datagrams_are_for_everyone():
    vehicle = endpoint()
    vehicle.publish(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
    assert [key for key, _ in heard(vehicle)] == [None]
    assert [key for key, _ in ask(vehicle, long(999), key="x")] == ["x"]


def test_an_answer_to_one_peer_is_not_a_loss_for_the_other():
    vehicle, quiet = endpoint(peers=["busy", "quiet"]), Codec(255, 190)
    for _ in range(5):
        ask(vehicle, long(999), key="busy")
        vehicle.publish(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
        for key, data in vehicle.datagrams_to_send():
            if key == "quiet":
                quiet.decode(data)
    assert quiet.statistics.sources[1, 1].received == 5
    assert quiet.statistics.sources[1, 1].lost == 0


def test_an_unknown_sender_becomes_a_peer_with_its_first_valid_frame():
    vehicle = endpoint(peers=["a"])
    vehicle.receive_datagram(b"no frame at all", "noise", 0.0)
    ask(vehicle, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), key="new")
    vehicle.publish(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
    assert [key for key, _ in heard(vehicle)] == ["a", "new"]
    assert vehicle.statistics["new"].received == 1


def test_learned_peers_are_limited_and_configured_ones_stay():
    vehicle = endpoint(peers=["a"])
    for port in range(200):
        ask(vehicle, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), key=port)
    assert len(vehicle.statistics) == 17
    assert "a" in vehicle.statistics
    assert 199 in vehicle.statistics


def test_a_message_is_acknowledged_before_it_is_sent():
    vehicle = endpoint()
    answers = ask(vehicle, long(mavlink.MAV_CMD_REQUEST_MESSAGE, HOME))
    assert names(answers) == ["COMMAND_ACK"]
    assert answers[0][1].result == ACCEPTED
    (event,) = vehicle.events()
    assert (event.message_id, event.peer.key) == (HOME, "ground")


@pytest.mark.parametrize(("command", "first", "wanted"), [(410, 0, HOME), (520, 1, VERSION), (512, VERSION, VERSION)])
def test_older_commands_for_one_message_work_too(command, first, wanted):
    vehicle = endpoint()
    ask(vehicle, long(command, first, target=(1, 0)))
    (event,) = vehicle.events()
    assert isinstance(event, MessageRequested)
    assert event.message_id == wanted


def test_a_requested_message_may_go_to_everyone():
    vehicle = endpoint()
    ask(vehicle, long(512, HOME, 0, 0, 0, 0, 0, 2))
    assert vehicle.events()[0].peer is None


@pytest.mark.parametrize("number", [999, -1, math.nan, math.inf, 1e30])
def test_requests_for_unknown_messages_are_unsupported(number):
    vehicle = endpoint()
    ((_, ack),) = ask(vehicle, long(512, number))
    assert ack.result == UNSUPPORTED
    assert vehicle.events() == []


def test_intervals_are_set_and_reported():
    vehicle = endpoint()
    ((_, ack),) = ask(vehicle, long(511, ATTITUDE, 40_000))
    assert ack.result == ACCEPTED
    interval, ack = (message for _, message in ask(vehicle, long(510, ATTITUDE)))
    assert (interval.message_id, interval.interval_us, ack.result) == (ATTITUDE, 40_000, ACCEPTED)
    assert [t for t in range(0, 100_000, 5_000) if ATTITUDE in vehicle.streams_due(t)] == [0, 40_000, 80_000]
    ((_, ack),) = ask(vehicle, long(510, 70_000))
    assert ack.result == DENIED


def test_request_data_stream_is_executed_without_an_answer():
    vehicle = endpoint()
    assert ask(vehicle, mavlink.MAVLink_request_data_stream_message(1, 1, 0, 4, 1)) == []
    assert vehicle.events() == []
    assert [t for t in range(0, 600_000, 5_000) if ATTITUDE in vehicle.streams_due(t)] == [0, 250_000, 500_000]


def test_a_vehicle_without_logs_and_files_answers_so_at_once():
    vehicle = endpoint()
    ((_, entry),) = ask(vehicle, mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert entry.num_logs == 0
    request = [9, 0, 3, 4, *[0] * 247]
    ((_, nak),) = ask(vehicle, mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, request))
    assert nak.payload[:6] == [10, 0, 3, 129, 1, 4]
    assert nak.payload[12] == mavlink.MAV_FTP_ERR_FILENOTFOUND


def test_set_points_and_messages_without_an_engine_reach_the_owner():
    vehicle = endpoint()
    setpoint = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)
    ask(vehicle, setpoint)
    ask(vehicle, mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0))
    ask(vehicle, mavlink.MAVLink_set_position_target_local_ned_message(0, 2, 1, 1, 2552, *[1.0] * 11))
    first, second = vehicle.events()
    assert isinstance(first, SetpointReceived)
    assert first.message.x == 1.0
    assert isinstance(second, MessageReceived)


def test_only_heartbeats_of_ground_stations_count_as_ground_presence():
    vehicle = endpoint()
    vehicle.receive_datagram(frame(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3), 9, 1), "x", 1.0)
    assert vehicle.presence.ground(2.0) is None
    vehicle.receive_datagram(frame(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)), "x", 2.0)
    assert vehicle.presence.ground(2.0) == 0.0
    assert vehicle.events() == []


def test_our_own_frames_are_ignored():
    vehicle = endpoint()
    assert ask(vehicle, long(ARM, 1.0), ids=(1, 1)) == []
    assert vehicle.events() == []


def test_a_restored_plan_is_in_force_from_the_start():
    vehicle = endpoint(mission=plan(3))
    ((_, count),) = ask(vehicle, mavlink.MAVLink_mission_request_list_message(1, 1))
    assert count.count == 3
    assert vehicle.mission == plan(3)


def test_a_published_current_item_is_marked_in_downloads():
    vehicle = endpoint(mission=plan(3))
    vehicle.publish(mavlink.MAVLink_mission_current_message(2))
    heard(vehicle)
    ((_, item),) = ask(vehicle, mavlink.MAVLink_mission_request_int_message(1, 1, 2))
    assert item.current == 1


def test_ids_of_split_texts_are_never_zero():
    assert {message.id for message in split_text(4, "y" * 60, 65535)} == {65535}


def test_a_message_that_does_not_fit_raises_where_it_is_published():
    with pytest.raises(LocalProtocolError):
        endpoint().publish(mavlink.MAVLink_mission_current_message(-1))
