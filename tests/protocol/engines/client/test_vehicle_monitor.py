"""The vehicle monitor: which autopilot is the vehicle, and whether it is present."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.heartbeat import VehicleMonitor
from protocol.events import VehicleFound, VehicleLost, VehicleReturned
from protocol.wire.codec import Codec

VEHICLE = mavlink.MAVLink_heartbeat_message(19, 12, 81, 0, 4, 3)


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
