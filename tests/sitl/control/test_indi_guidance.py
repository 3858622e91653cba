"""INDI's guidance: one formula for hover, cruise and stop, within its limits."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect.vocabulary import Law
from sitl.control import indi_guidance as guidance
from sitl.control.reference import along, circle, hover_at, leg
from sitl.design.gains import indi_gains
from sitl.model.airframe_files import load
from sitl.model.vectors import Vector, level_norm
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import INDI, Tuning
from tests.support.flights.estimates import estimate

A = load("collage").parameters
GAINS = indi_gains().guidance
HERE = hover_at((0.0, 0.0, 50.0), 0.0)
far = st.floats(-300.0, 300.0)
fast = st.floats(-20.0, 20.0)


def asked(p, v, reference, course=0.0, elevon=0.0):
    seen = estimate(p, v, actuators=(600.0, 600.0, elevon, elevon))
    return guidance.wanted_acceleration(seen, seen.velocity, reference, course, GAINS, A)


def flying(length=400.0, airspeed=15.0):
    return along(HERE, leg((0.0, 0.0, 50.0), (length, 0.0, 50.0), airspeed), 0.0)._replace(
        position=Vector(length, 0.0, 50.0)
    )


def test_at_rest_at_the_reference_it_asks_for_nothing():
    assert asked((0.0, 0.0, 50.0), (0.0, 0.0, 0.0), HERE) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


@given(distance=st.floats(0.0, 300.0))
def test_the_stopping_speed_is_continuous_and_its_way_takes_the_planned_deceleration(distance):
    step = 1e-4
    v, nearer = (guidance.stopping_speed(d, GAINS) for d in (distance + step, distance))
    assert 0.0 <= v - nearer <= 1.01 * GAINS.k_p * step
    assert v * (v - nearer) / step <= 1.01 * GAINS.brake


@pytest.mark.parametrize("beyond", [0.0, 0.5, 5.0])
def test_the_stopping_speed_grows_more_slowly_from_twelve_metres_a_second_on(beyond):
    near = GAINS.brake / GAINS.k_p**2
    distance = 0.5 * (near + 12.0**2 / GAINS.brake)
    speed = guidance.stopping_speed(distance + beyond, GAINS)
    assert speed == pytest.approx(math.sqrt(12.0**2 + 2.0 * GAINS.brake_fast * beyond))


@pytest.mark.parametrize(("speed", "most"), [(0.4, 3.0), (0.6, 1.0)])
def test_from_half_a_metre_a_second_on_the_velocity_is_the_course_to_turn_from(speed, most):
    target, gains = hover_at((0.0, 100.0, 50.0), 0.0, 10.0), GAINS._replace(max_forward=3.0, min_turn=1.0)
    seen = estimate((0.0, 0.0, 50.0), (speed, 0.0, 0.0))
    assert guidance.wanted_acceleration(seen, seen.velocity, target, 0.0, gains, A).y == pytest.approx(most)


@given(x=far, y=far, z=st.floats(-100.0, 100.0), vx=fast, vy=fast, vz=st.floats(-10.0, 10.0), forward=st.booleans())
def test_no_acceleration_leaves_its_limits(x, y, z, vx, vy, vz, forward):
    wanted = asked((x, y, z), (vx, vy, vz), flying() if forward else HERE)
    most = math.hypot(max(guidance.MAX_BRAKING_FACTOR * GAINS.brake, GAINS.max_forward), GAINS.max_turn)
    assert level_norm(wanted.x, wanted.y) <= most + 1e-9
    assert -GAINS.max_down <= wanted.z <= GAINS.max_up


def test_on_the_stopping_curve_it_brakes_as_planned():
    here = HERE._replace(speed=6.0)  # 5 m before the end the curve is at 4 m/s
    for distance, planned in ((5.0, GAINS.brake), (30.0, GAINS.brake), (60.0, GAINS.brake_fast)):
        v = guidance.stopping_speed(distance, GAINS)
        wanted = asked((-distance, 0.0, 50.0), (v, 0.0, 0.0), here)
        assert wanted.x == pytest.approx(-planned, abs=0.01)


def test_a_leg_is_flown_at_its_speed_and_its_end_is_stopped_at():
    assert asked((100.0, 0.0, 50.0), (15.0, 0.0, 0.0), flying()) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert asked((390.0, 0.0, 50.0), (15.0, 0.0, 0.0), flying()).x < -GAINS.brake
    onto = asked((100.0, 10.0, 50.0), (15.0, 0.0, 0.0), flying())  # 10 m to its left
    assert onto.y < -1.0


def test_a_circle_takes_its_centripetal_acceleration():
    reference = along(HERE, circle((0.0, 0.0, 50.0), 60.0, 15.0), 0.0)
    wanted = asked((60.0, 0.0, 50.0), (0.0, 15.0, 0.0), reference, course=0.5 * math.pi)
    assert wanted.x == pytest.approx(-(15.0**2) / 60.0, rel=0.05)


def test_a_way_that_the_belly_does_not_face_is_begun_slowly():
    ahead, aside = (asked((0.0, 0.0, 50.0), (1.5, 0.0, 0.0), flying(), course).x for course in (0.0, 2.0))
    assert ahead == GAINS.max_forward
    assert aside == pytest.approx(0.0, abs=1e-9)


def test_braking_that_leaves_the_elevons_no_travel_climbs():
    level = asked((0.0, 0.0, 50.0), (6.0, 0.0, 0.0), HERE)
    used = asked((0.0, 0.0, 50.0), (6.0, 0.0, 0.0), HERE, elevon=A.delta_max)
    above = asked((0.0, 0.0, 50.0 + GAINS.max_climb), (6.0, 0.0, 0.0), HERE, elevon=A.delta_max)
    cruise = asked((100.0, 0.0, 50.0), (15.0, 0.0, 0.0), flying(), elevon=A.delta_max)
    assert cruise.z == pytest.approx(0.0, abs=1e-9)
    assert level.z == pytest.approx(0.0, abs=1e-9)
    assert used.z == pytest.approx(GAINS.k_vz * GAINS.climb)
    assert above.z <= 0.0


@pytest.mark.parametrize("rise", [-1.0, 0.0, 0.5 * GAINS.climb])
def test_with_the_elevons_at_their_stops_braking_climbs_at_the_planned_speed_whatever_rise_was_wanted(rise):
    stops = estimate((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), actuators=(600.0, 600.0, A.delta_max, A.delta_max))
    assert guidance._relieved(rise, 0.0, 1.0, stops, GAINS, A) == pytest.approx(GAINS.climb)


def aimed(p, v, reference, course=0.0):
    return guidance.aim(Vector(*p), Vector(*v), Vector(0.0, 0.0, 0.0), reference, course, GAINS)


def test_a_way_that_the_belly_faces_is_begun_with_the_speed_wanted_and_not_more():
    for course in (0.0, math.acos(guidance.FACES) - 1e-9):
        assert aimed((0.0, 0.0, 50.0), (1.0, 0.0, 0.0), flying(), course).speed == pytest.approx(15.0)
    assert aimed((0.0, 0.0, 50.0), (1.0, 0.0, 0.0), flying(), math.acos(guidance.FACES_NOT)).speed == pytest.approx(
        guidance.SIDEWAYS
    )


@pytest.mark.parametrize(
    ("limit", "speed", "wanted"), [(0.5, 0.6, 0.5), (0.5, 5.9, 0.5), (3.0, 3.3, 3.0), (0.5, 9.0, 9.0)]
)
def test_no_speed_is_kept_above_the_limit_of_the_hover_but_that_of_a_flight(limit, speed, wanted):
    there = hover_at((60.0, 0.0, 50.0), 0.0, limit)
    assert aimed((0.0, 0.0, 50.0), (speed, 0.0, 0.0), there).speed == wanted


def test_the_braking_of_a_hover_sets_in_gradually():
    there = hover_at((0.0, 0.0, 50.0), 0.0, 1.0)
    fed = [aimed((-0.01 * k, 0.0, 50.0), (1.0, 0.0, 0.0), there).brake for k in range(60, 110)]
    assert fed[0] > 0.5
    assert fed[-1] == 0.0
    assert max(abs(b - a) for a, b in itertools.pairwise(fed)) < 0.05


def test_braking_is_fed_forward_by_degrees_above_a_share_of_the_speed_wanted():
    reference = hover_at((30.0, 0.0, 50.0), 0.0, 30.0)
    wanted = aimed((0.0, 0.0, 50.0), (0.0, 0.0, 0.0), reference).speed
    assert wanted == guidance.stopping_speed(30.0, GAINS)
    half = 0.5 * (guidance.FOLLOWS + 1.0)
    for share, fed in ((guidance.FOLLOWS, 0.0), (half, 0.5 * GAINS.brake), (1.0, GAINS.brake), (1.2, GAINS.brake)):
        found = aimed((0.0, 0.0, 50.0), (share * wanted, 0.0, 0.0), reference).brake
        assert found == pytest.approx(fed, abs=1e-9)


@given(speed=st.floats(0.0, 25.0))
def test_the_stopping_distance_is_the_distance_of_that_stopping_speed(speed):
    distance = guidance.stopping_distance(speed, GAINS)
    assert guidance.stopping_speed(distance, GAINS) == pytest.approx(speed, abs=1e-6)


@pytest.mark.parametrize("speed", [0.5, 1.5, 2.5])
def test_a_point_that_moves_away_is_followed_at_its_speed(speed):
    """It swung about that speed by a quarter of it."""
    flown = Simulation(load("nominal").parameters, start=Start(up=50.0, airborne=True), tuning=Tuning(controller=INDI))
    flown.begin_flight(Law.INDI)
    speeds = []
    for k in range(500):
        flown.reference = hover_at((0.02 * speed * k, 0.0, 50.0), 0.0, 3.0)
        flown.step(0.02)
        speeds.append(flown.truth.body.velocity.x)
    assert speeds[300:] == pytest.approx([speed] * 200, abs=0.1)


@pytest.mark.parametrize("rise", [0.5, -0.5])
def test_a_vertical_speed_at_the_altitude_wanted_is_taken_away(rise):
    assert asked((0.0, 0.0, 50.0), (0.0, 0.0, rise), HERE).z == pytest.approx(-GAINS.k_vz * rise)
