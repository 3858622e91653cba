"""The mode FLIGHT_PLAN: starting, arming, stopping, what the operator sees and asks, and the failsafes that end it."""

import math

import pytest

from protocol.flight_plans import FlightPlanError, load_flight_plan
from protocol.flight_plans.flight_plan import EnuPoint
from protocol.flight_plans.plan_check import check_flown
from protocol.frames import Geodetic
from protocol.names import Mode
from sitl.autopilot.flight_plan.aims import AimKind, WaypointMoved
from sitl.autopilot.manual import Sticks
from sitl.autopilot.settings import Settings
from tests.support.plans import VOLIERE, plan_of
from tests.support.vehicle.fake_station import make_aircraft
from tests.support.vehicle.planned_flight import PlannedFlight

FOUR = (
    '<block name="up"><exception cond="GetPosHeight() @GT 1.5" deroute="hold"/><call_once fun="NavResurrect()"/>'
    '<call_once fun="NavSetWaypointHere(WP_A)"/><stay wp="A" vmode="climb" climb="1"/></block>'
    '<block name="hold" strip_button="Hold" key="h" group="g" strip_icon="i.png" description="d"><stay wp="B"/></block>'
    '<block name="cut"><call_once fun="NavKillThrottle()"/><stay wp="B"/></block>'
    '<block name="fish"><call fun="nav_fish()"/></block>'
)
VARIABLES = (
    '<variables><variable var="gain" init="2" min="1" max="3" step="0.5" unit="m" shortname="g"/>'
    '<variable var="n" type="int"/></variables>'
)


@pytest.fixture(scope="module")
def plan():
    return plan_of('<block name="wait"><while cond="TRUE"/></block>' + FOUR, VARIABLES)


def flight(plan, **options):
    return PlannedFlight(plan, **options)


@pytest.fixture
def hovering(plan):
    flown = flight(plan)
    flown.go_to_block("up")
    flown.wait_for_block("hold", 10)
    flown.advance(1.0)
    return flown


def test_without_a_plan_nothing_is_started():
    autopilot = make_aircraft().autopilot
    assert not autopilot.set_mode(Mode.FLIGHT_PLAN).accepted
    assert autopilot.mode is Mode.HOLD
    requests = autopilot.flight_plan
    for answer in (requests.jump_to_block("a"), requests.set_variable("n", 1.0)):
        assert "no flight plan is loaded" in answer.text
    assert "no flight plan" in requests.move_waypoint("A", EnuPoint(0.0, 0.0, 0.0)).text
    assert (requests.blocks(), requests.waypoints(), requests.variables()) == ((), (), ())
    assert requests.status() is None
    assert requests.present_leg() is None


def test_a_plan_that_is_refused_is_not_loaded():
    autopilot = make_aircraft().autopilot
    bad = plan_of('<block name="a"/>', '<variables><variable var="v" init="sonar"/></variables>')
    with pytest.raises(FlightPlanError, match="sonar"):
        autopilot.flight_plan.load(check_flown(bad))
    assert autopilot.flight_plan.executor is None


def test_the_plan_waits_on_the_ground_until_it_is_told_to_fly(plan):
    flown = flight(plan)
    flown.advance(2.0)
    assert (flown.block, flown.autopilot.armed, flown.autopilot.flying) == ("wait", False, False)
    flown.go_to_block("hold")
    flown.advance(1.0)
    assert not flown.autopilot.flying  # nobody has armed it
    assert flown.autopilot.arming.arm().accepted
    flown.advance(3.0)
    assert flown.autopilot.flying
    assert flown.p[2] > 1.0


def test_arming_is_refused_as_ever(plan):
    flown = flight(plan, settings=Settings(link_action=2))
    flown.silence(99.0)
    flown.go_to_block("up")
    flown.advance(1.0)
    assert not flown.autopilot.armed
    assert any("Arming refused" in text for text in flown.notices)


def test_motors_stopped_by_the_plan_in_the_air_end_the_flight(hovering):
    hovering.go_to_block("cut")
    hovering.advance(0.2)
    assert hovering.autopilot.terminated == "Stopped by the flight plan"
    assert hovering.autopilot.mode is Mode.HOLD


def test_a_failsafe_ends_the_mode_and_the_plan_goes_on_where_it_was_left(plan):
    flown = flight(plan, settings=Settings(link_action=1))
    flown.go_to_block("up")
    flown.wait_for_block("hold", 10)
    flown.silence(20.0)
    flown.advance(1.0)
    assert flown.autopilot.mode is Mode.HOLD
    before = len(flown.events)
    flown.silence(0.0)
    flown.advance(1.0)
    assert len(flown.events) == before
    assert flown.autopilot.set_mode(Mode.FLIGHT_PLAN).accepted
    flown.advance(2.0)
    assert flown.block == "hold"


def test_a_plan_that_was_not_begun_waits_in_the_air_for_a_block(plan):
    kills = plan_of('<block name="off"><call_once fun="NavKillThrottle()"/><while cond="1"/></block>' + FOUR)
    aircraft = make_aircraft(up=10.0, origin=Geodetic(43.5641, 1.4829, 100.0))
    requests = aircraft.autopilot.flight_plan
    requests.load(check_flown(kills))
    assert aircraft.autopilot.set_mode(Mode.FLIGHT_PLAN).accepted
    aircraft.advance(1000)
    assert aircraft.autopilot.armed
    assert aircraft.autopilot.view.p[2] == pytest.approx(10.0, abs=0.3)
    assert any("choose a block" in notice.text for notice in aircraft.autopilot.notices())
    assert requests.jump_to_block("hold").accepted
    aircraft.advance(4000)
    assert aircraft.autopilot.view.p == pytest.approx((1.0, 2.0, 3.0), abs=0.5)  # B, north and west


def test_motors_stopped_by_force_in_the_air_end_the_mode(hovering):
    assert hovering.autopilot.arming.disarm(force=True).accepted
    assert hovering.autopilot.mode is Mode.HOLD


def test_a_radio_is_lost_after_it_was_there():
    plan = plan_of(
        '<block name="a"><exception cond="RadioControlIsLost()" deroute="b"/><stay wp="A"/></block><block name="b"/>'
    )
    flown = flight(plan)
    flown.advance(2.0)
    assert flown.block == "a"
    flown.autopilot.manual.take_sticks(Sticks())
    flown.advance(0.3)
    assert flown.block == "a"
    flown.advance(0.5)
    assert flown.fired == [("a", "b")]


def test_sticks_move_the_vehicle_in_a_stage_xyz():
    flown = flight(plan_of('<block name="a"><xyz radius="5"/></block>'), up=2.0)
    for _ in range(20):
        flown.autopilot.manual.take_sticks(Sticks(right=0.5, up=0.2))
        flown.advance(0.1)
    x, y, z = flown.p
    assert 1.0 < x < 4.0  # the heading is north
    assert abs(y) < 0.5
    assert z > 2.2
    flown.advance(4.0)
    assert flown.p[0] < 5.0
    assert math.dist(flown.positions[-1], flown.positions[-50]) < 0.5


def test_another_mode_takes_over_at_once(hovering):
    assert hovering.autopilot.guided.land().accepted
    hovering.advance_until(lambda: not hovering.autopilot.armed, 20)
    assert hovering.autopilot.mode is Mode.HOLD


def test_what_the_operator_sees(hovering):
    requests = hovering.plan
    buttons = requests.blocks()
    assert [button.name for button in buttons] == ["wait", "up", "hold", "cut", "fish", "HOME"]
    assert buttons[2][2:7] == ("Hold", "i.png", "h", "g", "d")
    assert "nav_fish()" in buttons[4].locked
    assert not any(button.locked for button in (*buttons[:4], buttons[5]))
    status = requests.status()
    assert (status.block, status.block_name, status.stage) == (2, "hold", 0)
    assert status.stage_text == "stay wp=B"
    assert status.block_time == pytest.approx(1.0, abs=0.2)
    assert status.flight_time > 1.0
    assert status.aim is AimKind.POINT
    points = {point.name: point for point in requests.waypoints()}
    assert points["B"].position == (-2.0, 1.0, 3.0)
    assert points["B"].place.alt == pytest.approx(103.0)
    leg = requests.present_leg()
    assert (leg.kind, leg.name) == (AimKind.POINT, "B")
    assert leg.end == points["B"].place
    assert [(v.name, v.label, v.value, v.low, v.high, v.step, v.unit) for v in requests.variables()] == [
        ("gain", "g", 2.0, 1.0, 3.0, 0.5, "m"),
        ("n", "n", 0.0, None, None, None, None),
    ]
    assert hovering.fired == [("up", "hold")]


def test_blocks_that_cannot_be_entered(hovering):
    for block, words in (
        ("fish", "nav_fish() is not flown"),
        ("nowhere", "no block 'nowhere'"),
        (99, "no block 99"),
        (-1, "no block"),
    ):
        answer = hovering.plan.jump_to_block(block)
        assert not answer.accepted
        assert words in answer.text
    assert hovering.block == "hold"
    assert hovering.plan.jump_to_block(1).accepted


def test_waypoints_are_moved_in_flight(hovering):
    requests = hovering.plan
    assert requests.move_waypoint("B", EnuPoint(2.0, 2.0, 2.5)).accepted
    hovering.advance(5.0)
    assert hovering.p == pytest.approx((2.0, 2.0, 2.5), abs=0.4)
    assert any(isinstance(event, WaypointMoved) and event.name == "B" for event in hovering.events)
    for name, position, words in (
        ("Z", (0.0, 0.0, 2.0), "no waypoint 'Z'"),
        ("B", (50.0, 0.0, 2.0), "outside the arena"),
        ("B", (0.0, 0.0, 99.0), "outside the arena"),
        ("B", (math.nan, 0.0, 2.0), "not a number"),
    ):
        answer = requests.move_waypoint(name, EnuPoint(*position))
        assert not answer.accepted
        assert words in answer.text


def test_no_waypoint_is_moved_farther_than_the_plan_allows():
    near = plan_of('<block name="a"/>')
    flown = flight(near, arena="open")
    assert "farther than 100 m from HOME" in flown.plan.move_waypoint("A", EnuPoint(90.0, 90.0, 2.0)).text


def test_variables_are_set_within_their_limits(plan):
    requests = flight(plan).plan
    assert requests.set_variable("gain", 2.5).accepted
    assert requests.set_variable("n", 7.0).accepted
    assert [variable.value for variable in requests.variables()] == [2.5, 7.0]
    for name, value, words in (
        ("gain", 3.5, "3.5 is not within 1..3"),
        ("gain", math.inf, "not a finite number"),
        ("gain", 2e9, "beyond 1e+09"),
        ("gone", 1.0, "no variable 'gone'"),
    ):
        answer = requests.set_variable(name, value)
        assert not answer.accepted
        assert words in answer.text


def test_a_target_outside_the_arena_is_said_once_and_held_at():
    plan = plan_of('<block name="a"><go wp="A" wp_qdr="0" wp_dist="50"/></block>')
    flown = flight(plan, up=2.0)
    flown.advance(3.0)
    assert [text for text in flown.notices if "outside the arena" in text] == [
        "Flight plan holds: 54.0 m north is outside the arena 'voliere' (limit 3.8 m)"
    ]
    assert flown.p == pytest.approx((0.0, 0.0, 2.0), abs=0.5)


def test_another_plan_replaces_the_one_that_is_flown(hovering):
    hovering.plan.load(check_flown(load_flight_plan(VOLIERE)))
    assert hovering.autopilot.mode is Mode.HOLD
    assert hovering.plan.blocks()[0].name == "Engine off"
