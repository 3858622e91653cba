"""The flatness transform: the model inverts it, over speeds, forces and airframes."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sitl.control import flatness
from sitl.design.trim import level_trim
from sitl.model.aerodynamics import slopes, trimmed_slope
from sitl.model.airframe_files import load
from sitl.model.quaternions import Quaternion, hover, rotate, rotate_inverse, x_axis
from sitl.model.vectors import Vector, norm, subtract

SETS = {name: load(name).parameters for name in ("nominal", "collage")}
BLEND = (4.0, 7.0)
SETTLED = 1e-9
angles = st.floats(-math.pi, math.pi)


def settled(force, v_a, heading, a, ticks=60):
    """The transform once the incidence is found, as the law finds it tick by tick; None where it is not."""
    made = flatness.Flat(hover(heading), a.m * a.g)
    for _ in range(ticks):
        view = flatness.View(heading, made.attitude, *BLEND)
        before, made = made, flatness.transform(force, v_a, view, made.thrust, a)
        if norm(subtract(x_axis(made.attitude), x_axis(before.attitude))) < SETTLED:
            return made
    return None


def quasi_steady(q, thrust, v_a, a):
    """Force of the model for an attitude and a thrust, its elevons in trim, world [N]."""
    v = rotate_inverse(q, v_a)
    stream = slopes(v, 0.5 * thrust, 0.5 * thrust, a)
    ahead = (1.0 - a.S_ratio * a.C_d0) * thrust - stream.drag * v.x
    return rotate(q, Vector(ahead, 0.0, -trimmed_slope(stream, a) * v.z))


@pytest.mark.parametrize("name", SETS)
@given(
    speed=st.floats(0.0, 20.0), course=angles, climb=st.floats(-0.2, 0.4), ahead=st.floats(-2.0, 3.0),
    left=st.floats(-6.0, 6.0), up=st.floats(-3.0, 6.0),
)  # fmt: skip
def test_the_model_gives_the_force_back(name, speed, course, climb, ahead, left, up):
    a = SETS[name]
    c, s = math.cos(course), math.sin(course)
    v_a = Vector(speed * math.cos(climb) * c, speed * math.cos(climb) * s, speed * math.sin(climb))
    force = Vector(a.m * (ahead * c - left * s), a.m * (ahead * s + left * c), a.m * (a.g + up))
    made = settled(force, v_a, course, a)
    assume(made is not None)  # about the stall two incidences give one force
    assume(made.thrust > 0.0)
    slip = abs(rotate_inverse(made.attitude, v_a).y)
    given_back = quasi_steady(made.attitude, made.thrust, v_a, a)
    assert norm(subtract(given_back, force)) < 1e-6 * a.m * a.g
    assert slip < 1e-9 or speed < BLEND[1] + 1.0


@pytest.mark.parametrize("name", SETS)
def test_it_does_find_an_incidence_nearly_everywhere_in_level_flight(name):
    """So that the test above does test something."""
    a = SETS[name]
    weight = Vector(0.0, 0.0, a.m * a.g)
    found = [settled(weight, Vector(0.5 * step, 0.0, 0.0), 0.0, a) is not None for step in range(41)]
    assert sum(found) >= 36


@pytest.mark.parametrize("speed", [0.0, 3.0, 6.0, 9.0, 13.0, 17.0, 20.0])
def test_level_flight_of_the_linear_model_is_its_trim(speed):
    a = SETS["nominal"]
    made, trim = settled(Vector(0.0, 0.0, a.m * a.g), Vector(speed, 0.0, 0.0), 0.0, a), level_trim(a, speed)
    assert math.asin(x_axis(made.attitude).z) == pytest.approx(trim.theta, abs=0.01)
    assert made.thrust == pytest.approx(2.0 * trim.thrust, rel=0.1)


def test_a_wing_that_falls_is_not_leant_on():
    a = SETS["collage"]
    force, view = Vector(1.0, 0.0, a.m * a.g), flatness.View(0.0, hover(0.0), *BLEND)
    q = flatness.transform(force, Vector(0.0, 0.0, -flatness.CARRIES_NOT), view, 5.0, a).attitude
    assert norm(subtract(x_axis(q), Vector(1.0 / norm(force), 0.0, force.z / norm(force)))) < 1e-9
    shares = [flatness.carrying(Vector(3.0, 0.0, -sink)) for sink in (0.0, 5.0, 7.0, 9.0, 20.0)]
    assert shares == [1.0, 1.0, 0.5, 0.0, 0.0]


def test_the_attitude_before_decides_the_sign_and_where_nothing_else_does_the_span():
    a, last = SETS["collage"], hover(1.0)
    nothing = Vector(0.0, 0.0, 0.0)
    q = flatness.transform(Vector(0.0, 0.0, 5.0), nothing, flatness.View(1.0, last, *BLEND), 5.0, a).attitude
    assert sum(x * y for x, y in zip(q, last, strict=True)) == pytest.approx(1.0)
    along_the_force = flatness.View(0.0, last, *BLEND)
    y = flatness.span(Vector(5.0, 0.0, 0.0), nothing, along_the_force, a.m * a.g)
    assert y == pytest.approx(rotate(last, Vector(0.0, 1.0, 0.0)))


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
def test_the_left_wing_is_the_second_axis_of_the_attitude(numbers):
    q = Quaternion(*(n / math.hypot(*numbers) for n in numbers))
    assert flatness._y_axis(q) == pytest.approx(rotate(q, Vector(0.0, 1.0, 0.0)), abs=1e-12)
