"""Presence: who is there, who went, who came back."""

import math

import pytest

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.engines.heartbeat import HeartbeatMonitor, HeartbeatSource
from protocol.events import VehicleFound, VehicleLost, VehicleReturned

VEHICLE = mavlink.MAVLink_heartbeat_message(19, 12, 81, 0, 4, 3)
GROUND = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def sent_by(message, system, component):
    (received,) = Codec(0, 0).decode(Codec(system, component).encode(message))
    return received


def armed():
    return mavlink.MAVLink_heartbeat_message(19, 12, 209, 0, 4, 3)


def test_the_first_heartbeat_goes_out_at_once_and_then_every_second():
    source, times = HeartbeatSource(), []
    source.announce(VEHICLE, 10.0)
    for now in (10.0, 10.5, 11.0, 11.9, 12.0, 13.0):
        source.announce(VEHICLE, now)
        source.handle_timer(now)
        times += [now] * len(source.messages_to_send())
    assert times == [10.0, 11.0, 12.0, 13.0]


def test_a_change_is_told_at_once_and_restarts_the_second():
    source = HeartbeatSource()
    source.announce(VEHICLE, 0.0)
    source.announce(armed(), 0.4)
    assert [m.base_mode for m in source.messages_to_send()] == [81, 209]
    assert source.next_deadline() == 1.4


def test_missed_beats_are_not_made_up_for():
    source = HeartbeatSource()
    source.announce(VEHICLE, 0.0)
    source.handle_timer(7.3)
    assert len(source.messages_to_send()) == 2
    assert source.next_deadline() == 8.0


def test_the_autopilot_is_found_lost_after_three_seconds_and_returns():
    monitor = HeartbeatMonitor()
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
def test_ground_stations_and_other_components_are_no_vehicles(message, ids):
    monitor = HeartbeatMonitor()
    monitor.receive(sent_by(message, *ids), 0.0)
    assert (monitor.vehicle, monitor.events()) == (None, [])


def test_a_second_vehicle_is_not_taken_for_the_first_while_that_one_is_silent():
    monitor = HeartbeatMonitor()
    monitor.receive(sent_by(VEHICLE, 1, 1), 0.0)
    monitor.receive(sent_by(VEHICLE, 2, 1), 1.0)
    assert monitor.vehicle == (1, 1)
    monitor.handle_timer(3.0)
    monitor.receive(sent_by(VEHICLE, 2, 1), 5.0)
    assert not monitor.is_present
    monitor.receive(sent_by(VEHICLE, 1, 1), 7.0)
    assert monitor.vehicle == (1, 1)
    assert monitor.events() == [VehicleFound(1, 1), VehicleLost(3.0), VehicleReturned(7.0)]
