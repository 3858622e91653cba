"""Whatever a plan says, the executor never raises, and the same plan flies the same twice."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.flight_plans import FlightPlanError
from protocol.flight_plans.plan_check import check_flown
from tests.support.plans import plan_of
from tests.support.vehicle.plan_ticks import PlanTicks

VARIABLES = '<variables><variable var="n" type="int"/><variable var="x" init="1"/></variables>'
SECTORS = '<sectors><sector name="S"><corner name="HOME"/><corner name="A"/><corner name="B"/></sector></sectors>'
NUMBERS = st.sampled_from(
    ["0", "1", "-3", "2.5", "n", "x", "GetPosX()", "stage_time", "nav.radius", "1/n", "x*1e300*1e300", "x**400",
     "WaypointX(WP_A)", "WaypointAlt(n)", "NavCircleCount()", "GetPosHeight() % n", "-x", "(0-x)**0.5"]
)  # fmt: skip
CONDITIONS = st.one_of(
    st.sampled_from(["0", "1", "stage_time > 0", "n == 3", "InsideS(GetPosX(), GetPosY())", "!nav_is_in_flight()"]),
    st.tuples(NUMBERS, st.sampled_from(["@GT", "@LEQ", "==", "@AND", "@OR"]), NUMBERS).map(" ".join),
)
POINTS = st.sampled_from(["A", "B", "C", "HOME"])
BLOCKS = st.sampled_from(["a", "b", "c", "HOME"])
MODES = st.sampled_from(
    ["", 'vmode="climb" climb="{}"', 'vmode="throttle" throttle="{}"', 'alt="{}"', 'vmode="alt" height="{}"']
)
CALLS = st.sampled_from(
    ["NavKillThrottle()", "NavResurrect()", "NavSetWaypointHere(WP_A)", "NavSetWaypointHere(n)", "n = n + 1",
     "if (n > 3) x = x / n", "nav_set_heading_deg(x)", "guidance_h_SetMaxSpeed(x)", "nav_compute_baseleg(1, 2, 3, x)",
     "NavCopyWaypoint(WP_A, n)", "nav.radius = x", "autopilot_set_mode(n)"]
)  # fmt: skip


def element(text, *parts):
    """An element with drawn parts in its gaps."""
    return st.tuples(*parts).map(lambda given: text.format(*given))


MOVES = st.one_of(
    element('<stay wp="{}" until="{}" {{}}/>', POINTS, CONDITIONS),
    element('<go wp="{}" {{}}/>', POINTS),
    element('<go wp="{}" from="{}" hmode="route" approaching_time="{}" {{}}/>', POINTS, POINTS, NUMBERS),
    element('<go wp="{}" wp_qdr="{}" wp_dist="{}" {{}}/>', POINTS, NUMBERS, NUMBERS),
    element('<circle wp="{}" radius="{}" until="{}" {{}}/>', POINTS, NUMBERS, CONDITIONS),
    element('<heading course="{}" until="{}" {{}}/>', NUMBERS, CONDITIONS),
)
STAGES = st.recursive(
    st.one_of(
        st.tuples(MOVES, MODES, NUMBERS).map(lambda drawn: drawn[0].format(drawn[1].format(drawn[2]))),
        element('<oval p1="{}" p2="{}" radius="{}" until="{}"/>', POINTS, POINTS, NUMBERS, CONDITIONS),
        element('<eight center="{}" turn_around="{}" radius="{}" until="{}"/>', POINTS, POINTS, NUMBERS, CONDITIONS),
        element('<survey_rectangle wp1="{}" wp2="{}" grid="{}" until="{}"/>', POINTS, POINTS, NUMBERS, CONDITIONS),
        element('<guided commands="{},1,-2,{}" flags="{}" until="{}"/>', NUMBERS, NUMBERS, NUMBERS, CONDITIONS),
        element('<path wpts="{},{}"/>', POINTS, POINTS),
        element('<set var="n" value="{}"/>', NUMBERS),
        element('<set var="x" value="{}"/>', NUMBERS),
        element('<call fun="{}"/>', CALLS),
        element('<call_once fun="{}"/>', CALLS),
        element('<deroute block="{}"/>', BLOCKS),
        element('<return reset_stage="{}"/>', CONDITIONS),
        st.just("<home/>"),
        element('<exception cond="{}" deroute="{}"/>', CONDITIONS, BLOCKS),
    ),
    lambda inner: st.one_of(
        element('<while cond="{}">{}</while>', CONDITIONS, st.lists(inner, max_size=3).map("".join)),
        element('<for var="i" from="{}" to="{}">{}</for>', NUMBERS, NUMBERS, st.lists(inner, max_size=3).map("".join)),
    ),
    max_leaves=5,
)
BODIES = st.lists(STAGES, max_size=5).map("".join)
EXCEPTIONS = st.lists(element('<exception cond="{}" deroute="{}"/>', CONDITIONS, BLOCKS), max_size=2)
PLANS = st.tuples(BODIES, BODIES, BODIES, EXCEPTIONS)


def flown(bodies, exceptions):
    """Everything a plan wants and says in a few seconds about a vehicle that moves."""
    blocks = "".join(f'<block name="{name}">{body}</block>' for name, body in zip("abc", bodies, strict=True))
    plan = plan_of(blocks, SECTORS + VARIABLES + f"<exceptions>{''.join(exceptions)}</exceptions>")
    try:
        check_flown(plan).require_flown()
    except FlightPlanError:
        return None
    ticks, seen = PlanTicks("", plan=plan), []
    for step in range(80):
        turn = 0.1 * step
        ticks.p = (4.0 * math.sin(turn), 4.0 * math.cos(turn), 2.0 + math.sin(0.3 * turn))
        ticks.told["landed"] = step % 40 > 30
        ticks.tick()
        seen.append((ticks.aim, ticks.executor.flow.block, ticks.executor.flow.stage))
    return seen, ticks.events, ticks.executor.take_motor_requests()


@pytest.mark.long
@settings(max_examples=50)
@given(PLANS)
def test_any_plan_is_flown_and_the_same_twice(plan):
    *bodies, exceptions = plan
    once = flown(bodies, exceptions)
    assert repr(flown(bodies, exceptions)) == repr(once)
    if once is not None:
        for aim, _, _ in once[0]:
            assert all(map(math.isfinite, (*aim.start, *aim.end, aim.radius, aim.course, aim.climb or 0.0)))
