"""HEARTBEAT of both sides (https://mavlink.io/en/services/heartbeat.html), and answers to TIMESYNC and PING."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.heartbeat import HeartbeatSource, Presence, VehicleMonitor
from protocol.events import VehicleFound, VehicleLost, VehicleReturned
from protocol.wire.codec import Codec
from protocol.wire.message import Peer
from tests.support.links.link import frame
from tests.support.links.vehicle_endpoint import ask, endpoint, heard

VEHICLE = mavlink.MAVLink_heartbeat_message(19, 12, 81, 0, 4, 3)


def armed():
    return mavlink.MAVLink_heartbeat_message(19, 12, 209, 0, 4, 3)


def test_the_first_heartbeat_is_sent_at_once_and_then_every_second():
    source, times = HeartbeatSource(), []
    source.announce(VEHICLE, 10.0)
    for now in (10.0, 10.5, 11.0, 11.9, 12.0, 13.0):
        source.announce(VEHICLE, now)
        source.handle_timer(now)
        times += [now] * len(source.messages_to_send())
    assert times == [10.0, 11.0, 12.0, 13.0]


def test_a_changed_heartbeat_is_sent_at_once_and_restarts_the_period():
    source = HeartbeatSource()
    source.announce(VEHICLE, 0.0)
    source.announce(armed(), 0.4)
    assert [m.base_mode for m in source.messages_to_send()] == [81, 209]
    assert source.next_deadline() == 1.4


def test_missed_heartbeats_are_not_sent_later():
    source = HeartbeatSource()
    source.announce(VEHICLE, 0.0)
    source.handle_timer(7.3)
    assert len(source.messages_to_send()) == 2
    assert source.next_deadline() == 8.0


GROUND = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def sent_by(message, system, component):
    (received,) = Codec(0, 0).decode(Codec(system, component).encode(message))
    return received


def test_the_autopilot_is_found_then_lost_after_three_seconds_then_returns():
    monitor = VehicleMonitor()
    monitor.receive(sent_by(VEHICLE, 1, 1), 1.0)
    assert monitor.events() == [VehicleFound(1, 1)]
    assert monitor.next_deadline() == 4.0
    monitor.handle_timer(3.9)
    assert monitor.is_present
    monitor.handle_timer(4.0)
    assert monitor.events() == [VehicleLost(3.0)]
    assert monitor.next_deadline() == math.inf
    monitor.receive(sent_by(VEHICLE, 1, 1), 9.0)
    assert monitor.events() == [VehicleReturned(8.0)]


@pytest.mark.parametrize(("message", "ids"), [(GROUND, (255, 1)), (VEHICLE, (1, 100))])
def test_ground_stations_and_other_components_are_not_vehicles(message, ids):
    monitor = VehicleMonitor()
    monitor.receive(sent_by(message, *ids), 0.0)
    assert (monitor.vehicle, monitor.events()) == (None, [])


def test_a_second_vehicle_does_not_replace_a_silent_first_one():
    monitor = VehicleMonitor()
    monitor.receive(sent_by(VEHICLE, 1, 1), 0.0)
    monitor.receive(sent_by(VEHICLE, 2, 1), 1.0)
    assert monitor.vehicle == (1, 1)
    monitor.handle_timer(3.0)
    monitor.receive(sent_by(VEHICLE, 2, 1), 5.0)
    assert not monitor.is_present
    monitor.receive(sent_by(VEHICLE, 1, 1), 7.0)
    assert monitor.vehicle == (1, 1)
    assert monitor.events() == [VehicleFound(1, 1), VehicleLost(3.0), VehicleReturned(7.0)]


STATION, COMPANION = mavlink.MAV_TYPE_GCS, mavlink.MAV_TYPE_ONBOARD_CONTROLLER


def peers_heard(*heartbeats):
    """The presence at a vehicle of system 1 that heard (type, system) once a second from 10 s on."""
    presence = Presence(1)
    for second, (kind, system) in enumerate(heartbeats):
        presence.hear(mavlink.MAVLink_heartbeat_message(kind, 8, 0, 0, 4, 3), 10.0 + second, Peer(system, 190))
    return presence


def test_nobody_is_there_at_first():
    assert peers_heard().ground(99.0) is None
    assert peers_heard().companion(99.0) is None


def test_a_station_is_known_by_its_type_whatever_its_system():
    presence = peers_heard((STATION, 255), (STATION, 1), (STATION, 40))
    assert [presence.ground(13.0, system) for system in (255, 1, 40)] == [3.0, 2.0, 1.0]
    assert presence.ground(13.0, 7) is None
    assert presence.ground(13.0) == 1.0  # the one heard last
    assert presence.companion(13.0) is None


@pytest.mark.parametrize(("kind", "system", "silent"), [(COMPANION, 1, 3.0), (COMPANION, 2, None), (STATION, 1, None)])
def test_only_the_vehicles_own_onboard_controller_is_the_companion(kind, system, silent):
    assert peers_heard((kind, system)).companion(13.0) == silent


def test_other_components_count_for_nothing():
    presence = peers_heard((mavlink.MAV_TYPE_CAMERA, 1), (mavlink.MAV_TYPE_QUADROTOR, 255))
    assert presence.ground(13.0) is None
    assert presence.companion(13.0) is None


def test_time_and_ping_are_answered_once_and_answers_are_not():
    vehicle = endpoint()
    vehicle.receive_datagram(frame(mavlink.MAVLink_timesync_message(0, 77)), "ground", 2.5)
    ((_, answer),) = heard(vehicle)
    assert (answer.tc1, answer.ts1) == (2_500_000_000, 77)
    ((_, pong),) = ask(vehicle, mavlink.MAVLink_ping_message(5, 6, 0, 0))
    assert (pong.time_usec, pong.seq, pong.target_system, pong.target_component) == (5, 6, 255, 190)
    for message in (answer, mavlink.MAVLink_ping_message(5, 6, 1, 1)):
        assert ask(vehicle, message) == []


def test_a_ping_from_ids_0_0_is_not_answered():
    vehicle = endpoint()
    vehicle.receive_datagram(frame(mavlink.MAVLink_ping_message(5, 6, 0, 0), 0, 0), "ground", 0.0)
    assert [message for _, message in heard(vehicle) if message.get_type() == "PING"] == []


def test_an_answer_at_time_zero_does_not_look_like_a_request():
    vehicle = endpoint()
    ((_, answer),) = ask(vehicle, mavlink.MAVLink_timesync_message(0, 77))
    assert answer.tc1 != 0
