"""Touching the net or an obstacle in flight: the motors stop, the vehicle falls, and it is said what was touched."""

import math

import pytest

from sitl import Body, Law, Simulation, Start, Vector, hover_at, load_airframe
from sitl.enclosure.arena_files import Arena, Obstacle
from sitl.model.quaternions import hover

COLLAGE = load_airframe("collage").parameters
CAGE = Arena("cage", 5.0, 4.0, 6.0, has_net=True)
PILLAR = Obstacle("pillar", True, 2.0, 0.0, 0.0, 0.3, 0.3, 0.0, 6.0)
SHELF = Obstacle("shelf", False, 2.0, 0.0, 0.0, 0.3, 3.0, 4.0, 4.5)


def flying(velocity, arena=CAGE, at=(0.0, 0.0, 3.0)):
    made = Simulation(COLLAGE, start=Start(*at, airborne=True))
    made.surroundings.enclose(arena)
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    still = Vector(0.0, 0.0, 0.0)
    made.place(Body(Vector(*at), Vector(*velocity), hover(0.0), still))
    made.reference = hover_at((at[0] + 20.0 * velocity[0], at[1] + 20.0 * velocity[1], at[2] + 20.0 * velocity[2]), 0.0)
    return made


@pytest.mark.parametrize(
    ("velocity", "arena", "what"),
    [
        ((3.0, 0.0, 0.0), CAGE, "the net of cage"),
        ((0.0, -3.0, 0.0), CAGE, "the net of cage"),
        ((0.0, 0.0, 3.0), CAGE, "the net of cage"),
        ((3.0, 0.0, 0.0), CAGE._replace(obstacles=(PILLAR,)), "pillar"),
        ((3.0, 0.0, 0.0), CAGE._replace(has_net=False, obstacles=(PILLAR,)), "pillar"),
    ],
)
def test_what_is_touched_ends_the_flight(velocity, arena, what):
    vehicle = flying(velocity, arena)
    while vehicle.crash is None and vehicle.time < 8.0:
        vehicle.step(0.02)
    assert vehicle.crash is not None
    assert vehicle.surroundings.touched == what
    assert 0.1 < vehicle.crash.speed < 6.0
    vehicle.step(0.02)
    assert vehicle.law is Law.CRASHED
    place = vehicle.truth.body.position
    vehicle.step(4.0)
    end = vehicle.truth.body
    assert math.dist(end.position[:2], place[:2]) < 1.5
    assert end.position.z < 0.5
    assert math.hypot(*end.velocity) < 1.0
    assert vehicle.truth.actuators[:2] == (0.0, 0.0)


def test_the_wing_touches_before_the_middle_does():
    vehicle = flying((0.0, 2.0, 0.0))
    while vehicle.crash is None and vehicle.time < 8.0:
        vehicle.step(0.02)
    assert 3.5 < vehicle.crash.place.y < 4.0 - 0.4 * COLLAGE.b


def test_what_is_higher_or_beside_is_not_touched():
    for arena in (CAGE._replace(obstacles=(SHELF,)), CAGE._replace(obstacles=(PILLAR._replace(west=1.0),))):
        vehicle = flying((3.0, 0.0, 0.0), arena)
        while vehicle.truth.body.position.x < 3.0:
            vehicle.step(0.02)
        assert vehicle.crash is None


def test_a_new_beginning_mends_it_and_an_open_arena_has_nothing_to_touch():
    vehicle = flying((3.0, 0.0, 0.0))
    vehicle.step(4.0)
    assert vehicle.crash is not None
    vehicle.begin(Start())
    assert (vehicle.crash, vehicle.surroundings.touched) == (None, "")
    free = flying((3.0, 0.0, 0.0), CAGE._replace(has_net=False))
    free.step(6.0)
    assert free.crash is None
