"""The alignment: where it holds, and that it is the zero-moment law with the heading of the path."""

from sitl.control import align
from sitl.control.allocation import allocate
from sitl.control.forward_flight.forward_guidance import air_course
from sitl.control.hover_zero_moment import HoverGoal, Pointing, fly_to
from sitl.control.reference import along, leg
from sitl.design.gains import zero_moment_gains
from sitl.model.airframe_files import load
from sitl.model.quaternions import hover
from tests.support.flights.estimates import estimate, reference, vector

A = load("nominal").parameters
GAINS = zero_moment_gains(A)
DT = 0.002


def test_it_holds_where_the_vehicle_would_be_in_half_a_second():
    assert align.start_hold(estimate((1, 2, 3), (2, 0, -1))) == vector((2.0, 2.0, 2.5))


def test_it_is_the_zero_moment_law_at_the_place_with_the_heading_of_the_path():
    seen = estimate((1, 2, 30), (0.2, 0.1, 0.0), hover(0.3), wind=(2.0, -1.0, 0.0))
    asked = along(reference(), leg((0.0, 0.0, 30.0), (100.0, 80.0, 30.0), 12.0), 0.5)
    pointing, hold = Pointing(hover(0.2), 5.0), vector((1.0, 2.0, 30.0))
    command, saturation, after = align.step(seen, asked, GAINS, A, align.AlignState(pointing, hold, 0.1), DT)
    assert after.hold == hold
    assert after.course == air_course(seen, asked, 0.1)
    u, expected = fly_to(seen, HoverGoal(hold, after.course, asked.speed), GAINS, pointing, DT)
    assert (command, saturation) == allocate(u, A)
    assert after.pointing == expected
