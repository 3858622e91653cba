"""Legs and circles in forward flight: headings, speeds, and when they are done."""

import math

import pytest

from protocol.ranges import MIN_AIRSPEED
from sitl.control.reference import hover_at, leg
from sitl.guidance.circles import circle_about, circle_ahead
from sitl.guidance.leg_speeds import CORNER_ACCELERATION, corner_lead, leg_airspeeds, slowed_airspeed
from sitl.guidance.legs import (
    FlyLeg,
    LandAfter,
    Passage,
    can_meet,
    crosswind_heading,
    flown_along,
    is_left_turn,
    leg_reference,
    turn_radius,
)
from sitl.guidance.view import MAX_CENTRIPETAL, VehicleView

STILL = (0.0, 0.0, 0.0)
HERE = hover_at((0.0, 0.0, 30.0), 0.0)


def view(p, time=0.0, forward=True, heading=0.0):
    return VehicleView(time, p, STILL, heading, 0.0, False, 1.0, forward=forward)


@pytest.mark.parametrize(("heading", "wind_from"), [(0.2, 0.0), (-2.0, 1.0), (3.0, 4.0)])
def test_the_crosswind_heading_is_the_nearer_one_with_the_span_along_the_wind(heading, wind_from):
    found = crosswind_heading(heading, (5.0 * math.cos(wind_from), 5.0 * math.sin(wind_from), 0.0))
    assert abs(math.cos(found - wind_from)) < 1e-9
    assert abs(found - heading) <= 0.5 * math.pi + 1e-9


def test_a_light_wind_does_not_change_the_heading():
    assert crosswind_heading(0.3, (2.0, 1.0, 0.0)) == 0.3


def test_a_leg_that_does_not_stop_is_done_at_its_lead_or_past_its_end():
    reference = leg_reference((0.0, 0.0, 30.0), (100.0, 0.0, 30.0), HERE, 15.0, stop=False)
    assert [FlyLeg(reference, 0.5, lead=20.0).done(view((x, 3.0, 30.0))) for x in (79.0, 81.0)] == [False, True]
    assert [FlyLeg(reference, 0.5).done(view((x, 3.0, 30.0))) for x in (99.0, 101.0)] == [False, True]


def test_a_leg_that_stops_is_done_upright_within_its_acceptance():
    leg = FlyLeg(leg_reference((0.0, 0.0, 30.0), (100.0, 0.0, 30.0), HERE, 15.0, stop=True), 0.5)
    near = (99.8, 0.0, 30.0)
    assert leg.update(view(near)).forward
    assert not leg.done(view(near))
    assert not leg.update(view(near, forward=False)).forward
    assert leg.done(view(near, forward=False))


def test_to_pass_the_end_of_a_leg_that_stops_is_not_to_arrive():
    leg = FlyLeg(leg_reference((0.0, 0.0, 30.0), (100.0, 0.0, 30.0), HERE, 15.0, stop=True), 0.5)
    leg.update(view((100.0, 0.0, 30.0)))
    beyond = view((112.0, 0.0, 30.0), 1.0, forward=False)
    leg.update(beyond)
    assert not leg.done(beyond)


def test_the_landing_after_a_leg_waits_until_the_vehicle_stands_over_its_end():
    leg = FlyLeg(leg_reference((0.0, 0.0, 30.0), (100.0, 0.0, 30.0), HERE, 15.0, stop=True), 0.5)
    landing = LandAfter(leg, 0.5)
    over = view((100.0, 0.0, 30.0))
    assert landing.update(over._replace(v=(9.0, 0.0, 0.0))).position == (100.0, 0.0, 30.0)
    assert not landing.landing
    landing.update(over._replace(time=0.1, forward=False))
    assert landing.landing


def test_the_turn_before_a_corner_begins_earlier_for_sharper_corners_and_fits_the_legs():
    leads = [corner_lead((0.0, 0.0), (200.0, 0.0), (200.0 + x, y), 15.0) for x, y in ((200, 0), (140, 140), (0, 200))]
    assert leads == sorted(leads)
    assert leads[-1] == pytest.approx(15.0**2 / 6.0)
    assert corner_lead((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), 15.0) == pytest.approx(0.45 * 20.0)


def test_a_short_last_leg_slows_the_end_of_the_leg_before_it():
    points = [(0.0, 0.0, 30.0), (200.0, 0.0, 30.0), (215.0, 0.0, 30.0)]
    speeds = leg_airspeeds(points, 20.0, STILL)
    assert MIN_AIRSPEED <= speeds[1] < 20.0
    assert speeds[0] == 20.0  # it slows down before the corner
    assert leg_airspeeds([points[0], (900.0, 0.0, 30.0)], 20.0, STILL) == [20.0]


@pytest.mark.parametrize("wind", [STILL, (-6.0, 0.0, 0.0), (0.0, 5.0, 0.0)])
def test_a_leg_slows_down_only_where_the_next_one_needs_it(wind):
    ends = ((0.0, 0.0, 30.0), (200.0, 0.0, 30.0))
    speeds = [slowed_airspeed(18.0, 9.0, room, ends, wind) for room in (-5.0, 0.0, 10.0, 20.0, 150.0)]
    assert speeds == sorted(speeds)
    assert speeds[:2] == pytest.approx([9.0, 9.0], abs=0.2)
    assert 9.5 < speeds[2] < speeds[3] < 18.0
    assert speeds[4] == 18.0
    assert slowed_airspeed(9.0, 18.0, 0.0, ends, wind) == 9.0  # the next leg is the faster one


def test_a_leg_before_a_slow_one_is_flown_fast_until_its_last_metres():
    leg = FlyLeg(leg_reference((0.0, 0.0, 30.0), (200.0, 0.0, 30.0), HERE, 18.0, stop=False), 0.5, lead=10.0)
    leg.end_airspeed = 9.0
    wanted = [leg.update(view((x, 0.0, 30.0))).path.airspeed for x in (0.0, 100.0, 180.0, 189.9)]
    assert wanted[:2] == [18.0, 18.0]
    assert 9.0 < wanted[2] < 18.0
    assert wanted[3] == pytest.approx(9.0, abs=0.2)
    assert leg.reference.path.airspeed == 18.0  # of the leg, for a change of speed in flight


def test_a_tight_circle_is_flown_slower():
    wide, tight = (circle_about((50.0, 0.0, 30.0), radius, HERE, 15.0).reference.path for radius in (60.0, 20.0))
    assert wide.airspeed == 15.0
    assert tight.airspeed == pytest.approx(math.sqrt(MAX_CENTRIPETAL * 20.0))
    assert wide.radius == -60.0  # clockwise seen from above


def test_a_circle_counts_its_turns_from_when_it_is_reached():
    circle = circle_about((0.0, 0.0, 30.0), 40.0, HERE, 14.0, turns=2.0)
    circle.update(view((200.0, 0.0, 30.0)))
    assert circle.since is None
    for step in range(81):
        angle = -step * math.tau / 40.0
        seen = view((40.0 * math.cos(angle), 40.0 * math.sin(angle), 30.0), 0.5 * step)
        circle.update(seen)
        assert circle.done(seen) is (step >= 80)


def test_a_circle_ahead_is_met_flying_straight():
    circle = circle_ahead(view((1.0, 2.0, 30.0), heading=0.7), 40.0, HERE, 14.0)
    x, y = circle.reference.path.start.x - 1.0, circle.reference.path.start.y - 2.0
    ahead, right = x * math.cos(0.7) + y * math.sin(0.7), x * math.sin(0.7) - y * math.cos(0.7)
    assert (ahead, right) == pytest.approx((60.0, 40.0))


# A waypoint in forward flight is passed near enough, or a circle is flown first.


SPEED = 15.0
PATH = leg((0.0, 0.0, 30.0), (200.0, 0.0, 30.0), SPEED, stop=False)
HOVER = hover_at((200.0, 0.0, 30.0), 0.0)
RADIUS = SPEED**2 / CORNER_ACCELERATION


def passing(p, course=0.0, *, forward=True, speed=SPEED):
    v = (speed * math.cos(course), speed * math.sin(course), 0.0)
    return VehicleView(0.0, p, v, course, 1.5, landed=False, battery_remaining=1.0, forward=forward)


def test_a_waypoint_is_passed_abeam_of_it_within_its_radius_and_height():
    passage = Passage(reach=16.0, height_reach=10.0)
    assert not passage.is_passed(passing((199.0, 0.0, 30.0)), PATH, 0.0)
    assert passage.is_passed(passing((200.0, 15.9, 39.9)), PATH, 0.0)
    assert not passage.is_passed(passing((200.0, 16.1, 30.0)), PATH, 0.0)
    assert not passage.is_passed(passing((200.0, 0.0, 40.1)), PATH, 0.0)


def test_a_turn_begins_before_it_only_on_the_leg_and_at_its_height():
    sloping = leg((0.0, 0.0, 0.0), (200.0, 0.0, 100.0), SPEED, stop=False)
    passage = Passage(reach=16.0, height_reach=10.0)
    assert not passage.is_passed(passing((159.0, 0.0, 80.0)), sloping, 40.0)
    assert passage.is_passed(passing((160.0, 0.0, 80.0)), sloping, 40.0)
    assert not passage.is_passed(passing((160.0, 0.0, 69.0)), sloping, 40.0)
    assert not passage.is_passed(passing((160.0, 17.0, 80.0)), sloping, 40.0)


def test_what_lies_within_the_circle_of_a_turn_cannot_be_met():
    here = passing((0.0, 0.0, 30.0))
    assert turn_radius(here, SPEED) == pytest.approx(RADIUS)
    assert can_meet(here, (100.0, 0.0, 30.0), RADIUS, 16.0)
    assert can_meet(here, (0.0, 2.0 * RADIUS, 30.0), RADIUS, 1.0)
    assert not can_meet(here, (0.0, RADIUS, 30.0), RADIUS, 16.0)
    assert not can_meet(here, (0.0, -RADIUS, 30.0), RADIUS, 16.0)


@pytest.mark.parametrize(("side", "sense"), [(30.0, -1.0), (-30.0, 1.0)])
def test_before_a_point_beside_a_circle_leads_away_until_the_course_leads_there(side, sense):
    path = leg((0.0, 0.0, 30.0), (0.0, side, 30.0), SPEED, stop=False)
    passage = Passage(reach=16.0, height_reach=10.0)
    circle = passage.circled(passing((0.0, 0.0, 30.0)), path, HOVER).path
    assert math.copysign(1.0, circle.radius) == sense
    assert math.copysign(1.0, circle.start.y) == -math.copysign(1.0, side)
    p = (circle.start.x - abs(circle.radius), circle.start.y, 30.0)
    course = math.atan2(side - p[1], -p[0])
    assert passage.circled(passing(p, course + 0.5), path, HOVER) is not None
    passage.circled(passing(p, course + 0.1), path, HOVER)
    assert passage.circle is None
    assert passage.circles == 1


def test_abeam_of_a_point_at_another_height_a_circle_through_it_climbs():
    passage = Passage(reach=16.0, height_reach=10.0, turns_left=True)
    low = passing((200.0, 0.0, 10.0))
    circle = passage.circled(low, PATH, HOVER).path
    assert (circle.start.z, circle.radius > 0.0) == (30.0, True)
    assert math.dist((circle.start.x, circle.start.y), (200.0, 0.0)) == pytest.approx(abs(circle.radius))
    assert not passage.is_passed(low, PATH, 0.0)
    assert not passage.is_passed(passing((200.0, 0.0, 24.9)), PATH, 0.0)
    assert not passage.is_passed(passing((200.0, 40.0, 30.0)), PATH, 0.0)
    assert passage.is_passed(passing((200.0, 0.0, 25.1)), PATH, 0.0)


def test_a_point_that_cannot_be_met_counts_as_passed_in_the_end():
    passage = Passage(reach=1.0, height_reach=10.0)
    missed = passing((200.0, 5.0, 30.0))
    for _ in range(3):
        assert passage.circled(missed, PATH, HOVER) is not None
        assert not passage.is_passed(missed, PATH, 0.0)
        passage.circle = None
    assert passage.circled(missed, PATH, HOVER) is None
    assert passage.is_passed(missed, PATH, 0.0)


def test_no_circle_begins_in_the_hover_or_without_a_course():
    passage = Passage(reach=16.0, height_reach=10.0)
    beside = leg((0.0, 0.0, 30.0), (0.0, 30.0, 30.0), SPEED, stop=False)
    assert passage.circled(passing((0.0, 0.0, 30.0), forward=False), beside, HOVER) is None
    assert passage.circled(passing((0.0, 0.0, 30.0), speed=4.0), beside, HOVER) is None
    assert passage.circled(passing((0.0, 0.0, 30.0)), beside, HOVER) is not None


def test_sides_and_distances():
    assert is_left_turn((0, 0, 0), (10, 0, 0), (10, 5, 0))
    assert not is_left_turn((0, 0, 0), (10, 0, 0), (10, -5, 0))
    assert flown_along(PATH, (50.0, 7.0, 0.0)) == (50.0, 200.0)
