"""Legs and circles in forward flight: headings, speeds, and when they are done."""

import math

import pytest

from protocol.limits import MIN_AIRSPEED
from sitl.control.reference import hover_at
from sitl.guidance.circles import circle_about, circle_ahead
from sitl.guidance.leg_speeds import corner_lead, leg_airspeeds
from sitl.guidance.legs import FlyLeg, LandAfter, crosswind_heading, leg_reference
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


def test_a_short_last_leg_slows_the_legs_before_it():
    points = [(0.0, 0.0, 30.0), (200.0, 0.0, 30.0), (215.0, 0.0, 30.0)]
    speeds = leg_airspeeds(points, 20.0, STILL)
    assert MIN_AIRSPEED <= speeds[1] < 20.0
    assert speeds[0] <= 20.0
    assert leg_airspeeds([points[0], (900.0, 0.0, 30.0)], 20.0, STILL) == [20.0]


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
