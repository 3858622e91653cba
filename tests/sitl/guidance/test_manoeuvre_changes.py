"""The end of a manoeuvre is moved while it is flown."""

import pytest

from sitl.control.reference import hover_at
from sitl.guidance.legs import FlyLeg, leg_reference
from sitl.guidance.manoeuvre_changes import end_at_heading, moved_end
from sitl.guidance.manoeuvres import FlyTo, ManoeuvreSequence, Ramp

START, END, NEAR = (0.0, 0.0, 20.0), (150.0, 0.0, 20.0), (150.0, 3.0, 24.0)


def leg(**options):
    return FlyLeg(leg_reference(START, END, hover_at(START, 0.0), 15.0, stop=True), 0.5, **options)


def test_a_leg_under_way_is_led_to_the_new_end_on_its_own_line_and_chooses_its_heading():
    way = leg(arrived=3.0)
    moved = moved_end(way, hover_at(NEAR, 1.0), turns=False)
    path = moved.reference.path
    assert moved is way
    assert (path.start, path.end, moved.reference.position, path.stop) == (START, NEAR, NEAR, True)
    assert moved.reference.heading == pytest.approx(0.02, abs=0.001)
    assert not moved.keep_heading
    assert moved.arrived is None


def test_a_heading_that_was_asked_for_is_kept_when_the_end_moves():
    way = moved_end(leg(), hover_at(END, 1.0), turns=True)
    assert (way.reference.heading, way.keep_heading) == (1.0, True)
    assert moved_end(way, hover_at(NEAR, 0.0), turns=False).reference.heading == 1.0


def test_after_the_leg_the_rest_is_hovered():
    target = hover_at(NEAR, 1.0)
    rest = moved_end(leg(upright=True), target, turns=False)
    assert isinstance(rest, FlyTo)
    assert rest.reference == target


def test_of_a_sequence_the_last_step_ends_elsewhere():
    climb = Ramp(hover_at(START, 0.0), 1.0)
    way = ManoeuvreSequence((climb, FlyTo(hover_at(END, 0.0), 0.5)))
    moved_end(way, hover_at(NEAR, 1.0), turns=True)
    assert way.steps[0] is climb
    assert way.steps[1].reference == hover_at(NEAR, 1.0)
    way.steps = (climb, leg())
    end_at_heading(way, 2.0)
    assert way.steps[1].keep_heading
