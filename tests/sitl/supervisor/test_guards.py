"""Each guard at its threshold: what it looks at, and on which side of it it holds."""

import math

import pytest

from sitl.control.forward_flight.forward_guidance import stopping_distance
from sitl.control.reference import AttitudeReference, along, circle, hover_at, leg, steer
from sitl.design.gains import line_of_sight_gains
from sitl.design.proved import PROVED_LEVEL
from sitl.model.airframe_files import load
from sitl.model.quaternions import hover, multiply
from sitl.model.vectors import Vector
from sitl.simulation.tuning import GENTLE_GAIN, thresholds
from sitl.supervisor import guards as g
from tests.support.flights.estimates import estimate, rotation, vector
from tests.support.flights.tunings import BY_REPORT, EVERY_LAW

A = load("nominal").parameters
GUIDANCE = line_of_sight_gains().guidance
USUAL = thresholds(A, EVERY_LAW)
ALONE = thresholds(A, BY_REPORT._replace(v_enter=0.0, v_leave=math.inf))
BIT = 1e-9  # relative distance from a threshold
HERE, END = (0.0, 0.0, 50.0), (100.0, 0.0, 50.0)
NORTH_LEG = along(hover_at(HERE, 0.0), leg(HERE, END, 15.0), 0.0)
LONG_LEG = along(hover_at(HERE, 0.0), leg(HERE, END, 15.0, stop=False), 0.0)
ROUND = along(hover_at(HERE, 0.0), circle(HERE, 40.0, 15.0), 0.0)
STILL = hover_at(HERE, 0.0)

above = 1.0 + BIT
below = 1.0 - BIT


def nose_at(height, azimuth=0.0):
    """The attitude whose nose has this vertical component, tipped over the belly."""
    return multiply(hover(azimuth), rotation((0.0, math.acos(height), 0.0)))


def holds(guard, **seen):
    return guard.test(**seen)


@pytest.mark.parametrize(
    ("guard", "field"), [(g.armed, "is_armed"), (g.flight_requested, "is_flying"), (g.crashed, "has_crashed")]
)
def test_orders_are_taken_as_they_are(guard, field):
    assert holds(guard, **{field: True})
    assert not holds(guard, **{field: False})


def test_a_law_has_dwelt_when_its_time_is_reached():
    assert holds(g.dwell_elapsed, law_time=g.DWELL)
    assert not holds(g.dwell_elapsed, law_time=g.DWELL * below)


@pytest.mark.parametrize(("nose", "time"), [(g.LEANING + 1e-6, g.GROUND_REST_TIME), (g.LEANING - 1e-6, g.LEANING_TIME)])
def test_it_rests_after_a_moment_upright_and_after_longer_where_it_leans(nose, time):
    assert holds(g.resting, at_rest=time, estimate=estimate(q=nose_at(nose)))
    assert not holds(g.resting, at_rest=time * below, estimate=estimate(q=nose_at(nose)))


@pytest.mark.parametrize(
    ("place", "time"),
    [
        ((0.0, 0.0, -7.0), g.GROUND_REST_TIME),
        ((0.0, 0.0, g.GROUND_HEIGHT - 0.01), g.GROUND_REST_TIME),
        ((0.0, 0.0, g.GROUND_HEIGHT + 0.01), g.REST_TIME),
        ((0.0, 0.0, g.HILL_HEIGHT - 0.01), g.REST_TIME),
        ((0.0, 0.0, g.HILL_HEIGHT + 0.01), g.HILL_REST_TIME),
        ((18.0, -24.0, g.HILL_HEIGHT + 2.99), g.REST_TIME),  # 30 m away
        ((18.0, -24.0, g.HILL_HEIGHT + 3.01), g.HILL_REST_TIME),
        ((0.0, 300.0, g.HILL_HEIGHT + g.MAX_HILL_RISE + 0.01), g.HILL_REST_TIME),
    ],
)
def test_the_less_likely_the_ground_is_at_its_height_the_longer_it_has_to_rest(place, time):
    there = estimate(p=place)
    assert holds(g.resting, at_rest=time, estimate=there)
    assert not holds(g.resting, at_rest=time * below, estimate=there)


def test_near_is_below_the_entry_threshold_with_the_nose_up_and_nothing_being_flown_off():
    seen = {"estimate": estimate(), "thresholds": USUAL, "inhibited": 0.0, "law_time": 0.0}
    near = {"v_hover": USUAL.v_enter * below, "v_integral": 0.0, **seen}
    assert holds(g.v_below_enter, **near)
    assert not holds(g.v_below_enter, **near | {"v_hover": USUAL.v_enter})
    assert not holds(g.v_below_enter, **near | {"inhibited": 1e-3})
    assert holds(g.v_below_enter, **near | {"estimate": estimate(q=nose_at(1e-6))})
    assert not holds(g.v_below_enter, **near | {"estimate": estimate(q=nose_at(-1e-6))})
    assert not holds(g.v_below_enter, **near | {"v_integral": 1e-6})
    assert holds(g.v_below_enter, **near | {"v_hover": 2.0 * USUAL.v_enter, "v_integral": -1.001 * USUAL.v_enter})


def test_a_law_that_has_waited_long_need_not_come_as_near():
    far = {"v_integral": 0.0, "estimate": estimate(), "thresholds": USUAL, "inhibited": 0.0}
    assert USUAL.v_enter < USUAL.v_waited < USUAL.v_leave
    assert holds(g.v_below_enter, **far, v_hover=USUAL.v_waited * below, law_time=g.LYAPUNOV_PATIENCE)
    assert not holds(g.v_below_enter, **far, v_hover=USUAL.v_waited, law_time=g.LYAPUNOV_PATIENCE)
    assert not holds(g.v_below_enter, **far, v_hover=USUAL.v_waited * below, law_time=g.LYAPUNOV_PATIENCE * below)


def test_the_entry_guard_is_the_certified_level():
    """And thresholds that are set are those, with what comes of them."""
    assert USUAL.v_enter == PROVED_LEVEL
    assert USUAL[1:4] == (50.0, 20.0, 4.0)
    assert thresholds(A, BY_REPORT._replace(design=GENTLE_GAIN))[:4] == (20.0, 50.0, 20.0, 10.0)
    assert thresholds(A, BY_REPORT._replace(integral=0))[:4] == (20.0, 50.0, 20.0, 10.0)
    assert thresholds(A._replace(m=1.01 * A.m), BY_REPORT)[:4] == (20.0, 50.0, 20.0, 10.0)
    assert thresholds(A, BY_REPORT._replace(v_enter=3.0, v_leave=7.0))[:4] == (3.0, 7.0, 3.0, 1.5)


def test_a_transition_that_the_wind_keeps_from_settling_waits_as_the_zero_moment_law_does():
    waited = {"estimate": estimate(), "thresholds": USUAL, "law_time": g.LYAPUNOV_PATIENCE}
    assert USUAL.v_settled < USUAL.v_waited < USUAL.v_leave
    assert holds(g.v_below_settled, **waited, v_hover=USUAL.v_waited * below)
    assert not holds(g.v_below_settled, **waited, v_hover=USUAL.v_waited)
    sooner = waited | {"law_time": g.LYAPUNOV_PATIENCE * below}
    assert not holds(g.v_below_settled, **sooner, v_hover=USUAL.v_settled)
    chosen = thresholds(A, BY_REPORT._replace(v_enter=4.0))._replace(v_waited=1.0)
    assert holds(g.v_below_settled, **waited | {"thresholds": chosen}, v_hover=chosen.v_settled * below)


def test_settled_is_below_its_threshold_whatever_is_being_flown_off():
    settled = {"v_hover": USUAL.v_settled * below, "estimate": estimate(), "thresholds": USUAL, "law_time": 0.0}
    assert holds(g.v_below_settled, **settled)
    assert not holds(g.v_below_settled, **settled | {"v_hover": USUAL.v_settled})
    assert not holds(g.v_below_settled, **settled | {"estimate": estimate(q=nose_at(-1e-6))})


def test_far_is_above_the_exit_threshold_with_room_for_hysteresis():
    assert holds(g.v_above_leave, v_hover=USUAL.v_leave * above, thresholds=USUAL)
    assert not holds(g.v_above_leave, v_hover=USUAL.v_leave, thresholds=USUAL)
    assert USUAL.v_enter < USUAL.v_leave
    assert not holds(g.v_above_leave, v_hover=1e300, thresholds=ALONE)


@pytest.mark.parametrize(
    ("guard", "speed", "holds_above"), [(g.wind_strong, g.STRONG_HOVER_WIND, True), (g.wind_calm, g.CALM_WIND, False)]
)
def test_the_wind_counts_level_as_it_is_estimated(guard, speed, holds_above):
    rest = {"thresholds": USUAL} if guard is g.wind_strong else {}
    for wind, stronger in (((0.6, -0.8, 5.0), True), ((-1.0, 0.0, -9.0), True), ((0.0, 1.0, 0.0), False)):
        size = speed * (above if stronger else below)
        seen = estimate(wind=(size * wind[0], size * wind[1], wind[2]))
        assert holds(guard, estimate=seen, **rest) == (stronger == holds_above)
    assert g.CALM_WIND < g.STRONG_HOVER_WIND


def test_a_law_flown_alone_leaves_for_no_wind_no_slide_and_no_fall():
    storm = estimate(v=(0, 9, -20), q=nose_at(0.5), wind=(20, 0, 0))
    assert holds(g.wind_strong, estimate=storm, thresholds=USUAL)
    assert holds(g.sliding, estimate=storm, law_time=9.0, thresholds=USUAL)
    assert holds(g.falling, estimate=storm, thresholds=USUAL)
    assert not holds(g.wind_strong, estimate=storm, thresholds=ALONE)
    assert not holds(g.sliding, estimate=storm, law_time=9.0, thresholds=ALONE)
    assert not holds(g.falling, estimate=storm, thresholds=ALONE)


@pytest.mark.parametrize(
    ("guard", "nose", "speed"),
    [(g.upright_and_slow, 0.5, g.TURNING_SPEED), (g.standing, 0.3, g.STANDING_SPEED)],
)
def test_upright_and_slow(guard, nose, speed):
    direction = (0.6, 0.0, -0.8)
    slow, fast = (vector([speed * k * x for x in direction]) for k in (below, above))
    assert holds(guard, estimate=estimate(v=slow, q=nose_at(nose + 1e-6)))
    assert not holds(guard, estimate=estimate(v=fast, q=nose_at(nose + 1e-6)))
    assert not holds(guard, estimate=estimate(v=slow, q=nose_at(nose - 1e-6)))


def test_recovered_is_upright_and_neither_turning_nor_sinking():
    for axis in ((1.0, 0.0, 0.0), (0.0, 0.6, -0.8)):
        slow, fast = (vector([g.RECOVERED_RATE * k * x for x in axis]) for k in (below, above))
        assert holds(g.recovered, estimate=estimate(w=slow))
        assert not holds(g.recovered, estimate=estimate(w=fast))
    for speed in ((0.0, 9.0, 2.5), (-9.0, 0.0, -g.SINK * below)):  # level speed and climb do not count
        assert holds(g.recovered, estimate=estimate(v=speed, q=nose_at(0.7 + 1e-6)))
        assert not holds(g.recovered, estimate=estimate(v=speed, q=nose_at(0.7 - 1e-6)))
    assert not holds(g.recovered, estimate=estimate(v=(0.0, 0.0, -g.SINK * above)))


@pytest.mark.parametrize("course", [0.0, 1.0, -2.5])
def test_aligned_is_the_belly_within_twelve_degrees_of_the_course_upright_and_slow(course):
    def tilted(off, nose=0.9):
        return estimate(q=nose_at(nose, course + off), v=(0.0, 0.0, g.ALIGNED_SPEED * below))

    for side in (1.0, -1.0):
        assert holds(g.aligned, estimate=tilted(side * (g.ALIGNED_ANGLE - 1e-6)), course=course, law_time=0.0)
        assert not holds(g.aligned, estimate=tilted(side * (g.ALIGNED_ANGLE + 1e-6)), course=course, law_time=0.0)
    assert not holds(g.aligned, estimate=tilted(math.pi), course=course, law_time=0.0)
    assert not holds(g.aligned, estimate=tilted(0.0, nose=0.7 - 1e-6), course=course, law_time=0.0)
    fast = tilted(0.0)._replace(velocity=Vector(0.0, g.ALIGNED_SPEED * above, 0.0))
    assert not holds(g.aligned, estimate=fast, course=course, law_time=0.0)
    assert math.cos(g.ALIGNED_ANGLE) == pytest.approx(g.ALIGNED_COSINE, abs=1e-15)


def test_sliding_is_fast_with_the_nose_down_for_some_time():
    slides = {"estimate": estimate(v=(g.SLIDE_SPEED * above, 0, 0), q=nose_at(0.9 - 1e-6)), "thresholds": USUAL}
    assert holds(g.sliding, law_time=g.SLIDE_TIME * above, **slides)
    assert not holds(g.sliding, law_time=g.SLIDE_TIME, **slides)
    upright = estimate(v=(g.SLIDE_SPEED * above, 0, 0), q=nose_at(0.9 + 1e-6))
    assert not holds(g.sliding, law_time=9.0, estimate=upright, thresholds=USUAL)
    slow = estimate(v=(g.SLIDE_SPEED * below, 0, 0), q=nose_at(0.9 - 1e-6))
    assert not holds(g.sliding, law_time=9.0, estimate=slow, thresholds=USUAL)


def test_falling_is_faster_than_any_law_sinks_or_too_near_the_ground_to_go_on():
    def sinking(sink, height):
        return estimate(p=(0.0, 0.0, height), v=(0.0, 0.0, -sink))

    assert holds(g.falling, estimate=sinking(g.MAX_SINK * above, 1000.0), thresholds=USUAL)
    assert not holds(g.falling, estimate=sinking(g.MAX_SINK, 1000.0), thresholds=USUAL)
    near = g.GROUND_TIME * 8.0
    assert holds(g.falling, estimate=sinking(8.0, near * below), thresholds=USUAL)
    assert not holds(g.falling, estimate=sinking(8.0, near), thresholds=USUAL)
    assert holds(g.falling, estimate=sinking(g.SINK * above, 0.1), thresholds=USUAL)
    assert not holds(g.falling, estimate=sinking(g.SINK, 0.1), thresholds=USUAL)  # as a landing does


@pytest.mark.parametrize(("reference", "wanted"), [(STILL, False), (NORTH_LEG, True), (ROUND, True)])
def test_forward_flight_is_wanted_where_guidance_says_so(reference, wanted):
    assert holds(g.forward_requested, reference=reference) == wanted


def test_a_leg_is_worth_a_transition_while_enough_of_it_is_left_and_what_does_not_stop_always_is():
    def off_the_end(distance):
        return estimate(p=(END[0] - 0.6 * distance, 0.8 * distance, 70.0))

    assert holds(g.leg_long_enough, estimate=off_the_end(g.MIN_TRANSITION_LEG * above), reference=NORTH_LEG)
    assert not holds(g.leg_long_enough, estimate=off_the_end(g.MIN_TRANSITION_LEG * below), reference=NORTH_LEG)
    assert holds(g.leg_long_enough, estimate=off_the_end(0.0), reference=LONG_LEG)
    assert holds(g.leg_long_enough, estimate=estimate(), reference=ROUND)


@pytest.mark.parametrize(("guard", "factor"), [(g.stop_due, 1.0), (g.has_stopping_distance, g.BRAKING_MARGIN)])
def test_a_stop_is_due_where_braking_takes_what_is_left_and_there_is_room_for_more_where_it_is_far_less(guard, factor):
    speed = 12.0
    braking = factor * stopping_distance(speed, 0.0, 0.0, GUIDANCE)

    def asked(left, reference=NORTH_LEG):
        seen = estimate(p=(END[0] - left, 0.0, 50.0), v=(speed, 0.0, 0.0))
        return holds(guard, estimate=seen, reference=reference, guidance=GUIDANCE)

    due = guard is g.stop_due
    assert asked(braking * (1.0 - 1e-6)) == due
    assert asked(braking * (1.0 + 1e-6)) == (not due)
    assert not asked(braking, NORTH_LEG._replace(forward=False))  # nobody wants forward flight: neither
    for goes_on in (LONG_LEG, ROUND):
        assert asked(braking, goes_on) == (not due)


@pytest.mark.parametrize(("airspeed", "threshold"), [(15.0, g.WING_SPEED), (7.0, g.WING_SPEED_RATIO * 7.0)])
def test_the_wing_carries_from_an_airspeed_or_most_of_the_wanted_one(airspeed, threshold):
    reference = along(STILL, leg(HERE, END, airspeed), 0.0)
    wind = (3.0, -2.0, 0.5)
    for factor in (above, below):
        u = threshold * factor
        seen = estimate(v=(wind[0] + 0.6 * u, wind[1] + 0.8 * u, wind[2]), wind=wind)
        assert holds(g.wing_borne, estimate=seen, reference=reference) == (factor > 1.0)


@pytest.mark.parametrize(("reference", "straight"), [(NORTH_LEG, True), (STILL, True), (ROUND, False)])
def test_only_a_circle_is_not_straight(reference, straight):
    assert holds(g.straight, reference=reference) == straight


def test_the_linear_forward_law_is_entered_below_one_value_and_left_above_another():
    assert holds(g.v_forward_below_enter, v_forward=USUAL.v_forward_enter * below, thresholds=USUAL)
    assert not holds(g.v_forward_below_enter, v_forward=USUAL.v_forward_enter, thresholds=USUAL)
    assert holds(g.v_forward_above_leave, v_forward=USUAL.v_forward_leave * above, thresholds=USUAL)
    assert not holds(g.v_forward_above_leave, v_forward=USUAL.v_forward_leave, thresholds=USUAL)
    assert holds(g.v_forward_above_leave, v_forward=math.inf, thresholds=USUAL)  # on a circle
    assert USUAL.v_forward_enter < USUAL.v_forward_leave
    unused = thresholds(A, BY_REPORT)
    assert holds(g.has_forward_linear, thresholds=USUAL)
    assert not holds(g.has_forward_linear, thresholds=unused)
    assert not holds(g.v_forward_below_enter, v_forward=0.0, thresholds=unused)


def test_set_points_of_attitude_are_seen_as_coming():
    asked = AttitudeReference(hover(0.0), Vector(0.0, 0.0, 0.0), 0.5)
    assert holds(g.attitude_commanded, reference=steer(STILL, asked))
    assert not holds(g.attitude_commanded, reference=STILL)


def test_the_attitude_is_lost_beyond_what_45_degrees_at_rest_are_worth():
    assert holds(g.attitude_diverged, v_attitude=g.DIVERGED_ATTITUDE * above)
    assert not holds(g.attitude_diverged, v_attitude=g.DIVERGED_ATTITUDE)
    assert pytest.approx(4.0 * (1.0 - math.cos(0.5 * math.radians(45.0))), rel=0.02) == g.DIVERGED_ATTITUDE


@pytest.mark.parametrize(
    ("place", "limit"), [((0.0, 0.0), g.HILL_HEIGHT), ((18.0, -24.0), g.HILL_HEIGHT + 30.0 * g.HILL_SLOPE)]
)
def test_a_landing_touches_down_where_the_ground_may_be_and_only_if_it_is_wanted(place, limit):
    low, high = estimate((*place, limit - 1e-6)), estimate((*place, limit + 1e-6))
    assert holds(g.touching_down, is_landing=True, estimate=low)
    assert not holds(g.touching_down, is_landing=True, estimate=high)
    assert not holds(g.touching_down, is_landing=False, estimate=low)
