"""Both ends as their owners use them."""

import math

import pytest

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.endpoint import GroundEndpoint, VehicleEndpoint
from protocol.engines.statustext import split_text
from protocol.errors import LocalProtocolError
from protocol.events import (
    CommandDone,
    CurrentItemSet,
    MessageReceived,
    MessageRequested,
    SetpointReceived,
    VehicleFound,
    VehicleLost,
    VehicleReturned,
)
from protocol.plans.mission import MissionItem
from tests.support.link import ARM, Link, frame, plan, table
from tests.support.lossy_pipe import LossyPipe

ATTITUDE, HOME, VERSION = 30, 242, 148
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3


def endpoint(**options):
    return VehicleEndpoint(
        commands={ARM},
        parameters=table(),
        validate=lambda _items: None,
        streams={ATTITUDE: 20_000, HOME: 1_000_000},
        on_request={VERSION},
        **options,
    )


def long(command, *params, target=(1, 1)):
    values = [*params, *[math.nan] * (7 - len(params))]
    return mavlink.MAVLink_command_long_message(*target, command, 0, *values)


def ask(vehicle, message, key="ground", ids=(255, 190)):
    """Hand one message in; what comes back as (key, message)."""
    vehicle.receive_datagram(frame(message, *ids), key, 0.0)
    return heard(vehicle)


def heard(vehicle):
    return [(key, Codec(255, 190).decode(data)[0]) for key, data in vehicle.datagrams_to_send()]


def names(answers):
    return [message.get_type() for _, message in answers]


# The vehicle's end


def test_answers_go_to_the_one_who_asked_and_telemetry_to_everyone():
    vehicle = endpoint(peers=["a", "b"])
    assert [key for key, _ in ask(vehicle, long(999), key="b")] == ["b"]
    vehicle.publish(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
    assert [key for key, _ in heard(vehicle)] == ["a", "b"]


def test_without_peers_the_transport_is_told_to_send_to_everyone():
    vehicle = endpoint()
    vehicle.publish(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
    assert [key for key, _ in heard(vehicle)] == [None]
    assert [key for key, _ in ask(vehicle, long(999), key="x")] == ["x"]


def test_an_answer_to_one_peer_is_no_loss_to_the_other():
    vehicle, quiet = endpoint(peers=["busy", "quiet"]), Codec(255, 190)
    for _ in range(5):
        ask(vehicle, long(999), key="busy")
        vehicle.publish(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
        for key, data in vehicle.datagrams_to_send():
            if key == "quiet":
                quiet.decode(data)
    assert quiet.statistics.sources[1, 1].received == 5
    assert quiet.statistics.sources[1, 1].lost == 0


def test_a_stranger_becomes_a_peer_by_its_first_valid_frame():
    vehicle = endpoint(peers=["a"])
    vehicle.receive_datagram(b"no frame at all", "noise", 0.0)
    ask(vehicle, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), key="new")
    vehicle.publish(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
    assert [key for key, _ in heard(vehicle)] == ["a", "new"]
    assert vehicle.statistics["new"].received == 1


def test_learnt_peers_are_bounded_and_configured_ones_stay():
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
def test_messages_the_vehicle_has_not_are_unsupported(number):
    vehicle = endpoint()
    ((_, ack),) = ask(vehicle, long(512, number))
    assert ack.result == UNSUPPORTED
    assert vehicle.events() == []


def test_intervals_are_set_and_told():
    vehicle = endpoint()
    ((_, ack),) = ask(vehicle, long(511, ATTITUDE, 40_000))
    assert ack.result == ACCEPTED
    interval, ack = (message for _, message in ask(vehicle, long(510, ATTITUDE)))
    assert (interval.message_id, interval.interval_us, ack.result) == (ATTITUDE, 40_000, ACCEPTED)
    assert [t for t in range(0, 100_000, 5_000) if ATTITUDE in vehicle.streams_due(t)] == [0, 40_000, 80_000]
    ((_, ack),) = ask(vehicle, long(510, 70_000))
    assert ack.result == DENIED


def test_an_old_request_for_data_streams_is_carried_out_without_a_word():
    vehicle = endpoint()
    assert ask(vehicle, mavlink.MAVLink_request_data_stream_message(1, 1, 0, 4, 1)) == []
    assert vehicle.events() == []
    assert [t for t in range(0, 600_000, 5_000) if ATTITUDE in vehicle.streams_due(t)] == [0, 250_000, 500_000]


def test_time_and_ping_are_answered_once_and_answers_are_not():
    vehicle = endpoint()
    vehicle.receive_datagram(frame(mavlink.MAVLink_timesync_message(0, 77)), "ground", 2.5)
    ((_, answer),) = heard(vehicle)
    assert (answer.tc1, answer.ts1) == (2_500_000_000, 77)
    ((_, pong),) = ask(vehicle, mavlink.MAVLink_ping_message(5, 6, 0, 0))
    assert (pong.time_usec, pong.seq, pong.target_system, pong.target_component) == (5, 6, 255, 190)
    for message in (answer, mavlink.MAVLink_ping_message(5, 6, 1, 1)):
        assert ask(vehicle, message) == []


def test_a_ping_of_nobody_gets_no_answer_that_others_would_take_for_a_question():
    vehicle = endpoint()
    vehicle.receive_datagram(frame(mavlink.MAVLink_ping_message(5, 6, 0, 0), 0, 0), "ground", 0.0)
    assert [message for _, message in heard(vehicle) if message.get_type() == "PING"] == []


def test_an_answer_at_time_zero_is_no_question():
    vehicle = endpoint()
    ((_, answer),) = ask(vehicle, mavlink.MAVLink_timesync_message(0, 77))
    assert answer.tc1 != 0


def test_a_vehicle_without_logs_and_files_says_so_at_once():
    vehicle = endpoint()
    ((_, entry),) = ask(vehicle, mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert entry.num_logs == 0
    request = [9, 0, 3, 4, *[0] * 247]
    ((_, nak),) = ask(vehicle, mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, request))
    assert nak.payload[:6] == [10, 0, 3, 129, 1, 4]
    assert nak.payload[12] == mavlink.MAV_FTP_ERR_FILENOTFOUND


def test_set_points_and_messages_no_engine_knows_reach_the_owner():
    vehicle = endpoint()
    setpoint = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)
    ask(vehicle, setpoint)
    ask(vehicle, mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0))
    ask(vehicle, mavlink.MAVLink_set_position_target_local_ned_message(0, 2, 1, 1, 2552, *[1.0] * 11))
    first, second = vehicle.events()
    assert isinstance(first, SetpointReceived)
    assert first.message.x == 1.0
    assert isinstance(second, MessageReceived)


def test_heartbeats_of_ground_stations_are_remembered_and_of_others_are_not():
    vehicle = endpoint()
    vehicle.receive_datagram(frame(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3), 9, 1), "x", 1.0)
    assert vehicle.presence.ground(2.0) is None
    vehicle.receive_datagram(frame(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)), "x", 2.0)
    assert vehicle.presence.ground(2.0) == 0.0
    assert vehicle.events() == []


def test_its_own_frames_coming_back_are_not_obeyed():
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


def test_long_texts_travel_in_chunks_that_join():
    vehicle, text = endpoint(), "Ä" * 30 + "x" * 40  # 100 bytes: two full chunks and an empty one to end them
    vehicle.status_text(4, text)
    chunks = [message for _, message in heard(vehicle)]
    assert [message.chunk_seq for message in chunks] == [0, 1, 2]
    assert len({message.id for message in chunks} - {0}) == 1
    assert b"".join(message._text_raw for message in chunks).decode() == text
    vehicle.status_text(6, "short")
    ((_, short),) = heard(vehicle)
    assert (short.text, short.id) == ("short", 0)


def test_text_numbers_are_never_zero_when_a_text_is_split():
    assert {message.id for message in split_text(4, "y" * 60, 65535)} == {65535}


def test_a_message_that_does_not_fit_raises_where_it_is_published():
    with pytest.raises(LocalProtocolError):
        endpoint().publish(mavlink.MAVLink_mission_current_message(-1))


# The ground station's end


def test_before_a_vehicle_is_found_nothing_can_be_asked():
    ground = GroundEndpoint()
    assert ground.vehicle is None
    with pytest.raises(LocalProtocolError, match="no vehicle"):
        ground.command(ARM, 1.0, now=0.0)
    with pytest.raises(LocalProtocolError, match="no vehicle"):
        ground.upload_mission(plan(1), now=0.0)


def test_the_ground_station_says_it_is_there_every_second():
    ground, beats = GroundEndpoint(), 0
    assert ground.next_deadline() == -math.inf
    for now in (0.0, 0.5, 1.0, 2.0):
        ground.handle_timer(now)
        for data in ground.datagrams_to_send():
            (message,) = Codec(1, 1).decode(data)
            assert message.type == mavlink.MAV_TYPE_GCS
            beats += 1
    assert beats == 3


def test_loss_of_the_vehicle_gives_up_commands_and_its_return_is_told():
    link = Link()
    link.wait_for(VehicleFound)
    whole, link.down = link.down, LossyPipe(0, drop=1.0)
    request = link.ground.command(999, now=link.now, timeout=2.0)
    assert link.wait_for(CommandDone, limit=20.0) == CommandDone(request, 999, None, "vehicle lost")
    assert not link.ground.is_present
    link.down = whole
    assert isinstance(link.wait_for(VehicleReturned), VehicleReturned)
    assert [type(e) for e in link.events[:2]] == [VehicleFound, VehicleLost]


def test_a_command_that_cannot_be_encoded_leaves_nothing_behind():
    link = Link()
    link.wait_for(VehicleFound)
    for command, value in ((70_000, 0.0), (ARM, 1e40)):
        with pytest.raises(LocalProtocolError):
            link.ground.command(command, value, now=link.now)
    assert not link.ground.is_busy


def test_only_the_vehicle_answers_for_the_vehicle():
    link = Link()
    link.wait_for(VehicleFound)
    link.ground.command(ARM, 1.0, now=link.now)
    forged = mavlink.MAVLink_command_ack_message(ARM, DENIED, 0, 0, 255, 190)
    link.ground.receive_datagram(frame(forged, 9, 1), link.now)
    assert link.ground.events() == []
    assert link.wait_for(CommandDone).result == ACCEPTED


def test_the_current_item_is_set_and_confirmed_through_the_link():
    link = Link(items=plan(4))
    link.wait_for(VehicleFound)
    link.ground.set_current_mission_item(2, link.now)
    assert link.wait_for(CurrentItemSet) == CurrentItemSet(2)
    assert link.vehicle.seq == 2


def test_a_message_is_asked_for_and_comes():
    link = Link()
    link.wait_for(VehicleFound)
    link.ground.command(512, ATTITUDE, now=link.now)
    link.wait_for(CommandDone)
    assert link.run(lambda: any(m.get_type() == "ATTITUDE" for m in link.messages))


def test_command_int_carries_wire_integers():
    link, vehicle = Link(), endpoint()
    link.wait_for(VehicleFound)
    link.ground.command_int(ARM, 3, 1.0, 0.0, 0.0, 0.0, 435648000, 14811000, 20.0, now=link.now)
    (data,) = link.ground.datagrams_to_send()
    vehicle.receive_datagram(data, "ground", 0.0)
    assert vehicle.events()[0].params[4:] == (43.5648, 1.4811, 20.0)


def test_a_set_point_is_sent_once():
    ground = GroundEndpoint()
    ground.send(mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11))
    assert len(ground.datagrams_to_send()) == 1
    assert ground.datagrams_to_send() == []


# The mission item both speak of


def test_items_are_equal_when_their_bits_on_the_wire_are():
    one = MissionItem(16, 3, (0.1, math.nan, 0.0, 0.0), 1, 2, 3.0)
    assert one == MissionItem.from_message(Codec(1, 1).decode(frame(one.to_message(0, 1, 1)))[0])
    assert one == MissionItem(16, 3, (0.1, math.nan, 0.0, 0.0), 1, 2, 3.0, current=True)
    assert len({one, MissionItem(16, 3, (0.1, math.nan, -0.0, 0.0), 1, 2, 3.0)}) == 2


@pytest.mark.parametrize("change", [{"command": 70_000}, {"x": 2**31}, {"z": 1e39}, {"params": (0.0, 0.0, 0.0)}])
def test_an_item_the_wire_cannot_carry_does_not_exist(change):
    fields = {"command": 16, "frame": 3, "params": (0.0, 0.0, 0.0, 0.0), "x": 0, "y": 0, "z": 0.0}
    with pytest.raises(LocalProtocolError):
        MissionItem(**fields | change)
