"""References of a plan's aims: where the hover is sent, how its altitude moves, and where it is not sent."""

import math

import pytest

from protocol.dialect.vocabulary import LegMode
from protocol.flight_plans.flight_plan import EnuPoint
from sitl.autopilot.flight_plan.aims import Aim, AimKey, AimKind
from sitl.autopilot.flight_plan.plan_state import PlanFrame, PlanInputs
from sitl.autopilot.flight_plan.steering import PlanSteering
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS
from sitl.control.reference import hover_at
from sitl.guidance.view import MIN_HOLD_HEIGHT
from tests.support.vehicle.plan_ticks import WORLD, view_at

START = hover_at((0.0, 0.0, 2.0), 0.0)


def steered(aim, p=(0.0, 0.0, 2.0), *, steering=None, seconds=0.02, world=WORLD, landed=False, settings=None):
    """The reference for an aim, of a vehicle that stays at a point east, north and up, after some time."""
    steering = steering or PlanSteering()
    reference = START
    for step in range(round(seconds / 0.02)):
        inputs = PlanInputs(view_at(0.02 * (step + 1), p, landed=landed), world, settings or Settings(), flying=True)
        reference = steering.update(aim, inputs, reference, 0.5, 3.0, LegMode.NONE)
    return reference, steering


def level(reference):
    """East and north of a reference."""
    return (-reference.position.y, reference.position.x)


def test_a_point_is_flown_to_as_it_is_with_the_altitude_at_a_rate():
    aim = Aim(AimKind.POINT, AimKey(1), end=EnuPoint(3.0, 4.0, 6.0))
    reference, _ = steered(aim)
    assert level(reference) == (3.0, 4.0)
    assert reference.position.z == pytest.approx(2.0 + 2.5 * 0.02)
    assert (reference.heading, reference.speed) == (0.5, 3.0)
    assert steered(aim, seconds=5.0)[0].position.z == 6.0


def test_the_plan_may_have_another_origin_than_the_world():
    frame = PlanFrame(east=10.0, north=-20.0)
    reference, _ = steered(Aim(AimKind.POINT, AimKey(1), end=EnuPoint(3.0, 4.0, 2.0)), steering=PlanSteering(frame))
    assert level(reference) == (13.0, -16.0)
    assert frame.to_plan(frame.to_world(EnuPoint(1.0, 2.0, 3.0))) == (1.0, 2.0, 3.0)


def test_a_leg_leads_ahead_along_it_and_ends_at_its_end():
    leg = Aim(AimKind.LEG, AimKey(1), start=EnuPoint(0.0, 0.0, 2.0), end=EnuPoint(0.0, 10.0, 4.0))
    assert level(steered(leg, (1.0, 2.0, 2.0))[0]) == pytest.approx((0.0, 5.0))
    assert level(steered(leg, (0.0, 9.0, 2.0))[0]) == pytest.approx((0.0, 10.0))
    assert level(steered(leg, (0.0, -9.0, 2.0))[0]) == pytest.approx((0.0, 0.0))
    assert steered(leg, (0.0, 5.0, 2.0), seconds=5.0)[0].position.z == pytest.approx(3.0)


@pytest.mark.parametrize("radius", [2.0, -2.0])
def test_an_arc_leads_round_in_its_sense_on_the_circle_and_slowly(radius):
    arc = Aim(AimKind.ARC, AimKey(1), end=EnuPoint(1.0, 0.0, 2.0), radius=radius)
    reference, _ = steered(arc, (1.0, 5.0, 2.0))
    x, y = level(reference)
    assert math.hypot(x - 1.0, y) == pytest.approx(2.0)
    assert (x - 1.0) * radius > 0.0
    assert reference.speed == pytest.approx(math.sqrt(1.6))


def test_a_course_leads_straight_on():
    course = Aim(
        AimKind.COURSE, AimKey(1), start=EnuPoint(0.0, 0.0, 2.0), end=EnuPoint(0.0, 0.0, 2.0), course=math.radians(90.0)
    )
    assert level(steered(course, (7.0, 1.0, 2.0))[0]) == pytest.approx((12.0, 0.0))


def test_a_climb_leads_the_vehicle_by_a_metre_at_most():
    climb = Aim(AimKind.POINT, AimKey(1), climb=0.5)
    assert steered(climb, seconds=1.0)[0].position.z == pytest.approx(2.5)
    assert steered(climb, seconds=20.0)[0].position.z == pytest.approx(3.0)


def test_a_descent_is_slower_near_the_ground_and_leads_into_it():
    sink = Aim(AimKind.POINT, AimKey(1), climb=-2.0)
    high, low = (steered(sink, (0.0, 0.0, z), seconds=0.4)[0].position.z for z in (5.0, 1.0))
    assert 5.0 - high == pytest.approx(0.8)
    assert 1.0 - low == pytest.approx(0.2)
    reference, steering = steered(sink, (0.0, 0.0, 0.12), seconds=5.0)
    assert reference.position.z < 0.0
    assert steering.sinks_to_ground


def test_no_altitude_is_held_below_that_of_a_hold():
    reference, _ = steered(Aim(AimKind.POINT, AimKey(1), end=EnuPoint(0.0, 0.0, 0.0)), seconds=5.0)
    assert reference.position.z == MIN_HOLD_HEIGHT


def test_a_take_off_rises_straight_up_first():
    steering = PlanSteering()
    aim = Aim(AimKind.POINT, AimKey(1), end=EnuPoint(3.0, 4.0, 2.0))
    steered(aim, (0.5, 0.0, 0.12), steering=steering, landed=True)
    assert level(steered(aim, (0.6, 0.1, 0.6), steering=steering)[0]) == pytest.approx((0.5, 0.0))
    assert level(steered(aim, (0.6, 0.1, 1.6), steering=steering)[0]) == pytest.approx((3.0, 4.0))


def test_it_is_not_sent_out_of_the_arena():
    world = WORLD._replace(arena=ARENAS["voliere"])
    reference, steering = steered(Aim(AimKind.POINT, AimKey(1), end=EnuPoint(9.0, 0.0, 2.0)), world=world, seconds=0.1)
    assert level(reference) == (0.0, 0.0)
    assert "outside the arena" in steering.refused
    inside, steering = steered(
        Aim(AimKind.POINT, AimKey(1), end=EnuPoint(3.0, 0.0, 2.0)), world=world, steering=steering
    )
    assert level(inside) == (3.0, 0.0)
    assert steering.refused == ""


def test_a_velocity_moves_the_reference():
    aim = Aim(AimKind.VELOCITY, AimKey(1), start=EnuPoint(0.0, 0.0, 2.0), end=EnuPoint(0.5, -1.0, 2.0))
    reference, _ = steered(aim, seconds=2.0)
    assert level(reference) == pytest.approx((1.0, -2.0), abs=0.05)


@pytest.mark.parametrize(("forward", "sinks"), [(True, False), (False, True)])
def test_only_what_has_left_forward_flight_sinks_to_the_ground(forward, sinks):
    aim, steering = Aim(AimKind.POINT, AimKey(1), end=EnuPoint(0.0, 0.0, 20.0), climb=-1.0), PlanSteering()
    for step in range(50):
        view = view_at(0.02 * (step + 1), (0.0, 0.0, 20.0))._replace(forward=forward)
        inputs = PlanInputs(view, WORLD, Settings(), flying=True)
        reference = steering.update(aim, inputs, START, 0.5, 3.0, LegMode.NONE)
    assert (reference.position.z < 19.5) == sinks
