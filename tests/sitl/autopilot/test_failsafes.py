"""Failsafes, flown: ground station, set-points and battery fail; each alarm has its reason and is raised once."""

import math

import numpy as np
import pytest

from protocol.dialect.vocabulary import LegMode
from protocol.names import Mode
from sitl.autopilot.failsafes import BatteryWatch, Reserve, ReturnEnergy, energy_home, hover_power
from sitl.autopilot.settings import Settings
from sitl.autopilot.watches import LinkSilence, LinkWatches
from tests.support.flights.failsafe_flights import CRITICAL, ERRANDS
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.fake_station import Bench

FORWARD = Settings(leg_mode=LegMode.FORWARD)


# The ground station


def test_before_the_first_heartbeat_there_is_no_link_to_lose(tmp_path):
    bench = Bench(tmp_path, up=5.0, settings=Settings(link_action=2, link_timeout=3.0))
    ground = bench.station()
    bench.advance(5.0)
    assert bench.autopilot.mode is Mode.HOLD
    assert "ground station" not in ground.texts()


@pytest.mark.parametrize(
    ("action", "mode", "doing"),
    [(0, Mode.HOLD, "going on"), (1, Mode.HOLD, "holding"), (2, Mode.RTL, "returning"), (3, Mode.LAND, "landing")],
)
def test_in_hover_a_lost_ground_station_starts_the_set_action_and_is_reported_once(tmp_path, action, mode, doing):
    bench = Bench(tmp_path, up=5.0, settings=Settings(link_action=action, link_timeout=3.0))
    ground = bench.station()
    ground.beat()
    bench.advance(2.8)
    assert "No ground station" not in ground.texts()
    bench.advance(1.2)
    assert ground.texts().count(f"No ground station for 3 s: {doing}") == 1
    assert ground.flight_mode is mode
    ground.beat()
    bench.advance(0.2)
    assert ground.texts().count("Ground station is back") == 1
    assert ground.flight_mode is mode  # the pilot decides what to do now
    bench.advance(3.5)
    assert ground.texts().count("No ground station") == 2


@pytest.mark.long
def test_in_forward_flight_a_lost_ground_station_brings_the_vehicle_home(tmp_path):
    bench = Bench(tmp_path, up=HIGH, settings=FORWARD._replace(link_action=2, link_timeout=5.0))
    ground = bench.station()
    ground.beat()
    assert bench.autopilot.guided.go_to((500.0, 0.0, HIGH)).accepted
    bench.advance(4.5)
    assert bench.aircraft.view().forward
    bench.advance_until(lambda: not bench.autopilot.armed, 90.0)
    assert "No ground station for 5 s: returning" in ground.texts()
    assert np.linalg.norm(bench.aircraft.vehicle.truth.body.position[:2]) < 0.5


def test_a_landing_continues_when_the_ground_station_is_lost():
    (alarm,) = LinkWatches().check(LinkSilence(ground=11.0), FORWARD._replace(link_action=2))
    assert alarm.action == 2
    flight = Flight()
    flight.autopilot.configure(Settings(link_action=2, link_timeout=1.0))
    flight.autopilot.guided.land()
    flight.autopilot.failsafes.silence = LinkSilence(ground=2.0)
    flight.fly(0.5)
    assert flight.autopilot.mode is Mode.LAND
    assert "No ground station for 1 s: landing continues" in flight.texts


# Set-points


@pytest.mark.parametrize(
    ("action", "mode", "doing"), [(3, Mode.RTL, "returning"), (4, Mode.LAND, "landing"), (5, Mode.HOLD, "holding")]
)
@pytest.mark.parametrize("speed", [2.0, 15.0])
def test_lost_set_points_start_the_set_action(speed, action, mode, doing):
    flight = Flight()
    flight.autopilot.configure(Settings(setpoint_action=action))

    def stream():
        assert flight.autopilot.offboard.set_velocity((speed, 0.0, 0.0)) is None

    stream()
    flight.autopilot.set_mode(Mode.OFFBOARD)
    flight.fly(6.0, stream)
    assert flight.autopilot.view.forward is (speed > 10.0)
    flight.fly(1.0)
    assert flight.autopilot.mode is mode
    assert flight.texts.count(f"Set-points stopped: {doing}") == 1


# The battery


def test_the_computed_hover_power_is_what_the_vehicle_draws():
    flight = Flight()
    flight.fly(3.0)
    assert hover_power(flight.vehicle.airframe) == pytest.approx(flight.vehicle.power, rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize(("north", "leg_mode"), [(15.0, LegMode.HOVER), (300.0, LegMode.FORWARD)])
def test_the_predicted_energy_of_the_return_is_that_of_the_return_flown(north, leg_mode):
    settings = Settings(leg_mode=leg_mode)
    flight = Flight(settings=settings)
    assert flight.autopilot.guided.go_to((north, 0.0, HIGH)).accepted
    flight.fly(40.0 if leg_mode is LegMode.FORWARD else 14.0)
    before = flight.vehicle.energy
    predicted = energy_home(flight.aircraft.view(), (0.0, 0.0, 0.0), settings, flight.autopilot.chooser)
    flight.autopilot.guided.return_to_launch()
    flight.fly_until(lambda: not flight.autopilot.flying, 120.0)
    assert predicted == pytest.approx(flight.vehicle.energy - before, rel=0.1)


@pytest.mark.long
def test_it_returns_in_time_and_lands_at_home_with_the_reserve():
    settings = Settings(leg_mode=LegMode.FORWARD, battery_low=0.4, battery_critical=0.1)
    flight = Flight(settings=settings)
    flight.aircraft.configure(flight.aircraft.configuration.replaced({"SIM_BAT_ENERGY": 10e3}))
    assert flight.autopilot.guided.go_to((800.0, 0.0, HIGH)).accepted
    flight.fly_until(lambda: not flight.autopilot.flying, 200.0)
    (alarm,) = [text for text in flight.texts if text.endswith("returning")]
    assert alarm.startswith("Battery: ")
    assert 100.0 < flight.p[:, 0].max() < 790.0
    assert np.linalg.norm(flight.p[-1, :2]) < 1.0
    assert 0.1 <= flight.aircraft.battery.remaining < 0.3
    assert sum(text.startswith("Battery low") for text in flight.texts) == 1


@pytest.mark.long
@pytest.mark.parametrize(
    ("errand", "capacity"),
    [(ERRANDS[2], 25e3), (ERRANDS[4], 10.5e3), (ERRANDS[6], 10.5e3)],  # small batteries: they turn back soon
    ids=[ERRANDS[i].name for i in (2, 4, 6)],
)
def test_it_is_home_in_time_against_the_wind_on_missions_and_in_offboard(errand, capacity):
    flight = errand._replace(capacity=capacity).fly()
    assert sum(", margin " in text and text.endswith("J: returning") for text in flight.texts) == 1
    assert flight.p[:, 0].max() > 300.0
    assert flight.modes[-2:] == [Mode.RTL, Mode.HOLD]
    assert np.linalg.norm(flight.p[-1, :2]) < 3.0
    assert flight.aircraft.battery.remaining > CRITICAL


def test_in_a_wind_the_margin_is_larger_for_landings_of_unknown_length():
    flight, margins = Flight(), []
    for wind in ((0.0, 0.0, 0.0), (4.0, 0.0, 0.0)):
        view = flight.aircraft.view()._replace(wind=wind)
        reserve = ReturnEnergy().reserve(view, Mode.HOLD, (0.0, 0.0, 5.0), Settings(), flight.autopilot.chooser)
        margins.append(reserve.margin)
    assert margins[0] == pytest.approx(0.07e6)
    assert margins[1] - margins[0] > 5e3


def test_it_lands_on_the_spot_when_home_is_out_of_reach():
    flight = Flight(settings=FORWARD)
    assert flight.autopilot.guided.go_to((500.0, 0.0, HIGH)).accepted
    flight.fly(20.0)
    flight.aircraft.configure(flight.aircraft.configuration.replaced({"SIM_BAT_ENERGY": flight.vehicle.energy + 5.9e3}))
    flight.fly_until(lambda: not flight.autopilot.flying, 90.0)
    assert any(text.endswith("out of reach: landing") for text in flight.texts)
    assert not any(text.endswith("returning") for text in flight.texts)
    assert flight.p[-1, 0] > 200.0
    assert flight.aircraft.battery.remaining > 0.0
    assert not flight.failsafes


@pytest.mark.parametrize(("action", "mode", "doing"), [(0, Mode.HOLD, "going on"), (2, Mode.LAND, "landing")])
def test_a_critical_battery_starts_the_set_action(action, mode, doing):
    flight = Flight(settings=Settings(battery_action=action))
    flight.fly(1.0)
    flight.aircraft.configure(flight.aircraft.configuration.replaced({"SIM_BAT_ENERGY": flight.vehicle.energy / 0.94}))
    flight.fly(2.5)
    assert flight.autopilot.mode is mode
    assert [text for text in flight.texts if "critical" in text] == [f"Battery critical: 6 % left: {doing}"]


def test_a_battery_about_a_threshold_is_reported_once():
    watch, reserve = BatteryWatch(), Reserve(1e4, 1e3, 1e3)
    shares = [0.151, 0.149, 0.151, 0.149, 0.16, 0.148]
    alarms = [watch.check(share, reserve, Settings(), Mode.HOLD) for share in shares]
    assert [len(raised) for raised in alarms] == [0, 1, 0, 0, 0, 0]
    watch.check(0.18, reserve, Settings(), Mode.HOLD)
    assert len(watch.check(0.149, reserve, Settings(), Mode.HOLD)) == 1


def test_an_unpredictable_way_home_does_not_cause_a_landing_before_the_battery_is_critical():
    watch, unknown = BatteryWatch(), Reserve(1e4, math.inf, 1e3)
    assert watch.check(0.5, unknown, Settings(), Mode.HOLD) == []
    assert [alarm.action for alarm in watch.check(0.06, unknown, Settings(), Mode.HOLD)] == [None, 3]


def test_the_pilot_may_go_on_after_a_battery_alarm_until_the_battery_is_critical():
    watch = BatteryWatch()
    (alarm,) = watch.check(0.3, Reserve(5000.0, 4500.0, 500.0), Settings(), Mode.MISSION)
    assert alarm.action == 2
    assert watch.check(0.29, Reserve(4900.0, 4500.0, 500.0), Settings(), Mode.MISSION) == []
    assert watch.check(0.2, Reserve(4400.0, 4500.0, 500.0), Settings(), Mode.MISSION) == []
    assert watch.check(0.2, Reserve(4400.0, 4500.0, 500.0), Settings(), Mode.RTL)[0].action == 3
