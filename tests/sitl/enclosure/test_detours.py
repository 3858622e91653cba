"""Ways past obstacles: the shortest, never nearer than the clearance, or none."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.plans.plan import Refusal
from sitl.enclosure.arena_files import Arena, Obstacle
from sitl.enclosure.detours import crossed, crosses_area, detour, length_of

PILLAR = Obstacle("pillar", True, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 7.0)
FENCE = Obstacle("fence", False, 0.0, 0.0, 0.0, 0.1, 5.0, 0.0, 3.0)
ROOF = Obstacle("roof", False, 0.0, 0.0, 0.0, 0.1, 5.0, 3.0, 7.0)


def arena(*obstacles):
    return Arena("room", 5.0, 5.0, 7.0, has_net=True, margin=0.5, obstacles=obstacles)


def least_gap(room, points, step=0.02):
    gaps = []
    for a, b in itertools.pairwise(points):
        pieces = max(1, math.ceil(math.dist(a, b) / step))
        for k in range(pieces + 1):
            p = tuple(x + (y - x) * k / pieces for x, y in zip(a, b, strict=True))
            gaps.append(min(obstacle.gap(p) for obstacle in room.obstacles))
    return min(gaps)


def test_a_straight_way_that_is_clear_stays_straight():
    assert detour(arena(), (-3.0, 0.0, 2.0), (3.0, 0.0, 2.0), 1.0) == ((3.0, 0.0, 2.0),)
    assert detour(arena(PILLAR), (-3.0, 2.0, 2.0), (3.0, 2.0, 2.0), 1.0) == ((3.0, 2.0, 2.0),)


def test_round_a_pillar_by_the_shortest_way():
    """Two tangents of 2.6 m and the arc between them, which chords outside of it replace."""
    start, end = (-3.0, 0.0, 2.0), (3.0, 0.0, 2.0)
    route = detour(arena(PILLAR), start, end, 1.0)
    tangents, arc = 2.0 * math.sqrt(3.0**2 - 1.5**2), 1.5 * (math.pi - 2.0 * math.acos(1.5 / 3.0))
    assert tangents + arc <= length_of((start, *route)) < 1.06 * (tangents + arc)
    assert least_gap(arena(PILLAR), (start, *route)) > 1.0 - 1e-3


def test_over_a_fence_that_reaches_from_side_to_side_and_under_a_roof():
    start, end = (-3.0, 0.0, 2.0), (3.0, 0.0, 2.0)
    over = detour(arena(FENCE), start, end, 1.0)
    assert max(p[2] for p in over) == pytest.approx(4.02)
    assert least_gap(arena(FENCE), (start, *over)) > 1.0 - 1e-3
    high = (-3.0, 0.0, 5.0), (3.0, 0.0, 5.0)
    under = detour(arena(ROOF), *high, 1.0)
    assert min(p[2] for p in under) == pytest.approx(1.98)
    assert least_gap(arena(ROOF), (high[0], *under)) > 1.0 - 1e-3


def test_where_there_is_no_way_it_says_what_is_in_the_way():
    closed = FENCE._replace(top=7.0)
    reason = detour(arena(closed), (-3.0, 0.0, 2.0), (3.0, 0.0, 2.0), 1.0)
    assert reason == Refusal("no way past 'fence' keeps 1 m from everything")
    assert detour(arena(PILLAR), (-3.0, 0.0, 2.0), (1.0, 0.0, 2.0), 1.0) == Refusal("its end is within 1 m of 'pillar'")
    assert isinstance(detour(arena(FENCE), (-3.0, 0.0, 2.0), (3.0, 0.0, 2.0), 1.0, level=True), Refusal)


def test_between_two_pillars_only_if_the_gap_is_wide_enough():
    pair = [PILLAR._replace(name=str(k), west=1.6 * k) for k in (-1, 1)]
    wide, narrow = (detour(arena(*pair), (-3.0, 0.0, 2.0), (3.0, 0.0, 2.0), c) for c in (1.0, 1.2))
    assert len(wide) == 1
    assert len(narrow) > 1


def test_straight_up_past_a_shelf_it_goes_round():
    shelf = Obstacle("shelf", False, 0.0, 0.0, 0.0, 0.5, 0.5, 3.0, 3.2)
    start, end = (0.0, 0.0, 1.5), (0.0, 0.0, 5.0)
    route = detour(arena(shelf), start, end, 1.0)
    assert (
        route == Refusal("no way past 'shelf' keeps 1 m from everything")
        or least_gap(arena(shelf), (start, *route)) > 0.99
    )


def test_a_start_too_near_to_an_obstacle_may_leave_it():
    route = detour(arena(PILLAR), (-1.0, 0.0, 2.0), (3.0, 0.0, 2.0), 1.0)
    assert not isinstance(route, Refusal)
    assert route[-1] == (3.0, 0.0, 2.0)
    assert least_gap(arena(PILLAR), ((-1.0, 0.0, 2.0), *route)) > 0.45


def test_a_sloping_leg_is_looked_at_where_it_passes():
    low = Obstacle("crate", False, 2.0, 0.0, 0.0, 0.5, 0.5, 0.0, 1.0)
    assert crossed(arena(low), (-4.0, 0.0, 6.0), (4.0, 0.0, 3.0), 1.0) == []
    assert crossed(arena(low), (-4.0, 0.0, 6.0), (4.0, 0.0, 1.0), 1.0) == [low]
    assert crosses_area(arena(low), [(0.0, 0.0, 1.0), (4.0, 2.0, 1.0), (4.0, -2.0, 1.0)], 0.2)
    assert not crosses_area(arena(low), [(-4.0, 0.0, 1.0), (0.0, 2.0, 1.0), (0.0, -2.0, 1.0)], 0.2)


coordinate = st.floats(-4.0, 4.0)
pillars = st.builds(
    lambda north, west, radius, top: Obstacle("p", True, north, west, 0.0, radius, radius, 0.0, top),
    coordinate, coordinate, st.floats(0.1, 0.8), st.floats(0.5, 7.0),
)  # fmt: skip
boxes = st.builds(
    lambda north, west, course, long, wide, bottom: Obstacle("b", False, north, west, course, long, wide, bottom, 7.0),
    coordinate, coordinate, st.floats(-3.0, 3.0), st.floats(0.1, 1.5), st.floats(0.02, 0.5), st.floats(0.0, 5.0),
)  # fmt: skip
places = st.tuples(coordinate, coordinate, st.floats(1.2, 6.0))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.one_of(pillars, boxes), min_size=1, max_size=4), places, places)
def test_whatever_stands_there_a_way_keeps_the_clearance(obstacles, start, end):
    room = arena(*obstacles)
    if min(obstacle.gap(start) for obstacle in obstacles) < 0.6:
        return
    route = detour(room, start, end, 0.6)
    if not isinstance(route, Refusal):
        assert route[-1] == end
        assert least_gap(room, (start, *route), 0.05) > 0.6 - 1e-3
