"""Blocks, stages, loops and exceptions go on as Paparazzi's do."""

import math

import pytest

from protocol.flight_plans import load_flight_plan
from protocol.flight_plans.flight_plan import EnuPoint
from protocol.flight_plans.plan_names import parse_name_mapping
from sitl.autopilot.flight_plan.aims import AimKind, BlockEntered
from sitl.autopilot.flight_plan.plan_state import MotorRequest
from tests.support.plans import OUR_PLANS
from tests.support.vehicle.plan_ticks import PlanTicks

COUNTERS = (
    '<variables><variable var="n" type="int" init="0"/><variable var="m" init="1/2"/>'
    '<variable var="h" init="1/2." min="0" max="1" step="0.1"/></variables>'
)
REST = '<block name="rest"><stay wp="A"/></block>'


def test_what_takes_no_time_is_done_in_one_tick_up_to_the_first_movement():
    ticks = PlanTicks(
        '<block name="a"><set var="n" value="n+1"/><call_once fun="NavSetWaypointHere(WP_A)"/>'
        '<set var="n" value="n+1"/>'
        '<stay wp="A"/><set var="n" value="9"/></block>',
        COUNTERS,
    ).tick()
    assert (ticks.variable("n"), ticks.stage) == (2, "stay")
    assert (ticks.aim.kind, ticks.aim.name) == (AimKind.POINT, "A")
    ticks.seconds(30)
    assert (ticks.variable("n"), ticks.block) == (2, "a")


def test_first_values_are_those_of_c():
    ticks = PlanTicks(REST, COUNTERS)
    assert (ticks.variable("n"), ticks.variable("m"), ticks.variable("h")) == (0, 0.0, 0.5)


def test_behind_the_last_stage_is_the_next_block_and_behind_the_last_block_home():
    ticks = PlanTicks('<block name="a"/><block name="b"><set var="n" value="1"/></block>', COUNTERS).tick(5)
    assert ticks.entered == ["a", "b", "HOME"]
    assert ticks.aim.end == (0.0, 0.0, 1.0)  # at the security height
    ticks.seconds(5)
    assert ticks.block == "HOME"


def test_until_is_asked_every_tick_and_times_count_whole_seconds():
    ticks = PlanTicks(
        '<block name="a"><stay wp="A" until="stage_time > 2"/><stay wp="B" until="stage_time == 1"/>'
        '<stay wp="C" until="block_time > 5"/></block>' + REST
    )
    ticks.seconds(2.95)
    assert ticks.aim.name == "A"
    ticks.seconds(0.2)
    assert ticks.aim.name == "B"
    ticks.seconds(1.1)
    assert ticks.aim.name == "C"
    assert ticks.block == "a"
    ticks.seconds(2.0)
    assert ticks.block == "rest"
    assert ticks.executor.flow.block_time < 0.3


def test_loops():
    ticks = PlanTicks(
        '<block name="a"><for var="i" from="1" to="3"><set var="n" value="10*n + $i"/></for>'
        '<while cond="LessThan(n, 130)"><set var="n" value="n + 1"/></while></block>' + REST,
        COUNTERS,
    ).tick(40)
    assert (ticks.variable("n"), ticks.block) == (130, "rest")


def test_nested_loops_and_a_while_without_stages_or_condition():
    inner = '<for var="j" from="0" to="1"><set var="n" value="n + 1"/></for>'
    ticks = PlanTicks(
        f'<block name="a"><for var="i" from="0" to="2">{inner}</for><for var="i" from="2" to="1">{inner}</for>'
        '<while cond="stage_time @LT 1"/><while/></block>',
        COUNTERS,
    ).tick(60)
    assert (ticks.variable("n"), ticks.block, ticks.stage) == (6, "a", "while")


def test_calls_go_on_while_they_return_true():
    mapping = parse_name_mapping("[functions]\nalways = 1\nnever = 0", "m")
    blocks = (
        '<block name="a"><call fun="never()"/><call fun="always()" until="stage_time @GEQ 1"/>'
        '<call fun="always()" loop="FALSE"/><call_once fun="NavKillThrottle()" break="TRUE"/><stay wp="A"/></block>'
    )
    ticks = PlanTicks(blocks, mapping=mapping).tick(5)
    assert ticks.stage == "call"
    ticks.seconds(1.0)
    assert ticks.stage == "stay"
    assert ticks.executor.take_motor_requests() == [MotorRequest.STOP]


def test_deroute_and_return():
    ticks = PlanTicks(
        '<block name="a"><stay wp="A" until="n == 1"/><stay wp="B" until="n == 2"/><deroute block="b"/></block>'
        '<block name="b"><set var="n" value="n + 1"/><return reset_stage="n == 4"/></block>',
        COUNTERS,
    )
    executor = ticks.tick(2).executor
    executor.names.store("n", 1)
    ticks.tick(2)
    assert ticks.aim.name == "B"
    executor.jump(1)
    ticks.tick(2)
    assert (ticks.variable("n"), ticks.aim.name, ticks.block) == (2, "B", "a")
    ticks.tick()
    assert ticks.block == "b"  # what returned to its stage derouted again
    executor.names.store("n", 3)
    ticks.tick()
    assert (ticks.block, ticks.executor.flow.stage) == ("a", 0)


def test_a_block_tells_what_led_to_it():
    ticks = PlanTicks(
        '<block name="a"><set var="n" value="n + 1"/></block>\n'
        '<block name="b"><stay wp="A" until="n == 2"/>\n<deroute block="c"/></block>'
        '<block name="c"><stay wp="C"/></block>',
        COUNTERS,
    ).tick(2)
    ticks.executor.names.store("n", 2)
    ticks.tick(2).executor.jump(0)
    ticks.tick()
    told = [(event.name, event.cause) for event in ticks.events if isinstance(event, BlockEntered)]
    assert told[:4] == [("a", ""), ("b", "a is over"), ("c", "deroute at the end of b"), ("a", "commanded")]
    assert [event.line > 0 for event in ticks.events if isinstance(event, BlockEntered)][:4] == [
        False,
        False,
        True,
        False,
    ]


def test_exceptions_global_first_in_their_order_and_never_to_the_present_block():
    ticks = PlanTicks(
        '<block name="a" pre_call="n = n + 1"><exception cond="1" deroute="c"/><stay wp="A"/></block>'
        '<block name="b"><stay wp="B"/></block><block name="c"><stay wp="C"/></block>',
        COUNTERS
        + '<exceptions><exception cond="n == 2" deroute="b"/><exception cond="n == 1" deroute="c"/></exceptions>',
    ).tick()
    (fired,) = ticks.fired
    assert (fired.from_block, fired.to_block, fired.line) == ("a", "c", 3)
    assert ticks.variable("n") == 1
    ticks.tick(3)
    assert ticks.block == "c"
    ticks.executor.names.store("n", 2)
    ticks.tick(10)
    assert ticks.block == "b"
    assert [event.to_block for event in ticks.fired] == ["c", "b"]


def test_exceptions_of_a_loop_count_inside_it():
    blocks = (
        '<block name="a"><stay wp="A" until="n == 1"/><while cond="1"><exception cond="n > 0" deroute="rest"/>'
        '<stay wp="B"/></while></block>'
    )
    ticks = PlanTicks(blocks + REST, COUNTERS).tick(3)
    assert ticks.block == "a"
    ticks.executor.names.store("n", 1)
    ticks.tick(4)
    assert ticks.block == "rest"


def test_calls_around_blocks_and_stages():
    ticks = PlanTicks(
        '<block name="a" pre_call="n = n + 1; if (n > 2) m = 1" post_call="h = n">'
        '<stay wp="A" pre_call="nav.radius = nav.radius + 1" post_call="nav.heading = 1"/></block>',
        COUNTERS,
    ).tick(3)
    assert (ticks.variable("n"), ticks.variable("m"), ticks.variable("h")) == (3, 1.0, 3.0)
    assert ticks.executor.names.value("nav.radius") == 40.0 + 3.0
    assert ticks.executor.memory.heading == 1.0


@pytest.mark.parametrize(
    ("attributes", "p", "v", "arrives"),
    [
        ('wp="A"', (2.6, 4.0, 2.0), (0, 0, 0), True),
        ('wp="A"', (2.4, 4.0, 2.0), (0, 0, 0), False),
        ('wp="A"', (3.0, 4.0, 9.0), (0, 0, 0), True),
        ('wp="A" approaching_time="2"', (1.0, 4.0, 2.0), (1.0, 0, 0), True),
        ('wp="A" exceeding_time="2"', (1.0, 4.0, 2.0), (1.0, 0, 0), False),
        ('wp="A" exceeding_time="1"', (4.0, 4.0, 2.0), (1.0, 0, 0), True),
        ('wp="A" approaching_time="CARROT"', (2.6, 4.0, 2.0), (0, 0, 0), True),
        ('wp="A" from="HOME" hmode="route"', (9.0, 5.0, 2.0), (0, 0, 0), True),
        ('wp="A" from="HOME"', (9.0, 5.0, 2.0), (0, 0, 0), True),
        ('wp="A"', (9.0, 5.0, 2.0), (0, 0, 0), False),
        ('wp="A" wp_qdr="90" wp_dist="10"', (13.2, 4.0, 2.0), (0, 0, 0), True),
    ],
)
def test_arrival(attributes, p, v, arrives):
    ticks = PlanTicks(f'<block name="a"><go {attributes}/></block>' + REST)
    ticks.tick()
    assert ticks.block == "a"
    ticks.p, ticks.v = p, v
    ticks.tick(2)
    assert (ticks.block == "rest") is arrives


def test_a_route_begins_where_the_last_leg_ended():
    ticks = PlanTicks('<block name="a"><go wp="A"/><go wp="B" hmode="route" vmode="glide"/></block>' + REST).tick()
    ticks.p = (3.0, 4.0, 2.0)
    ticks.tick(2)
    aim = ticks.aim
    assert (aim.kind, aim.start, aim.end) == (AimKind.LEG, (3.0, 4.0, 2.0), (-2.0, 1.0, 3.0))


def test_a_path_is_a_chain_of_legs():
    ticks = PlanTicks('<block name="a"><path wpts="A,B,C"/></block>' + REST).tick()
    assert (ticks.aim.start[:2], ticks.aim.end[:2], ticks.aim.followers) == ((3, 4), (-2, 1), ((2.0, -2.0, 4.0),))
    ticks.p = (-2.0, 1.0, 2.0)
    ticks.tick(2)
    assert (ticks.aim.start[:2], ticks.aim.end[:2]) == ((-2, 1), (2, -2))


@pytest.mark.parametrize(
    ("attributes", "z", "climb"),
    [
        ("", 3.0, None),
        ('alt="110"', 10.0, None),
        ('height="7"', 7.0, None),
        ('vmode="alt" alt="GetAltRef() + 5"', 5.0, None),
        ('vmode="climb" climb="nav.climb_vspeed"', None, 0.5),
        ('vmode="climb" climb="nav.descend_vspeed"', None, -0.8),
        ('vmode="throttle" throttle="0"', None, -2.0),
        ('vmode="throttle" throttle="0.5"', None, 0.0),
        ('vmode="throttle" throttle="0.6"', None, 0.4),
    ],
)
def test_vertical_modes(attributes, z, climb):
    ticks = PlanTicks(f'<block name="a"><stay wp="B" {attributes}/></block>').tick()
    assert ticks.aim.climb == (None if climb is None else pytest.approx(climb))
    assert z is None or ticks.aim.end.z == pytest.approx(z)


def test_a_vehicle_that_leaves_its_area_goes_home():
    ticks = PlanTicks('<block name="a"><stay wp="A"/></block>').tick()
    ticks.p = (90.0, 50.0, 2.0)
    ticks.tick(3)
    assert ticks.block == "HOME"
    assert "farther than 100 m" in ticks.fired[0].text
    ticks.executor.jump(0)
    ticks.tick(3)
    assert ticks.block == "a"  # who is sent away again is not fetched twice
    ticks.p = (0.0, 0.0, 2.0)
    ticks.tick(2)
    ticks.p = (90.0, 50.0, 2.0)
    ticks.tick(2)
    assert ticks.block == "HOME"


def test_on_the_ground_nobody_leaves_the_area():
    ticks = PlanTicks('<block name="a"><stay wp="A"/></block>')
    ticks.p, ticks.told["landed"] = (90.0, 50.0, 0.1), True
    ticks.tick(3)
    assert ticks.block == "a"


def test_a_locked_block_holds_where_the_vehicle_is_and_global_exceptions_still_count():
    ticks = PlanTicks(
        '<block name="a"><set var="n" value="1"/></block>'
        '<block name="b"><call_once fun="nav_fish()"/><stay wp="B"/></block>' + REST,
        COUNTERS + '<exceptions><exception cond="n == 2" deroute="rest"/></exceptions>',
    )
    ticks.p = (1.0, 1.0, 2.5)
    ticks.seconds(3)
    assert (ticks.block, ticks.aim.end) == ("b", (1.0, 1.0, 2.5))
    assert ticks.remarks == ["Block b holds: nav_fish() is not flown"]
    ticks.executor.names.store("n", 2)
    ticks.tick(2)
    assert ticks.block == "rest"


def test_what_has_no_value_is_said_once_and_counts_as_false():
    ticks = PlanTicks('<block name="a"><stay wp="A" until="1 / n"/></block>' + REST, COUNTERS).seconds(2)
    assert ticks.block == "a"
    assert ticks.remarks == ["Cannot evaluate: t.xml:3:47: division by zero"]


def test_a_place_beyond_all_numbers_is_not_flown():
    ticks = PlanTicks('<block name="a"><go wp="A" wp_qdr="0" wp_dist="1e300"/></block>').tick(3)
    assert ticks.aim.kind is AimKind.POINT
    assert "beyond all numbers" in ticks.remarks[0]


def test_a_waypoint_by_the_number_of_a_loop():
    blocks = (
        '<block name="a"><for var="i" from="2" to="5"><stay wp="$i" until="stage_time @GEQ 1"/></for></block>' + REST
    )
    ticks = PlanTicks(blocks)
    names = []
    for _ in range(90):
        ticks.tick()
        names.append(ticks.aim.name)
    assert list(dict.fromkeys(filter(None, names))) == ["A", "B", "C", "unknown"]
    assert "there is no waypoint $i" in ticks.remarks[0]


def test_a_procedure_is_flown_under_its_names():
    ticks = PlanTicks("", plan=load_flight_plan(OUR_PLANS / "with_procedure.xml")).tick(2)
    ticks.executor.jump(1)
    ticks.tick(2)
    assert (ticks.block, ticks.aim.name) == ("down.begin", "AF")
    ticks.p = (10.0, 0.0, 2.0)
    ticks.tick(2)
    assert ticks.aim.climb == pytest.approx(-1.0)
    ticks.told["landed"] = True
    ticks.seconds(7)
    assert ticks.block == "Wait"


def test_ticks_are_twenty_a_second_however_often_it_is_asked():
    ticks = PlanTicks('<block name="a" pre_call="n = n + 1"><stay wp="A"/></block>', COUNTERS)
    for _ in range(100):
        ticks.executor.update(ticks._inputs(), EnuPoint(*ticks.p), EnuPoint(*ticks.v))
        ticks.time += 0.02  # as the autopilot asks
    assert 39 <= ticks.variable("n") <= 41
    ticks.time += 60.0  # another mode was flown meanwhile
    for _ in range(50):
        ticks.executor.update(ticks._inputs(), EnuPoint(*ticks.p), EnuPoint(*ticks.v))
        ticks.time += 0.02
    assert 59 <= ticks.variable("n") <= 62


@pytest.mark.parametrize(
    ("flags", "commands", "kind", "end", "climb", "heading"),
    [
        ("0", "5,6,-3,0.5", AimKind.POINT, (6.0, 5.0, 3.0), None, 0.5),
        ("GUIDED_FLAG_XY_OFFSET | GUIDED_FLAG_Z_OFFSET", "1,2,-1,0", AimKind.POINT, (3.0, 2.0, 3.0), None, 0.0),
        ("GUIDED_FLAG_XY_BODY | GUIDED_FLAG_YAW_OFFSET", "2,1,-3,0.1", AimKind.POINT, (3.0, 0.0, 3.0), None, 1.6708),
        ("GUIDED_FLAG_XY_VEL | GUIDED_FLAG_Z_VEL", "1,2,0.5,0", AimKind.VELOCITY, (2.0, 1.0, -0.5), -0.5, 0.0),
        ("0x80", "0,0,-2,0.2", AimKind.POINT, (0.0, 0.0, 2.0), None, None),
    ],
)
def test_guided_set_points(flags, commands, kind, end, climb, heading):
    ticks = PlanTicks(f'<block name="a"><guided flags="{flags}" commands="{commands}"/></block>')
    ticks.p, ticks.told["heading"] = (1.0, 1.0, 2.0), -0.5 * math.pi  # the belly looks east
    aim = ticks.tick().aim
    assert (aim.kind, aim.climb) == (kind, climb)
    assert aim.end == pytest.approx(end)
    assert ticks.executor.memory.heading == (None if heading is None else pytest.approx(heading, abs=1e-4))
    assert aim.turn_rate == (0.2 if flags == "0x80" else 0.0)
    ticks.p = (9.0, 9.0, 2.0)
    assert ticks.tick().aim == aim  # an offset counts from where it was asked for


def test_a_heading_and_a_level_attitude():
    ticks = PlanTicks(
        '<block name="a"><heading course="90" alt="104" until="n == 1"/><attitude roll="0" vmode="alt"/></block>',
        COUNTERS,
    )
    ticks.p = (1.0, 2.0, 2.0)
    aim = ticks.tick().aim
    assert (aim.kind, aim.course, aim.start[:2], aim.end.z) == (AimKind.COURSE, pytest.approx(math.pi / 2), (1, 2), 4.0)
    ticks.executor.names.store("n", 1)
    ticks.p = (5.0, 2.0, 4.0)
    aim = ticks.tick(2).aim
    assert (aim.kind, aim.end) == (AimKind.POINT, (5.0, 2.0, 4.0))
