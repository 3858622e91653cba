"""Manual flight by sticks."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.names import Mode
from sitl.autopilot.manual import Sticks
from sitl.autopilot.settings import Settings
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.fake_station import Bench

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM


def sticks(x=0, y=0, z=500, r=0, target=1):
    return mavlink.MAVLink_manual_control_message(target, x, y, z, r, 0)


def flown_by_sticks(tmp_path, *, seconds=5.0, **axes):
    bench = Bench(tmp_path, up=8.0)
    ground = bench.station()
    ground.send(sticks())
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_ACCEPTED
    for _ in range(round(seconds / 0.1)):
        ground.send(sticks(**axes))
        bench.advance(0.1)
    return bench, ground


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("axes", "v"),
    [
        ({"x": 1000}, (3.0, 0.0, 0.0)),
        ({"y": -500}, (0.0, 1.42, 0.0)),  # with a dead zone of 5 %
        ({"z": 1000}, (0.0, 0.0, 2.5)),
        ({"x": 30, "y": -30, "r": 30}, (0.0, 0.0, 0.0)),
    ],
)
def test_sticks_are_a_velocity_and_the_vehicle_holds_when_they_stop(tmp_path, axes, v):
    bench, ground = flown_by_sticks(tmp_path, **axes)
    assert ground.flight_mode is Mode.POSCTL
    assert bench.aircraft.view().v == pytest.approx(v, abs=0.35)
    bench.advance(1.0)
    assert ground.flight_mode is Mode.HOLD
    assert ground.texts().count("Sticks stopped: holding") == 1
    bench.advance(5.0)
    assert np.linalg.norm(bench.aircraft.view().v) < 0.2


def test_the_turning_stick_turns_clockwise_and_forward_follows(tmp_path):
    bench, ground = flown_by_sticks(tmp_path, r=1000, seconds=3.0)
    assert bench.autopilot.reference.heading == pytest.approx(-math.radians(90.0), abs=0.06)
    for _ in range(60):
        ground.send(sticks(x=1000))
        bench.advance(0.1)
    assert bench.aircraft.view().heading == pytest.approx(-math.radians(90.0), abs=0.1)
    assert bench.aircraft.view().v == pytest.approx((0.0, -3.0, 0.0), abs=0.4)


def test_without_sticks_manual_flight_is_refused(tmp_path):
    bench = Bench(tmp_path, up=8.0)
    ground = bench.station()
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    ground.send(sticks(target=7))
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    ground.send(*[sticks(x=1500)] * 5)
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert ground.texts().count("Sticks refused") == 1
    assert bench.autopilot.mode is Mode.HOLD


def test_armed_on_the_ground_it_is_entered_with_the_climbing_stick_down_only(tmp_path):
    bench = Bench(tmp_path)
    ground = bench.station()
    bench.advance(0.5)
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "POSCTL refused: no MANUAL_CONTROL is arriving" in ground.texts()
    ground.send(sticks(z=1000))
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "POSCTL refused: the climbing stick is up" in ground.texts()
    ground.send(sticks())
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_ACCEPTED
    assert not bench.autopilot.flying


def test_in_forward_flight_sticks_make_a_back_transition_first():
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD))
    assert flight.autopilot.guided.go_to((600.0, 0.0, HIGH)).accepted
    flight.fly(8.0)

    def stream():
        flight.autopilot.manual.take_sticks(Sticks())

    stream()
    assert flight.autopilot.set_mode(Mode.POSCTL).accepted
    flight.fly(14.0, stream)
    assert flight.autopilot.mode is Mode.POSCTL
    assert not flight.flown_forward[-1]
    assert np.linalg.norm(flight.v[-1]) < 0.3
    assert not flight.failsafes


def test_on_the_ground_it_is_chosen_disarmed_and_the_climbing_stick_lifts_off_after_arming(tmp_path):
    bench = Bench(tmp_path)
    ground = bench.station()
    bench.advance(0.5)
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_ACCEPTED
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "mode POSCTL: no MANUAL_CONTROL is arriving" in ground.texts()
    ground.send(sticks(z=1000))
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "mode POSCTL: the climbing stick is up" in ground.texts()
    ground.send(sticks())
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    for z, seconds, flies in ((500, 2.0, False), (1000, 3.0, True)):
        for _ in range(round(seconds / 0.1)):
            ground.send(sticks(z=z))
            bench.advance(0.1)
        assert bench.autopilot.flying == flies
    assert ground.flight_mode is Mode.POSCTL
    assert bench.aircraft.view().p[2] > 2.0


def test_armed_on_the_ground_without_sticks_it_holds(tmp_path):
    bench = Bench(tmp_path)
    ground = bench.station()
    bench.advance(0.5)
    ground.mode(Mode.POSCTL)
    ground.send(sticks())
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    bench.advance(2.0)
    assert ground.flight_mode is Mode.HOLD
    assert "Sticks stopped: holding" in ground.texts()
    assert not bench.autopilot.flying
