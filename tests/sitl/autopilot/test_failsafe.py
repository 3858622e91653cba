"""Failsafes, flown: the ground station, the set-points and the battery fail; sticks; each says why, once."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Way
from protocol.modes import Mode
from sitl.autopilot.failsafe import BatteryWatch, Reserve, WayHome, energy_home, hover_power
from sitl.autopilot.link_watch import LinkWatches, Silence
from sitl.autopilot.manual import Sticks
from sitl.autopilot.settings import Settings
from tests.support.failsafe_flights import CRITICAL, ERRANDS
from tests.support.station import Sky
from tests.support.wing_flight import HIGH, Flight

ON_THE_WING = Settings(way=Way.FORWARD)


# The ground station's heartbeats


def test_before_the_first_heartbeat_there_is_no_link_to_lose(tmp_path):
    sky = Sky(tmp_path, up=5.0, settings=Settings(link_action=2, link_timeout=3.0))
    ground = sky.station()
    sky.advance(5.0)
    assert sky.autopilot.mode is Mode.HOLD
    assert "ground station" not in ground.texts()


@pytest.mark.parametrize(
    ("action", "mode", "said"),
    [(0, Mode.HOLD, "going on"), (1, Mode.HOLD, "holding"), (2, Mode.RTL, "returning"), (3, Mode.LAND, "landing")],
)
def test_in_the_hover_a_lost_ground_station_starts_the_action_set_and_says_so_once(tmp_path, action, mode, said):
    sky = Sky(tmp_path, up=5.0, settings=Settings(link_action=action, link_timeout=3.0))
    ground = sky.station()
    ground.beat()
    sky.advance(2.8)
    assert "No ground station" not in ground.texts()
    sky.advance(1.2)
    assert ground.texts().count(f"No ground station for 3 s: {said}") == 1
    assert ground.flight_mode is mode
    ground.beat()
    sky.advance(0.2)
    assert ground.texts().count("Ground station is back") == 1
    assert ground.flight_mode is mode  # what to do now is the pilot's to say
    sky.advance(3.5)
    assert ground.texts().count("No ground station") == 2


def test_on_the_wing_a_lost_ground_station_brings_the_vehicle_home_and_down(tmp_path):
    sky = Sky(tmp_path, up=HIGH, settings=ON_THE_WING._replace(link_action=2, link_timeout=5.0))
    ground = sky.station()
    ground.beat()
    assert sky.autopilot.go_to((500.0, 0.0, HIGH)).accepted
    sky.advance(4.5)
    assert sky.craft.vehicle.law is Law.FORWARD_LINEAR
    sky.advance_until(lambda: not sky.autopilot.armed, 90.0)
    assert "No ground station for 5 s: returning" in ground.texts()
    assert np.linalg.norm(sky.craft.vehicle.truth.body.position[:2]) < 0.5


def test_a_landing_goes_on_when_the_ground_station_is_lost():
    (alarm,) = LinkWatches().check(Silence(ground=11.0), ON_THE_WING._replace(link_action=2))
    assert alarm.action == 2
    flight = Flight()
    flight.autopilot.apply(Settings(link_action=2, link_timeout=1.0))
    flight.autopilot.land()
    flight.autopilot.failsafes.silence = Silence(ground=2.0)
    flight.fly(0.5)
    assert flight.autopilot.mode is Mode.LAND
    assert "No ground station for 1 s: the landing goes on" in flight.said


# Set-points


@pytest.mark.parametrize(
    ("action", "mode", "said"), [(3, Mode.RTL, "returning"), (4, Mode.LAND, "landing"), (5, Mode.HOLD, "holding")]
)
@pytest.mark.parametrize("speed", [2.0, 15.0])
def test_lost_set_points_start_the_action_set(speed, action, mode, said):
    flight = Flight()
    flight.autopilot.apply(Settings(setpoint_action=action))

    def stream():
        assert flight.autopilot.set_offboard_velocity((speed, 0.0, 0.0)) is None

    stream()
    flight.autopilot.set_mode(Mode.OFFBOARD)
    flight.fly(6.0, stream)
    assert flight.autopilot.view.forward is (speed > 10.0)
    flight.fly(1.0)
    assert flight.autopilot.mode is mode
    assert flight.said.count(f"Set-points stopped: {said}") == 1


# The battery


def test_the_power_of_the_hover_is_what_the_vehicle_draws():
    flight = Flight()
    flight.fly(3.0)
    assert hover_power(flight.vehicle.airframe) == pytest.approx(flight.vehicle.power, rel=1e-3)


@pytest.mark.parametrize(("north", "way"), [(15.0, Way.HOVER), (300.0, Way.FORWARD)])
def test_the_predicted_energy_of_the_return_is_that_of_the_return_flown(north, way):
    settings = Settings(way=way)
    flight = Flight(settings=settings)
    assert flight.autopilot.go_to((north, 0.0, HIGH)).accepted
    flight.fly(40.0 if way is Way.FORWARD else 14.0)
    before = flight.vehicle.energy
    predicted = energy_home(flight.craft.view(), (0.0, 0.0, 0.0), settings, flight.autopilot.chooser)
    flight.autopilot.return_to_launch()
    flight.fly_until(lambda: not flight.autopilot.flying, 120.0)
    assert predicted == pytest.approx(flight.vehicle.energy - before, rel=0.1)


def test_it_returns_while_the_battery_still_takes_it_home_and_lands_there_with_the_reserve():
    settings = Settings(way=Way.FORWARD, battery_low=0.4, battery_critical=0.1)
    flight = Flight(settings=settings)
    flight.craft.bind(flight.craft.bindings.replaced({"SIM_BAT_ENERGY": 10e3}))
    assert flight.autopilot.go_to((800.0, 0.0, HIGH)).accepted
    flight.fly_until(lambda: not flight.autopilot.flying, 200.0)
    (why,) = [text for text in flight.said if text.endswith("returning")]
    assert why.startswith("Battery: ")
    assert 100.0 < flight.p[:, 0].max() < 700.0
    assert np.linalg.norm(flight.p[-1, :2]) < 1.0
    assert 0.1 <= flight.craft.battery.left < 0.3
    assert sum(text.startswith("Battery low") for text in flight.said) == 1


@pytest.mark.parametrize("errand", [ERRANDS[2], ERRANDS[4], ERRANDS[6]], ids=lambda errand: errand.name)
def test_against_the_wind_on_a_mission_and_in_offboard_it_is_home_in_time_too(errand):
    flight = errand.fly()
    assert sum(text.endswith("are kept: returning") for text in flight.said) == 1
    assert flight.p[:, 0].max() > 300.0
    assert flight.modes[-2:] == [Mode.RTL, Mode.HOLD]
    assert np.linalg.norm(flight.p[-1, :2]) < 3.0
    assert flight.craft.battery.left > CRITICAL


def test_in_a_wind_more_is_kept_for_landings_take_longer_than_anybody_can_say():
    flight, kept = Flight(), []
    for wind in ((0.0, 0.0, 0.0), (4.0, 0.0, 0.0)):
        view = flight.craft.view()._replace(wind=wind)
        way_home = WayHome().reserve(view, Mode.HOLD, (0.0, 0.0, 5.0), Settings(), flight.autopilot.chooser)
        kept.append(way_home.kept)
    assert kept[0] == pytest.approx(0.07e6)
    assert kept[1] - kept[0] > 5e3


def test_it_lands_where_it_is_when_home_is_out_of_reach():
    flight = Flight(settings=ON_THE_WING)
    assert flight.autopilot.go_to((500.0, 0.0, HIGH)).accepted
    flight.fly(20.0)
    flight.craft.bind(flight.craft.bindings.replaced({"SIM_BAT_ENERGY": flight.vehicle.energy + 5.9e3}))
    flight.fly_until(lambda: not flight.autopilot.flying, 90.0)
    assert any(text.endswith("out of reach: landing") for text in flight.said)
    assert not any(text.endswith("returning") for text in flight.said)
    assert flight.p[-1, 0] > 200.0
    assert flight.craft.battery.left > 0.0
    assert not flight.failsafes


@pytest.mark.parametrize(("action", "mode", "said"), [(0, Mode.HOLD, "going on"), (2, Mode.LAND, "landing")])
def test_a_critical_battery_warns_or_lands_as_set(action, mode, said):
    flight = Flight(settings=Settings(battery_action=action))
    flight.fly(1.0)
    flight.craft.bind(flight.craft.bindings.replaced({"SIM_BAT_ENERGY": flight.vehicle.energy / 0.94}))
    flight.fly(2.5)
    assert flight.autopilot.mode is mode
    assert [text for text in flight.said if "critical" in text] == [f"Battery critical: 6 % left: {said}"]


def test_a_battery_about_a_threshold_is_told_of_once():
    watch, reserve = BatteryWatch(), Reserve(1e4, 1e3, 1e3)
    shares = [0.151, 0.149, 0.151, 0.149, 0.16, 0.148]
    alarms = [watch.check(share, reserve, Settings(), Mode.HOLD) for share in shares]
    assert [len(told) for told in alarms] == [0, 1, 0, 0, 0, 0]
    watch.check(0.18, reserve, Settings(), Mode.HOLD)
    assert len(watch.check(0.149, reserve, Settings(), Mode.HOLD)) == 1


def test_a_way_home_that_cannot_be_predicted_lands_nobody_before_the_battery_is_critical():
    watch, unknown = BatteryWatch(), Reserve(1e4, math.inf, 1e3)
    assert watch.check(0.5, unknown, Settings(), Mode.HOLD) == []
    assert [alarm.action for alarm in watch.check(0.06, unknown, Settings(), Mode.HOLD)] == [None, 3]


def test_the_pilot_may_go_on_after_a_battery_alarm_until_it_is_critical():
    watch = BatteryWatch()
    (alarm,) = watch.check(0.3, Reserve(5000.0, 4500.0, 500.0), Settings(), Mode.MISSION)
    assert alarm.action == 2
    assert watch.check(0.29, Reserve(4900.0, 4500.0, 500.0), Settings(), Mode.MISSION) == []
    assert watch.check(0.2, Reserve(4400.0, 4500.0, 500.0), Settings(), Mode.MISSION) == []
    assert watch.check(0.2, Reserve(4400.0, 4500.0, 500.0), Settings(), Mode.RTL)[0].action == 3


# Sticks


def sticks(x=0, y=0, z=500, r=0, target=1):
    return mavlink.MAVLink_manual_control_message(target, x, y, z, r, 0)


def flown_by_sticks(tmp_path, *, seconds=5.0, **axes):
    sky = Sky(tmp_path, up=8.0)
    ground = sky.station()
    ground.send(sticks())
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_ACCEPTED
    for _ in range(round(seconds / 0.1)):
        ground.send(sticks(**axes))
        sky.advance(0.1)
    return sky, ground


@pytest.mark.parametrize(
    ("axes", "v"),
    [
        ({"x": 1000}, (3.0, 0.0, 0.0)),
        ({"y": -500}, (0.0, 1.42, 0.0)),  # 5 % in the middle are none
        ({"z": 1000}, (0.0, 0.0, 2.5)),
        ({"x": 30, "y": -30, "r": 30}, (0.0, 0.0, 0.0)),
    ],
)
def test_sticks_are_a_velocity_and_let_go_they_hold(tmp_path, axes, v):
    sky, ground = flown_by_sticks(tmp_path, **axes)
    assert ground.flight_mode is Mode.POSCTL
    assert sky.craft.view().v == pytest.approx(v, abs=0.35)
    sky.advance(1.0)
    assert ground.flight_mode is Mode.HOLD
    assert ground.texts().count("Sticks stopped: holding") == 1
    sky.advance(5.0)
    assert np.linalg.norm(sky.craft.view().v) < 0.2


def test_the_turning_stick_turns_clockwise_and_forward_follows(tmp_path):
    sky, ground = flown_by_sticks(tmp_path, r=1000, seconds=3.0)
    assert sky.autopilot.reference.heading == pytest.approx(-math.radians(90.0), abs=0.06)
    for _ in range(60):
        ground.send(sticks(x=1000))
        sky.advance(0.1)
    assert sky.craft.view().heading == pytest.approx(-math.radians(90.0), abs=0.1)
    assert sky.craft.view().v == pytest.approx((0.0, -3.0, 0.0), abs=0.4)


def test_sticks_that_are_not_there_fly_nothing(tmp_path):
    sky = Sky(tmp_path, up=8.0)
    ground = sky.station()
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    ground.send(sticks(target=7))
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    ground.send(*[sticks(x=1500)] * 5)
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert ground.texts().count("Sticks refused") == 1
    assert sky.autopilot.mode is Mode.HOLD


def test_on_the_ground_sticks_are_refused_in_words(tmp_path):
    ground = Sky(tmp_path).station()
    ground.send(sticks())
    assert ground.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "not in the air" in ground.texts()


def test_from_the_wing_sticks_bring_the_vehicle_upright_first():
    flight = Flight(settings=ON_THE_WING)
    assert flight.autopilot.go_to((600.0, 0.0, HIGH)).accepted
    flight.fly(8.0)

    def stream():
        flight.autopilot.take_sticks(Sticks())

    stream()
    assert flight.autopilot.set_mode(Mode.POSCTL).accepted
    flight.fly(14.0, stream)
    assert flight.autopilot.mode is Mode.POSCTL
    assert not flight.winged[-1]
    assert np.linalg.norm(flight.v[-1]) < 0.3
    assert not flight.failsafes
