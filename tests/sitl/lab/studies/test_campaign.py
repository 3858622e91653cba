"""The seeded campaign: complete, repeatable, and the same however many processes fly it."""

import numpy as np
import pytest

from sitl.errors import SitlError
from sitl.lab.studies.campaign import (
    MIN_FLIGHT_HEIGHT,
    UNCERTAIN,
    WITH_INFLOW,
    Spread,
    corner,
    draw,
    fly,
    perturbed,
    run,
    summary,
)
from sitl.model.airframe_files import load

SEEDS = 4


@pytest.fixture(scope="module")
def results():
    return run(SEEDS, jobs=1)


def test_four_flights_complete_and_stay_above_the_minimum_height(results):
    assert [result.fault for result in results] == [""] * SEEDS
    assert min(result.lowest for result in results) > MIN_FLIGHT_HEIGHT


def test_the_figures_are_those_of_a_square_in_forward_flight(results):
    for result in results:
        assert 20.0 < result.time < 120.0
        assert 1e3 < result.energy < 12e3
        assert 0.0 < result.cross_track < 15.0
        assert result.jumps >= 4  # front transition, cruise, back transition, hover
        assert result.failsafes == 0


def test_one_seed_is_one_flight(results):
    assert fly(draw(3, Spread())) == results[2]


def test_the_number_of_processes_changes_nothing(results):
    assert run(2, first=2, jobs=2) == results[1:3]


def test_every_seed_draws_within_the_spread_and_no_two_are_alike():
    spread = Spread(wind=3.0, gusts=0.5, parameters=0.05, airspeeds=(10.0, 11.0))
    draws = [draw(seed, spread) for seed in range(200)]
    assert max(d.wind_speed for d in draws) <= 3.0
    assert max(d.gusts for d in draws) <= 0.5
    assert all(10.0 <= d.airspeed <= 11.0 for d in draws)
    scales = np.array([[d.scale[name] for name in UNCERTAIN] for d in draws])
    assert 0.95 <= scales.min() < 0.951
    assert 1.049 < scales.max() <= 1.05
    assert len({d.azimuth for d in draws}) == len(draws)


def test_a_perturbed_airframe_differs_only_in_the_uncertain_parameters():
    model = load("physical").parameters
    other = perturbed(model, draw(5, Spread()).scale)
    changed = {name for name in model._fields if getattr(model, name) != getattr(other, name)}
    assert changed == {*UNCERTAIN, *WITH_INFLOW["k_f"], *WITH_INFLOW["k_m"]}
    assert other.k_fv / other.k_f == pytest.approx(model.k_fv / model.k_f)  # still one propeller


def test_the_square_closes_and_has_sides_of_a_hundred_metres_whatever_its_azimuth():
    for azimuth in (0.0, 1.0, 4.0):
        points = np.array([corner(i, azimuth) for i in range(5)])
        assert np.linalg.norm(np.diff(points, axis=0), axis=1) == pytest.approx(100.0)
        assert points[4] == pytest.approx(points[0])


@pytest.mark.parametrize(("flights", "jobs"), [(0, 1), (-3, 1), (2, 0)])
def test_a_campaign_without_flights_or_processes_is_refused(flights, jobs):
    with pytest.raises(SitlError, match="at least 1"):
        run(flights, jobs=jobs)


def test_the_summary_counts_the_complete_and_names_the_seeds_of_the_others(results):
    lost = results[2]._replace(complete=False, fault="came down to 1.2 m", lowest=1.2)
    lines = "\n".join(summary([*results[:2], lost, *results[3:]]))
    assert f"complete: {SEEDS - 1} (75.0 %)" in lines
    assert "lowest of all: 1.2 m" in lines
    assert f"failed: seed {lost.draw.seed}: came down to 1.2 m" in lines
