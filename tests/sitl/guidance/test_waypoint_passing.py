"""A waypoint in forward flight is passed near enough, or a circle is flown first."""

import math

import pytest

from sitl.control.reference import hover_at, leg
from sitl.guidance.leg_speeds import CORNER_ACCELERATION
from sitl.guidance.legs import Passage, can_meet, flown_along, is_left_turn, turn_radius
from sitl.guidance.view import VehicleView

SPEED = 15.0
PATH = leg((0.0, 0.0, 30.0), (200.0, 0.0, 30.0), SPEED, stop=False)
HOVER = hover_at((200.0, 0.0, 30.0), 0.0)
RADIUS = SPEED**2 / CORNER_ACCELERATION


def view(p, course=0.0, *, forward=True, speed=SPEED):
    v = (speed * math.cos(course), speed * math.sin(course), 0.0)
    return VehicleView(0.0, p, v, course, 1.5, landed=False, battery_remaining=1.0, forward=forward)


def test_a_waypoint_is_passed_abeam_of_it_within_its_radius_and_height():
    passage = Passage(reach=16.0, height_reach=10.0)
    assert not passage.is_passed(view((199.0, 0.0, 30.0)), PATH, 0.0)
    assert passage.is_passed(view((200.0, 15.9, 39.9)), PATH, 0.0)
    assert not passage.is_passed(view((200.0, 16.1, 30.0)), PATH, 0.0)
    assert not passage.is_passed(view((200.0, 0.0, 40.1)), PATH, 0.0)


def test_a_turn_begins_before_it_only_on_the_leg_and_at_its_height():
    sloping = leg((0.0, 0.0, 0.0), (200.0, 0.0, 100.0), SPEED, stop=False)
    passage = Passage(reach=16.0, height_reach=10.0)
    assert not passage.is_passed(view((159.0, 0.0, 80.0)), sloping, 40.0)
    assert passage.is_passed(view((160.0, 0.0, 80.0)), sloping, 40.0)
    assert not passage.is_passed(view((160.0, 0.0, 69.0)), sloping, 40.0)
    assert not passage.is_passed(view((160.0, 17.0, 80.0)), sloping, 40.0)


def test_what_lies_within_the_circle_of_a_turn_cannot_be_met():
    here = view((0.0, 0.0, 30.0))
    assert turn_radius(here, SPEED) == pytest.approx(RADIUS)
    assert can_meet(here, (100.0, 0.0, 30.0), RADIUS, 16.0)
    assert can_meet(here, (0.0, 2.0 * RADIUS, 30.0), RADIUS, 1.0)
    assert not can_meet(here, (0.0, RADIUS, 30.0), RADIUS, 16.0)
    assert not can_meet(here, (0.0, -RADIUS, 30.0), RADIUS, 16.0)


@pytest.mark.parametrize(("side", "sense"), [(30.0, -1.0), (-30.0, 1.0)])
def test_before_a_point_beside_a_circle_leads_away_until_the_course_leads_there(side, sense):
    path = leg((0.0, 0.0, 30.0), (0.0, side, 30.0), SPEED, stop=False)
    passage = Passage(reach=16.0, height_reach=10.0)
    circle = passage.circled(view((0.0, 0.0, 30.0)), path, HOVER).path
    assert math.copysign(1.0, circle.radius) == sense
    assert math.copysign(1.0, circle.start.y) == -math.copysign(1.0, side)
    p = (circle.start.x - abs(circle.radius), circle.start.y, 30.0)
    course = math.atan2(side - p[1], -p[0])
    assert passage.circled(view(p, course + 0.5), path, HOVER) is not None
    passage.circled(view(p, course + 0.1), path, HOVER)
    assert passage.circle is None
    assert passage.circles == 1


def test_abeam_of_a_point_at_another_height_a_circle_through_it_climbs():
    passage = Passage(reach=16.0, height_reach=10.0, turns_left=True)
    low = view((200.0, 0.0, 10.0))
    circle = passage.circled(low, PATH, HOVER).path
    assert (circle.start.z, circle.radius > 0.0) == (30.0, True)
    assert math.dist((circle.start.x, circle.start.y), (200.0, 0.0)) == pytest.approx(abs(circle.radius))
    assert not passage.is_passed(low, PATH, 0.0)
    assert not passage.is_passed(view((200.0, 0.0, 24.9)), PATH, 0.0)
    assert not passage.is_passed(view((200.0, 40.0, 30.0)), PATH, 0.0)
    assert passage.is_passed(view((200.0, 0.0, 25.1)), PATH, 0.0)


def test_a_point_that_cannot_be_met_counts_as_passed_in_the_end():
    passage = Passage(reach=1.0, height_reach=10.0)
    missed = view((200.0, 5.0, 30.0))
    for _ in range(3):
        assert passage.circled(missed, PATH, HOVER) is not None
        assert not passage.is_passed(missed, PATH, 0.0)
        passage.circle = None
    assert passage.circled(missed, PATH, HOVER) is None
    assert passage.is_passed(missed, PATH, 0.0)


def test_no_circle_begins_in_the_hover_or_without_a_course():
    passage = Passage(reach=16.0, height_reach=10.0)
    beside = leg((0.0, 0.0, 30.0), (0.0, 30.0, 30.0), SPEED, stop=False)
    assert passage.circled(view((0.0, 0.0, 30.0), forward=False), beside, HOVER) is None
    assert passage.circled(view((0.0, 0.0, 30.0), speed=4.0), beside, HOVER) is None
    assert passage.circled(view((0.0, 0.0, 30.0)), beside, HOVER) is not None


def test_sides_and_distances():
    assert is_left_turn((0, 0, 0), (10, 0, 0), (10, 5, 0))
    assert not is_left_turn((0, 0, 0), (10, 0, 0), (10, -5, 0))
    assert flown_along(PATH, (50.0, 7.0, 0.0)) == (50.0, 200.0)
