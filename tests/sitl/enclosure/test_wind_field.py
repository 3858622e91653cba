"""The wind wall in flight: schedule, gusts, place, seed; and that nothing changes where there is none."""

import math

import numpy as np
import pytest

from sitl import Law, Simulation, Start, fly_batch, hover_at, load_airframe
from sitl.enclosure.arena_files import Arena, WindWall, outlet_of
from sitl.enclosure.wind_field import bursting, scheduled

COLLAGE = load_airframe("collage").parameters
OUTLET = outlet_of(4.5, 0.0, 2.0, math.pi, 3.0, 3.0)  # it blows south
ROOM = Arena("room", 5.0, 5.0, 7.0)


def hovering(wall=None, *, at=(0.0, 0.0, 2.0), seed=1):
    made = Simulation(COLLAGE, seed=seed, start=Start(at[0], at[1], at[2], airborne=True))
    made.surroundings.enclose(ROOM._replace(wall=wall))
    made.begin_flight(Law.HOVER_LINEAR)
    made.reference = hover_at(at, 0.0)
    return made


def steady(speed, intensity=0.0):
    return WindWall(OUTLET, intensity, 0.3, ((0.0, speed),))


def test_schedules_go_from_line_to_line():
    schedule = np.array([(1.0, 2.0), (3.0, 6.0), (5.0, 4.0)])
    assert [scheduled(schedule, t) for t in (0.0, 1.0, 2.0, 3.0, 4.5, 9.0)] == [2.0, 2.0, 4.0, 6.0, 4.5, 4.0]
    assert scheduled(np.zeros((0, 2)), 1.0) == 0.0


def test_a_gust_is_a_cosine_once():
    bursts = np.array([(2.0, 4.0, 3.0)])
    assert [bursting(bursts, t) for t in (1.0, 2.0, 3.0, 4.0, 6.0, 7.0)] == pytest.approx([0, 0, 1.5, 3.0, 0, 0])


def test_the_wind_is_that_of_the_place():
    inside, outside = hovering(steady(3.0)), hovering(steady(3.0), at=(0.0, 4.0, 2.0))
    inside.step(0.1)
    outside.step(0.1)
    assert inside.wind == pytest.approx((-3.0, 0.0, 0.0), abs=0.02)
    assert math.hypot(*outside.wind) < 0.05


def test_it_pushes_the_vehicle_and_adds_to_the_uniform_wind():
    calm, blown = hovering(), hovering(steady(3.0))
    for made in (calm, blown):
        made.set_wind((0.0, 1.0, 0.0))
        made.step(1.0)
    assert blown.wind == pytest.approx((-3.0, 1.0, 0.0), abs=0.02)
    assert blown.truth.body.position.x < calm.truth.body.position.x - 0.05


def test_without_a_wall_that_blows_a_flight_is_the_same_to_the_bit():
    plain, walled = hovering(), hovering(WindWall(OUTLET, 0.1, 0.3))
    for made in (plain, walled):
        made.set_wind((2.0, 0.0, 0.0), 1.0)
        made.step(2.0)
    assert plain.flight == walled.flight


def test_a_seed_is_a_flight_however_it_is_called():
    made = [hovering(steady(4.0, 0.1), seed=seed) for seed in (5, 5, 6)]
    made[0].step(3.0)
    for _ in range(30):
        made[1].step(0.1)
    made[2].step(3.0)
    assert made[0].truth == made[1].truth != made[2].truth


def test_the_wall_leaves_the_gusts_of_the_uniform_wind_as_they_were():
    """Drawn apart: the field's part is taken off again where it ends, and the gust goes on."""
    made = hovering(steady(4.0, 0.1))
    made.step(1.0)
    made.surroundings.schedule = np.zeros((0, 2))
    made.step(0.002)
    assert made.wind == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_turbulence_has_the_intensity_of_the_wall():
    made, seen = hovering(steady(3.0, 0.1)), []
    for _ in range(2000):
        made.advance(10)
        seen.append(made.wind)
    assert np.std(np.array(seen), axis=0) == pytest.approx([0.3, 0.3, 0.3], rel=0.25)


def test_turbulence_turns_the_vehicle():
    """The rotation of the air alone: the same velocities, with and without it."""
    made = [hovering(steady(5.0, 0.2)) for _ in range(2)]
    made[1].surroundings.fields["span"] = 1e6  # of such a wing no eddy is felt as a rotation
    for one in made:
        one.step(1.0)
    first, second = (one.truth.body.rates for one in made)
    assert max(abs(a - b) for a, b in zip(first, second, strict=True)) > 5e-3


def test_at_the_edge_of_the_jet_the_wing_feels_the_shear():
    made = hovering(steady(4.0), at=(0.0, 1.5, 2.0))
    made.step(0.002)
    turning = made.surroundings.fields["rotation"][0]
    assert float(turning["z"]) < -1.0  # it blows south, and slower to the west: minus dU/dy about up
    assert abs(float(turning["y"])) < 0.3


def test_the_laws_do_not_know_of_it():
    made = hovering(steady(4.0))
    made.step(0.002)
    assert math.hypot(*made.estimate.wind) < 0.5 < math.hypot(*made.wind)


def test_in_a_batch_it_blows_as_for_one_alone():
    together, alone = hovering(steady(1.0)), hovering(steady(1.0))
    fly_batch([together], 1.0)
    alone.step(1.0)
    assert together.flight == alone.flight
