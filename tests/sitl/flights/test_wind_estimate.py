"""The wind estimator: what wing and pitot tell of the air, in steady winds, in gusts, and with a wrong model."""

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.design.gains import wind_gains
from sitl.guidance.circles import circle_about
from sitl.lab.studies.wrong_models import UNCERTAIN, perturbed
from sitl.model.quaternions import rotate_inverse
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from tests.support.flights.estimates import quaternion, vector
from tests.support.flights.recorded_flight import NOMINAL, Track, on_a_leg

GAINS = wind_gains()
WITH, WITHOUT = Tuning(pitot=1), Tuning(pitot=0)
WINDS = [(3.0, -2.0, 0.0), (-4.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 1.0)]


def on_a_circle(*, airspeed=12.0, seconds, **kwargs):
    """A flight that joins a circle of 40 m."""
    vehicle = on_a_leg(**kwargs)
    vehicle.reference = circle_about((60.0, 0.0, 200.0), 40.0, vehicle.reference, airspeed).reference
    track = Track(vehicle)
    track.advance(seconds)
    return track


def along_a_leg(*, seconds, **kwargs):
    track = Track(on_a_leg(**kwargs))
    track.advance(seconds)
    return track


def error(track, since):
    """Of the estimate, from a time on, world, (n, 3) [m/s]."""
    return (track.estimate - track.wind)[track.time > since]


def in_the_body(track, world, since):
    late = track.time > since
    return np.array([rotate_inverse(quaternion(q), vector(v)) for q, v in zip(track.q[late], world[late], strict=True)])


@pytest.mark.long
@pytest.mark.parametrize("wind", WINDS)
@pytest.mark.parametrize(("tuning", "bound"), [(WITH, 0.6), (WITHOUT, 3.0)], ids=["pitot", "no pitot"])
def test_a_turn_shows_a_steady_wind_on_every_axis(wind, tuning, bound):
    """Without the tube it is the wing alone, which meets each axis for a part of the turn."""
    track = on_a_circle(wind=wind, tuning=tuning, seconds=40.0)
    assert np.abs(error(track, 20.0)).max() < bound


@pytest.mark.parametrize("wind", WINDS)
def test_one_leg_shows_the_wind_along_it_and_the_vertical_and_knows_that_it_does_not_know_the_rest(wind):
    track = along_a_leg(wind=wind, tuning=WITH, seconds=20.0)
    assert np.abs(error(track, 10.0)[:, (0, 2)]).max() < 0.3
    deviation = track.vehicle.wind_deviation
    assert deviation[1] == pytest.approx(GAINS.max_deviation, rel=0.05)
    assert max(deviation[0], deviation[2]) < 0.3 * GAINS.max_deviation


def test_a_turn_after_a_leg_shows_what_the_leg_could_not():
    """And what was seen across is kept when the turn is over."""
    vehicle = on_a_leg(wind=(0.0, 4.0, 0.0))
    leg = vehicle.reference
    vehicle.advance(5000)
    assert abs(vehicle.wind_estimate[1]) < 1.0
    here = vehicle.estimate.position
    vehicle.reference = circle_about((here.x, here.y - 40.0, here.z), 40.0, leg, 12.0).reference
    vehicle.advance(15_000)
    assert vehicle.wind_estimate[1] == pytest.approx(4.0, abs=0.6)
    p = vehicle.estimate.position
    vehicle.reference = leg._replace(path=leg.path._replace(start=p, end=p._replace(x=p.x + 3000.0)))
    vehicle.advance(5000)
    assert vehicle.wind_estimate[1] > 2.5


@pytest.mark.long
@pytest.mark.parametrize("tuning", [WITH, WITHOUT], ids=["pitot", "no pitot"])
def test_calm_air_is_seen_as_calm_in_a_turn(tuning):
    assert np.abs(error(on_a_circle(tuning=tuning, seconds=40.0), 5.0)).max() < 0.3


def test_calm_air_is_seen_as_calm_on_a_leg():
    assert np.abs(error(along_a_leg(tuning=WITH, seconds=40.0), 0.0)).max() < 0.3


def test_calm_air_is_seen_as_calm_in_the_hover():
    vehicle = Simulation(NOMINAL, start=Start(up=30.0, airborne=True))
    vehicle.begin_flight(Law.HOVER_LINEAR)
    vehicle.advance(20_000)
    assert np.abs(vehicle.wind_estimate).max() < 0.1


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("tuning", [WITH, WITHOUT], ids=["pitot", "no pitot"])
def test_the_wing_follows_gusts_across_it(tuning, seed):
    track = along_a_leg(gusts=1.0, seed=seed, tuning=tuning, seconds=40.0)
    was, seen = (in_the_body(track, world, 10.0) for world in (track.wind, track.estimate))
    assert np.corrcoef(was[:, 2], seen[:, 2])[0, 1] > 0.9
    assert np.std(was[:, 2] - seen[:, 2]) < 0.5
    if tuning.pitot:
        assert np.corrcoef(was[:, 0], seen[:, 0])[0, 1] > 0.9


@pytest.mark.long
def test_without_a_pitot_gusts_do_not_carry_the_airspeed_away():
    track = along_a_leg(gusts=1.0, tuning=WITHOUT, seconds=40.0)
    assert np.abs(np.linalg.norm(track.v - track.wind, axis=1)[-500:] - 15.0).max() < 8.0


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_a_model_ten_per_cent_wrong_leaves_the_estimate_bounded(seed):
    rng = np.random.default_rng(seed)
    plant = perturbed(NOMINAL, {name: 1.0 + 0.1 * rng.choice((-1.0, 1.0)) for name in UNCERTAIN})
    wrong = on_a_circle(wind=(2.0, 1.0, 0.0), gusts=0.5, plant=plant, design_model=NOMINAL, seed=seed, seconds=60.0)
    assert np.linalg.norm(error(wrong, 10.0), axis=1).max() < 4.0
    assert np.sqrt(np.mean(error(wrong, 10.0) ** 2)) < 1.0
    assert not wrong.failsafes
