"""MAV_CMD_DO_VTOL_TRANSITION as a long running command: its progress, each of its ends, its cancelling."""

import itertools
import math

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, LegMode, Regime
from protocol.names import Mode
from sitl.autopilot.guided import TIME_LIMIT, Transition, is_reached
from sitl.autopilot.settings import Settings
from sitl.control.reference import along, hover_at, leg
from sitl.guidance.circles import FlyCircle
from sitl.guidance.view import VehicleView
from sitl.simulation.situation import regime
from sitl.vehicle.aircraft import HOVERING, is_forward
from sitl.vehicle.parameters import WorldSettings
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.fake_station import Bench
from tests.support.vehicle.mission_items import item, waypoint

TRANSITION = mavlink.MAV_CMD_DO_VTOL_TRANSITION
FORWARD, HOVER = mavlink.MAV_VTOL_STATE_FW, mavlink.MAV_VTOL_STATE_MC
ACCEPTED, FAILED, CANCELLED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_FAILED, mavlink.MAV_RESULT_CANCELLED
REJECTED, IN_PROGRESS = mavlink.MAV_RESULT_TEMPORARILY_REJECTED, mavlink.MAV_RESULT_IN_PROGRESS
TRANSITIONS_HIGH = 40.0
HERE = hover_at((0.0, 0.0, TRANSITIONS_HIGH), 0.0, 3.0)
LEG = along(HERE, leg(HERE.position, (500.0, 0.0, TRANSITIONS_HIGH), 15.0), 0.0)


def view(law=Law.HOVER_LINEAR, time=0.0, tilt=0.0, speed=0.0, forward=None):
    forward = law.regime not in HOVERING if forward is None else forward
    return VehicleView(
        time, HERE.position, (speed, 0.0, 0.0), 0.0, tilt, landed=False, battery_remaining=1.0, forward=forward,
        law=law, regime=law.regime,
    )  # fmt: skip


# Progress


@pytest.mark.parametrize(
    ("wanted", "law", "reference", "reached"),
    [
        (LegMode.FORWARD, Law.HOVER_LINEAR, LEG, False),
        (LegMode.FORWARD, Law.TO_FORWARD, LEG, False),
        (LegMode.FORWARD, Law.FORWARD_LINE_OF_SIGHT, LEG, True),
        (LegMode.FORWARD, Law.FORWARD_LINEAR, LEG, True),
        (LegMode.FORWARD, Law.TO_HOVER, HERE, False),
        (LegMode.HOVER, Law.FORWARD_LINEAR, HERE, False),
        (LegMode.HOVER, Law.TO_HOVER, HERE, False),
        (LegMode.HOVER, Law.HOVER_ZERO_MOMENT, HERE, True),
        (LegMode.HOVER, Law.ALIGN, LEG, False),  # upright, but about to make a front transition
        (LegMode.HOVER, Law.FAILSAFE, HERE, False),
    ],
)
def test_hover_and_forward_flight_are_reached_under_their_own_laws(wanted, law, reference, reached):
    assert is_reached(wanted, view(law), reference) is reached


def test_progress_grows_with_tilt_and_airspeed_and_never_falls():
    transition, percents = Transition(LegMode.FORWARD, view()), []
    for tilt, speed in ((0.0, 0.0), (0.3, 2.0), (0.1, 1.0), (1.0, 7.0), (1.5, 20.0)):
        transition.update(view(Law.TO_FORWARD, tilt=tilt, speed=speed), LEG)
        percents.append(transition.percent)
    assert percents[0] == 0
    assert percents == sorted(percents)
    assert percents[1] == percents[2] < percents[3] < percents[4] == 99
    assert transition.end is None


@pytest.mark.parametrize(
    ("wanted", "seen", "reference", "result", "word"),
    [
        (LegMode.FORWARD, view(Law.FORWARD_LINEAR), LEG, ACCEPTED, ""),
        (LegMode.FORWARD, view(Law.FAILSAFE), LEG, FAILED, "fall"),
        (LegMode.HOVER, view(Law.FAILSAFE), HERE, FAILED, "fall"),
        (LegMode.FORWARD, view(Law.ALIGN, time=TIME_LIMIT + 1.0), LEG, FAILED, "not done in 60 s"),
        (LegMode.FORWARD, view(), HERE, ACCEPTED, "hovered"),  # a mission's leg that is better hovered
        (LegMode.HOVER, view(Law.HOVER_LINEAR), HERE, ACCEPTED, ""),
    ],
)
def test_each_end_has_its_result_and_is_final(wanted, seen, reference, result, word):
    transition = Transition(wanted, view(Law.FORWARD_LINEAR if wanted is LegMode.HOVER else Law.HOVER_LINEAR))
    transition.update(seen, reference)
    assert transition.end.result == result
    assert word in transition.end.text
    transition.cancel()
    assert transition.end.result == result


# In the air


def test_the_autopilot_holds_after_a_failed_transition():
    flight = Flight()
    flight.autopilot.transitions.begin(LegMode.FORWARD)
    flight.fly(1.0)
    flight.autopilot.transitions.under_way.fail("the test says so")
    flight.fly(6.0)
    assert not is_forward(flight.vehicle)
    assert any("the test says so" in text for text in flight.texts)
    assert flight.autopilot.mode is Mode.HOLD


def test_a_mission_goes_on_as_before_when_its_transition_is_cancelled():
    flight = Flight()
    flight.autopilot.arming.arm()
    flight.autopilot.missions.load((waypoint(20.0, 0.0, 25.0), waypoint(20.0, 200.0, 25.0)))
    flight.autopilot.missions.start()
    flight.fly(1.0)
    assert flight.autopilot.transitions.begin(LegMode.HOVER).result == ACCEPTED
    assert flight.autopilot.transitions.begin(LegMode.FORWARD).accepted
    flight.autopilot.transitions.cancel()
    flight.fly_until(lambda: flight.autopilot.mission.current == 1, 30.0)
    flight.fly(10.0)
    assert flight.autopilot.mode is Mode.MISSION
    assert not flight.flown_forward.any()


def test_a_mission_reports_when_the_current_item_is_hovered_all_the_same():
    flight = Flight()
    flight.autopilot.arming.arm()
    flight.autopilot.missions.load((waypoint(5.0, 0.0, 25.0), waypoint(5.0, 5.0, 25.0)))
    flight.autopilot.missions.start()
    flight.fly(0.2)
    flight.autopilot.transitions.begin(LegMode.FORWARD)
    flight.fly(0.2)
    assert flight.autopilot.transitions.under_way is None
    assert "This item is hovered" in "".join(flight.texts)


# On the wire


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path, up=TRANSITIONS_HIGH)


@pytest.fixture
def station(bench):
    station = bench.station()
    bench.advance(0.5)
    return station


def acks(station, command=TRANSITION):
    return [m for m in station.heard if m.get_type() == "COMMAND_ACK" and m.command == command]


def final(station):
    ends = [m.result for m in acks(station) if m.result != IN_PROGRESS]
    assert len(ends) <= 1
    return ends[0] if ends else None


def cancel(command=TRANSITION):
    return mavlink.MAVLink_command_cancel_message(1, 1, command)


def test_progress_is_reported_to_the_end_of_a_front_and_a_back_transition(bench, station):
    assert station.command(TRANSITION, FORWARD) == IN_PROGRESS
    times = [bench.now]
    while final(station) is None:
        count = len(acks(station))
        bench.advance(0.02)
        times += [bench.now] * (len(acks(station)) - count)
        assert bench.now < 30.0
    assert final(station) == ACCEPTED
    assert max(b - a for a, b in itertools.pairwise(times)) <= 0.5
    assert regime(bench.aircraft.vehicle) is Regime.FORWARD
    percents = [m.progress for m in acks(station)[:-1]]
    assert percents == sorted(percents)
    assert percents[0] < 20
    assert 60 < percents[-1] < 100
    station.heard.clear()
    assert station.command(TRANSITION, FORWARD) == ACCEPTED  # it is in forward flight
    station.heard.clear()
    assert station.command(TRANSITION, HOVER) == IN_PROGRESS
    bench.advance_until(lambda: final(station) is not None, 30.0)
    assert final(station) == ACCEPTED
    assert not bench.aircraft.view().forward
    station.heard.clear()
    assert station.command(TRANSITION, HOVER) == ACCEPTED


@pytest.mark.long
@pytest.mark.parametrize(("wind", "seed"), [(6.0, 2), (8.0, 3)])
def test_in_wind_the_state_is_that_of_the_answer_and_stays_so_until_the_law_ends(tmp_path, wind, seed):
    world = WorldSettings(wind_speed=wind, gusts=wind / 8.0, battery=1e6)
    bench = Bench(tmp_path, up=TRANSITIONS_HIGH, seed=seed, world_settings=world)
    bench.aircraft.configure(bench.aircraft.configuration.replaced({"DRK_CONTROLLER": 0}))
    station = bench.station()
    for wanted in (FORWARD, HOVER):
        station.heard.clear()
        station.command(TRANSITION, wanted)
        bench.advance_until(lambda: final(station) is not None, 60.0)
        assert final(station) == ACCEPTED
        answered = next(
            i for i, m in enumerate(station.heard) if m.get_type() == "COMMAND_ACK" and m.result == ACCEPTED
        )
        told = [m.vtol_state for m in station.heard[:answered] if m.get_type() == "EXTENDED_SYS_STATE"]
        assert told[-1] == wanted
    assert bench.aircraft.vehicle.law is Law.TO_HOVER  # which waits for the wind to drop
    station.heard.clear()
    bench.advance(20.0)
    assert {m.vtol_state for m in station.all("EXTENDED_SYS_STATE")} == {HOVER}


@pytest.mark.parametrize("after", [0.2, 2.0])
def test_a_cancelled_front_transition_holds_upright(bench, station, after):
    station.command(TRANSITION, FORWARD)
    bench.advance(after)
    station.send(cancel())
    assert final(station) == CANCELLED
    assert "cancelled" in station.texts()
    bench.advance(12.0)
    assert final(station) == CANCELLED
    assert not is_forward(bench.aircraft.vehicle)
    assert station.flight_mode is Mode.HOLD


def test_a_cancelled_back_transition_holds_upright(bench, station):
    station.command(TRANSITION, FORWARD)
    bench.advance_until(lambda: final(station) is not None, 30.0)
    station.heard.clear()
    station.command(TRANSITION, HOVER)
    bench.advance(0.5)
    station.send(cancel())
    assert final(station) == CANCELLED
    bench.advance(15.0)
    assert not is_forward(bench.aircraft.vehicle)


def test_another_station_cannot_cancel_it_or_begin_another(bench, station):
    station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    other = bench.station(245, "other")
    station.command(TRANSITION, FORWARD)
    other.send(cancel())
    assert final(station) is None
    assert station.command(TRANSITION, HOVER) == REJECTED
    assert "a long command is under way" in station.texts()
    assert bench.autopilot.transitions.under_way.wanted is LegMode.FORWARD


@pytest.mark.parametrize(
    ("order", "word"),
    [
        (lambda s: s.command(mavlink.MAV_CMD_NAV_LAND), "left for LAND, as asked"),
        (lambda s: s.mode(Mode.HOLD), "left for HOLD, as asked"),
        (lambda s: s.command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH), "left for RTL, as asked"),
        (lambda s: s.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196), "the flight is over"),
    ],
)
def test_another_order_is_obeyed_at_once_and_ends_the_transition(bench, station, order, word):
    station.command(TRANSITION, FORWARD)
    bench.advance(0.2)
    assert order(station) == ACCEPTED
    assert final(station) == FAILED
    assert word in station.texts()
    bench.advance(1.0)
    assert final(station) == FAILED


def test_without_room_to_circle_it_is_refused_with_a_reason(bench, station):
    bench.aircraft.configure(bench.aircraft.configuration.replaced({"GF_MAX_HOR_DIST": 60.0}))
    assert station.command(TRANSITION, FORWARD) == REJECTED
    assert "no room to circle" in station.texts()
    assert bench.autopilot.transitions.under_way is None


@pytest.mark.parametrize(("height", "answer"), [(3.0, IN_PROGRESS), (2.9, IN_PROGRESS), (2.0, REJECTED)])
def test_a_hover_at_the_least_height_is_high_enough_and_a_refusal_tells_what_is_needed(tmp_path, height, answer):
    peer = Bench(tmp_path, up=height).station()
    assert peer.command(TRANSITION, FORWARD) == answer
    assert ("too low at 2.0 m, it needs 3 m" in peer.texts()) == (answer == REJECTED)


def test_a_repeated_request_is_answered_with_the_progress(bench, station):
    station.command(TRANSITION, FORWARD)
    bench.advance(2.0)
    station.heard.clear()
    station.send(mavlink.MAVLink_command_long_message(1, 1, TRANSITION, 1, FORWARD, *[math.nan] * 6))
    assert [m.result for m in acks(station)] == [IN_PROGRESS]
    assert acks(station)[0].progress > 0


def test_a_failsafe_ends_the_transition_with_a_reason(bench, station):
    station.command(TRANSITION, FORWARD)
    bench.advance(0.2)
    bench.aircraft.configure(bench.aircraft.configuration.replaced({"SIM_BAT_ENERGY": 100.0}))
    bench.advance_until(lambda: final(station) is not None, 5.0)
    assert final(station) == FAILED
    assert "left for" in station.texts()


# A change of height while the vehicle circles keeps it circling, forward, at the new height.


CENTRE, RADIUS = (60.0, 0.0, HIGH), 40.0


def orbit(flight):
    assert flight.autopilot.guided.circle(CENTRE, RADIUS).accepted


def circle_after_a_front_transition(flight):
    flight.autopilot.transitions.begin(LegMode.FORWARD)


def loiter_in_a_mission(flight):
    flight.autopilot.missions.load((item(17, *CENTRE, params=(0.0, 0.0, RADIUS, math.nan)),))
    assert flight.autopilot.missions.start().accepted


def heights_after(flight, seconds):
    """Fly on in forward flight; returns the heights flown."""
    first = len(flight.p)

    def stays_forward():
        assert is_forward(flight.vehicle)

    flight.fly(seconds, stays_forward)
    return flight.p[first:, 2]


@pytest.mark.long(after=1)
@pytest.mark.parametrize("begin", [orbit, circle_after_a_front_transition, loiter_in_a_mission])
def test_the_circle_is_flown_on_at_the_new_height(begin):
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD))
    begin(flight)
    flight.fly(14.0)
    before = flight.autopilot.reference.path
    assert flight.autopilot.guided.change_height(HIGH + 12.0).accepted
    assert flight.autopilot.mode is Mode.HOLD
    heights = heights_after(flight, 14.0)
    assert heights.min() > HIGH - 3.0
    assert heights[-50:] == pytest.approx(HIGH + 12.0, abs=2.0)
    path = flight.autopilot.reference.path
    assert (path.start[:2], path.radius, path.airspeed) == (before.start[:2], before.radius, before.airspeed)
    away = math.dist(flight.p[-1][:2], path.start[:2])
    assert away == pytest.approx(abs(path.radius), abs=6.0)


def test_it_sinks_as_well_and_a_height_that_cannot_be_circled_is_refused():
    flight = Flight()
    orbit(flight)
    flight.fly(12.0)
    guided = flight.autopilot.guided
    circle = flight.autopilot.manoeuvre
    assert "too low to circle" in guided.change_height(1.0).text
    assert "Height denied" in guided.change_height(1e5).text
    assert "Height denied" in guided.change_height(math.nan).text
    assert "in forward flight" in guided.change_height(HIGH, speed=2.0).text
    assert flight.autopilot.manoeuvre is circle
    assert guided.change_height(HIGH - 10.0).accepted
    heights = heights_after(flight, 14.0)
    assert heights.min() > HIGH - 13.0
    assert heights[-50:] == pytest.approx(HIGH - 10.0, abs=2.0)


def test_a_heading_is_turned_to_in_the_hover():
    flight = Flight()
    orbit(flight)
    flight.fly(1.0)
    assert flight.autopilot.guided.change_height(HIGH, heading=1.0).accepted
    assert not isinstance(flight.autopilot.manoeuvre, FlyCircle)


# A change of speed reaches the way of flying that is under way, and is refused for the other.


AIR, GROUND = mavlink.SPEED_TYPE_AIRSPEED, mavlink.SPEED_TYPE_GROUNDSPEED
CLIMB, DESCENT = mavlink.SPEED_TYPE_CLIMB_SPEED, mavlink.SPEED_TYPE_DESCENT_SPEED


@pytest.fixture
def forward():
    """On a leg flown forward, to hover at its end."""
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD))
    assert flight.autopilot.guided.go_to((120.0, 0.0, HIGH)).accepted
    flight.fly(0.1)
    assert flight.autopilot.reference.forward
    return flight


def test_on_the_leg_the_airspeed_is_changed(forward):
    guided = forward.autopilot.guided
    assert "Hover speed 2 m/s refused: in forward flight" in guided.change_speed(GROUND, 2.0).text
    assert guided.change_speed(AIR, 17.0).accepted
    forward.fly(0.1)
    assert forward.autopilot.reference.path.airspeed == 17.0


def test_hovering_at_its_end_the_speed_of_the_hover_is_changed(forward):
    guided = forward.autopilot.guided
    forward.fly_until(lambda: not forward.autopilot.reference.forward, 60.0)
    assert "Speed 17 m/s refused: not in forward flight" in guided.change_speed(GROUND, 17.0).text
    assert guided.change_speed(GROUND, 1.5).accepted
    forward.fly(0.1)
    assert forward.autopilot.reference.speed == 1.5
    assert not forward.autopilot.reference.forward


def test_over_the_ground_the_airspeed_is_that_which_the_wind_leaves():
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD), wind_speed=4.0, wind_from=0.0)
    flight.fly(5.0)  # the wind is estimated
    guided = flight.autopilot.guided
    assert guided.go_to((300.0, 0.0, HIGH)).accepted
    flight.fly(12.0)
    assert guided.change_speed(AIR, 12.0).accepted
    assert flight.autopilot.manoeuvre.reference.path.airspeed == 12.0
    assert guided.change_speed(GROUND, 12.0).accepted
    assert flight.autopilot.manoeuvre.reference.path.airspeed == pytest.approx(16.0, abs=1.0)
    assert "needs an airspeed of" in guided.change_speed(GROUND, 21.0).text
    flight.fly(4.0)
    assert flight.v[-1][0] == pytest.approx(12.0, abs=1.0)


def test_in_a_mission_a_ground_speed_is_flown_against_the_wind():
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD), wind_speed=4.0, wind_from=0.0)
    speed = item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(GROUND, 12.0, -1.0, 0.0))
    flight.autopilot.missions.load((speed, waypoint(300, 0, HIGH)))
    flight.fly(5.0)
    flight.autopilot.missions.start()
    flight.fly(14.0)
    assert flight.v[-1][0] == pytest.approx(12.0, abs=1.0)
    flight.autopilot.guided.change_speed(AIR, 12.0)
    flight.fly(4.0)
    assert flight.v[-1][0] == pytest.approx(8.0, abs=1.0)


def test_new_settings_are_flown_at_once_unless_another_speed_was_asked_for(forward):
    def configure(**changed):
        forward.autopilot.configure(forward.autopilot.settings._replace(**changed))
        forward.fly(0.1)
        return forward.autopilot.reference

    assert configure(airspeed=17.0).path.airspeed == 17.0
    assert configure(hover_speed=2.0).speed == 2.0
    assert forward.autopilot.guided.change_speed(AIR, 12.0).accepted
    assert configure(airspeed=15.0).path.airspeed == 12.0
    assert forward.autopilot.guided.go_to((10.0, 0.0, HIGH), speed=1.0).accepted
    assert configure(hover_speed=3.0).speed == 1.0
    assert configure(hover_speed=0.5).speed == 0.5


def test_a_return_flies_at_the_new_airspeed():
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD))
    assert flight.autopilot.guided.go_to((200.0, 0.0, HIGH)).accepted
    flight.fly(12.0)
    assert flight.autopilot.guided.return_to_launch().accepted
    flight.fly(0.1)
    assert flight.autopilot.guided.change_speed(AIR, 12.0).accepted
    flight.fly(0.1)
    assert flight.autopilot.reference.path.airspeed == 12.0


@pytest.mark.parametrize(("kind", "up", "rate"), [(CLIMB, 6.0, 0.5), (DESCENT, -6.0, -0.5)])
def test_a_vertical_speed_holds_on_a_hovered_leg(kind, up, rate):
    flight = Flight(settings=Settings(leg_mode=LegMode.HOVER))
    guided = flight.autopilot.guided
    assert guided.go_to((12.0, 0.0, HIGH + up)).accepted
    assert guided.change_speed(kind, abs(rate)).accepted
    flight.fly(8.0)
    assert flight.v[200:, 2] == pytest.approx(rate, abs=0.25)
    assert guided.change_speed(kind, -2.0).accepted
    flight.fly(5.0)
    assert flight.p[-1][2] == pytest.approx(HIGH + up, abs=0.3)
