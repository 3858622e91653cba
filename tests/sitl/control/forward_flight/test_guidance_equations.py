"""The guidance of forward flight against a second transcription of its equations, in numbers."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.braking import Stop, brake
from sitl.control.forward_flight.forward_guidance import (
    MotionInAir,
    cruise,
    ground_speed,
    stop_within,
    stopping_distance,
)
from sitl.control.reference import circle, height, leg, line_of_sight
from sitl.design.gains import BRAKE_AIR, BRAKE_CLIMB, BRAKE_RATE, line_of_sight_gains
from sitl.model.vectors import Vector
from tests.support.flights.estimates import vector

GAINS = line_of_sight_gains().guidance._replace(  # no two alike
    k_v=0.9, k_i=0.35, max_integral=3.7, max_forward=2.9, min_turn=3.1, max_turn=7.9, k_z=0.65, k_vz=1.45
)
DT = 0.02
PATHS = {
    "level": leg((0, 0, 50), (500, 100, 50), 15.0),
    "climbing": leg((0, 0, 30), (300, -200, 80), 12.0, level=40.0, low=5.0),
    "goes on": leg((0, 0, 30), (0, 300, 20), 9.0, stop=False),
    "circle": circle((50, 50, 40), 60.0, 14.0),
    "other way round": circle((50, 50, 40), -45.0, 14.0),
}
places = st.builds(Vector, st.floats(-100.0, 400.0), st.floats(-200.0, 200.0), st.floats(5.0, 90.0))
velocities = st.builds(Vector, *[st.floats(-16.0, 16.0)] * 2, st.floats(-5.0, 5.0))
winds = st.builds(Vector, *[st.floats(-5.0, 5.0)] * 2, st.floats(-1.0, 1.0))
integrals = st.builds(Vector, *[st.floats(-2.5, 2.5)] * 3)
by_path = pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)


def rate(airspeed):
    return float(np.interp(airspeed, BRAKE_AIR, BRAKE_RATE))


def clip(x, low, high):
    return min(max(x, low), high)


def cruised(p, v, wind, path, integral):
    """Acceleration and integral, with the line of sight and the height of the path as they are."""
    speed = math.hypot(v.x, v.y)
    sight = np.array(line_of_sight(path, p, speed))
    along_wind = float(sight @ wind[:2])
    wanted = along_wind + math.sqrt(max(path.airspeed**2 - (wind.x**2 + wind.y**2 - along_wind**2), 0.0))
    wanted = max(wanted, 1.0)
    z, slope = height(path, p)
    rise = clip(slope * speed + 0.65 * (z - p.z), -GAINS.max_sink, GAINS.max_rise)
    up = 1.45 * (rise - v.z)
    if speed < 4.0:
        level = 0.9 * (wanted * sight - v[:2])
        size = np.linalg.norm(level)
        return (*(level * min(1.0, 2.9 / size) if size > 0.0 else level), up), integral
    ahead = np.array(v[:2]) / speed
    left = np.array((-ahead[1], ahead[0]))
    angle = math.atan2(sight @ left, sight @ ahead)
    airspeed = float(np.linalg.norm(np.subtract(v, wind)))
    along = clip(0.9 * (wanted - speed), -1.4 * rate(airspeed), 2.9)
    most = min(7.9, max(3.1, 7.9 * (airspeed / 12.0) ** 2))
    turn = 1.25 * 0.9 * speed * angle + (speed**2 / path.radius if path.radius else 0.0)
    error = np.array((wanted * (sight @ ahead) - speed, wanted * (sight @ left), rise - v.z))
    if abs(angle) > 0.5:
        after = np.zeros(3)
    elif np.linalg.norm(error) >= 4.0:
        after = np.array(integral)
    else:
        after = np.array(integral) + DT * 0.35 * error
        after *= min(1.0, 3.7 / max(np.linalg.norm(after), 1e-9))
    level = (along + after[0]) * ahead + (clip(turn, -most, most) + after[1]) * left
    return (*level, up + after[2]), after


@pytest.mark.long(after=1)
@by_path
@given(p=places, v=velocities, wind=winds, integral=integrals)
def test_the_cruise(path, p, v, wind, integral):
    expected, learnt = cruised(p, v, wind, path, integral)
    asked, after = cruise(MotionInAir(p, v, wind), path, integral, DT, GAINS)
    assert asked == pytest.approx(expected, abs=1e-8)
    assert after == pytest.approx(learnt, abs=1e-9)


@by_path
@given(share=st.floats(0.1, 0.9), off=st.tuples(*[st.floats(-3.0, 3.0)] * 3), wind=winds, integral=integrals)
def test_the_cruise_near_its_path(path, share, off, wind, integral):
    """Near the path the integral learns."""
    if path.radius:
        angle = 6.0 * share
        on = np.array(path.start) + abs(path.radius) * np.array((math.cos(angle), math.sin(angle), 0.0))
    else:
        on = np.array(path.start) + share * np.subtract(path.end, path.start)
    p = vector(on + 0.3 * np.array(off))
    north, west = line_of_sight(path, p, 12.0)
    speed = ground_speed(north, west, wind, path.airspeed)
    v = vector(np.array((speed * north, speed * west, 0.0)) + 0.5 * np.array(off))
    expected, learnt = cruised(p, v, wind, path, integral)
    asked, after = cruise(MotionInAir(p, v, wind), path, integral, DT, GAINS)
    assert asked == pytest.approx(expected, abs=1e-8)
    assert after == pytest.approx(learnt, abs=1e-9)


def test_from_four_metres_per_second_on_the_cruise_learns():
    path, p, none = leg((0, 0, 50), (500, 0, 50), 6.0), Vector(100.0, 0.0, 50.0), Vector(0.0, 0.0, 0.0)
    learnt = [
        cruise(MotionInAir(p, Vector(speed, 0.0, 0.0), none), path, none, DT, GAINS)[1] for speed in (3.999999, 4.0)
    ]
    assert learnt == [none, pytest.approx((DT * 0.35 * 2.0, 0.0, 0.0))]


@given(speed=st.floats(0.01, 20.0), tail=st.floats(-5.0, 5.0), cross=st.floats(-5.0, 5.0))
def test_the_stopping_distance_is_the_integral_of_the_braking_table(speed, tail, cross):
    """In 24 cells, none of which is shorter than the creep near the end takes."""
    middles = (np.arange(24) + 0.5) * speed / 24
    rates = np.interp(np.hypot(middles - tail, cross), BRAKE_AIR, BRAKE_RATE)
    cells = np.maximum(middles * speed / 24 / rates, speed / 24 / GAINS.near)
    assert stopping_distance(speed, tail, cross, GAINS) == pytest.approx(cells.sum(), rel=1e-9)


def test_at_rest_nothing_is_left_to_stop():
    assert stopping_distance(0.0, 3.0, 1.0, GAINS) == 0.0
    assert stopping_distance(1e-7, 3.0, 1.0, GAINS) == 0.0


@pytest.mark.parametrize(("left", "due"), [(0.5, False), (0.002, False), (0.0009, True), (0.0, True), (-0.5, True)])
def test_who_hangs_before_the_end_has_not_reached_it(left, due):
    path = leg((0, 0, 50), (100, 0, 50), 15.0)
    at = Vector(100.0 - left, 0.0, 50.0)
    assert stop_within(MotionInAir(at, Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)), path, 1.0, GAINS) == due


def test_flying_away_from_the_end_needs_no_braking():
    path = leg((0, 0, 50), (100, 0, 50), 15.0)
    at, away = Vector(90.0, 0.0, 50.0), Vector(-15.0, 0.0, 0.0)
    assert not stop_within(MotionInAir(at, away, Vector(0.0, 0.0, 0.0)), path, 1.0, GAINS)


@given(speed=st.floats(1.0, 18.0), wind=winds, aside=st.floats(-60.0, 60.0), left=st.floats(2.0, 120.0))
def test_braking_is_reckoned_along_the_straight_way_to_the_end(speed, wind, aside, left):
    path = leg((-300, 0, 50), (0, 0, 50), 15.0)
    p, v = Vector(-left, aside, 50.0), Vector(speed, 1.0, 0.0)
    way = np.array((left, -aside)) / math.hypot(left, aside)
    closing = max(float(way @ v[:2]), 0.0)
    along, across = float(way @ wind[:2]), float(wind.x * way[1] - wind.y * way[0])
    needed = stopping_distance(closing, along, across, GAINS)
    for room in (0.5, 1.0, 2.0):
        if abs(room * needed - math.hypot(left, aside)) > 1e-6:
            assert stop_within(MotionInAir(p, v, wind), path, room, GAINS) == (room * needed > math.hypot(left, aside))


def braked(p, v, wind, path, travel, integral):
    """Acceleration and integral of the climbing stop, with the speed that the braking profile allows."""
    way = np.array((path.end.x - p.x, path.end.y - p.y))
    distance = float(np.linalg.norm(way))
    way /= distance
    along, across = float(way @ wind[:2]), float(wind.x * way[1] - wind.y * way[0])
    airspeed = float(np.linalg.norm(np.subtract(v, wind)))
    closing = float(way @ v[:2])
    wanted = min(profile(distance, max(path.airspeed + along, 4.0), along, across), max(closing, GAINS.creep))
    forward = 0.9 * (wanted - closing)
    if closing > 0.7 * wanted and distance > 1.0:
        forward -= min(rate(airspeed), GAINS.near * max(closing, 0.0))
    forward = clip(forward, -1.4 * rate(airspeed), 2.9)
    side = clip(0.9 * (v.x * way[1] - v.y * way[0]), -3.1, 3.1)
    rise = climbing(p.z - path.end.z, math.hypot(v.x, v.y), airspeed, travel)
    after = clip(integral.z + DT * 0.35 * clip(rise - v.z, -2.0, 2.0), -3.7, 3.7)
    level = forward * way + side * np.array((-way[1], way[0]))
    return (*level, clip(1.5 * (rise - v.z) + after, -3.0, 5.0)), (0.0, 0.0, after)


def profile(distance, limit, along, across):
    """The speed from which the braking table stops within a distance, by cells of a 48th of the limit."""
    step, total = limit / 48, 0.0
    for i in range(48):
        middle = (i + 0.5) * step
        part = max(middle * step / rate(math.hypot(middle - along, across)), step / GAINS.near)
        if total + part > distance:
            return min(step * (i + max(0.0, (distance - total) / part)), distance * GAINS.near)
        total += part
    return limit


def climbing(above, speed, airspeed, travel):
    rise = clip(-above, -2.2, 2.0)
    need = max((travel - 0.7) / 0.2, 0.0)
    climb = float(np.interp(airspeed, BRAKE_AIR, BRAKE_CLIMB)) * (0.3 + 0.7 * need)
    climb *= max(clip((8.0 - above) / 2.0, 0.0, 1.0), 0.4 * clip(2.0 * (need - 1.0), 0.0, 1.0))
    return rise + min(speed / 3.0, 1.0) * min(airspeed / 4.0, 1.0) ** 4 * max(climb - rise, 0.0)


@given(
    p=st.builds(Vector, st.floats(300.0, 499.0), st.floats(-30.0, 30.0), st.floats(40.0, 60.0)),
    v=velocities,
    wind=winds,
    travel=st.floats(0.0, 1.0),
    integral=integrals,
)
def test_the_climbing_stop(p, v, wind, travel, integral):
    path = leg((0, 0, 50), (500, 0, 50), 15.0)
    expected, learnt = braked(p, v, wind, path, travel, integral)
    asked, after = brake(MotionInAir(p, v, wind), Stop(path, 3.0), travel, integral, DT, GAINS)
    assert asked == pytest.approx(expected, abs=1e-8)
    assert after == pytest.approx(learnt, abs=1e-9)
