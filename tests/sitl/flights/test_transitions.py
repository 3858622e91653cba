"""From the hover to the wing and back: 100 m and 10 m up at 15 m/s, in calm, in gusts, on other airframes."""

import math

import numpy as np
import pytest

from protocol.dialect.vocabulary import DecisionReason, LegMode
from sitl.autopilot.settings import Settings
from sitl.design.gains import can_fly_forward
from sitl.lab.studies.wrong_models import UNCERTAIN, perturbed
from sitl.model.airframe_files import load
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import is_forward
from tests.support.flights.recorded_flight import HIGH, NOMINAL, Flight, hop
from tests.support.flights.tunings import BY_REPORT

DISTANCE, UP = 100.0, 10.0
THERE_AND_BACK = {  # jumps of each controller
    BY_REPORT: ["align", "front_transition", "fly", "brake", "hover"],
    Tuning(): ["fly_indi"],
}
GUSTY = range(1, 11)  # seeds
LOWEST = 5.0  # no flight may come below this [m]
DRAWS = range(1, 21)  # seeds of airframes


def end(azimuth):
    return np.array((DISTANCE * math.cos(azimuth), DISTANCE * math.sin(azimuth), HIGH + UP))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("tuning", THERE_AND_BACK, ids=["report", "hybrid"])
@pytest.mark.parametrize("azimuth", [0.0, 60.0, 135.0, 180.0, -90.0])
def test_a_transition_to_the_wing_and_back_ends_where_it_should(azimuth, tuning):
    azimuth = math.radians(azimuth)
    track = hop(azimuth, tuning=tuning)
    assert track.names == THERE_AND_BACK[tuning]
    assert np.linalg.norm(track.p[-1] - end(azimuth)) < 0.1
    assert track.beyond(end(azimuth), azimuth) < 1.0
    assert track.p[:, 2].min() > HIGH - 1.0
    assert track.p[:, 2].max() < HIGH + UP + 6.0
    assert track.saturated() < 0.03


def test_no_direction_is_different():
    """Begun facing it, the same flight turned about the vertical, but for the noise of its sensors."""
    north, turned = hop(0.0, heading=0.0), hop(2.0, heading=2.0)
    c, s = math.cos(2.0), math.sin(2.0)
    back = turned.p @ np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    assert turned.names == north.names
    assert np.abs(back - north.p).max() < 0.5


def test_left_is_the_mirror_of_right():
    left, right = hop(1.0), hop(-1.0)
    assert left.names == right.names
    assert np.abs(left.p - right.p * (1.0, -1.0, 1.0)).max() < 0.5


@pytest.mark.long
def test_gusts_of_a_metre_per_second_keep_neither_from_stopping_nor_from_its_altitude():
    beyond = []
    for seed in GUSTY:
        azimuth = 0.7 * seed
        track = hop(azimuth, seed=seed, gusts=1.0)
        assert not track.failsafes, seed
        assert track.p[:, 2].min() > HIGH - 10.0, seed
        assert track.p[:, 2].max() < HIGH + UP + 10.0, seed
        assert np.linalg.norm(track.p[-1] - end(azimuth)) < 2.0, seed
        beyond.append(track.beyond(end(azimuth), azimuth))
    assert np.quantile(beyond, 0.9) < 1.5  # 2 m without the climb of the braking


def test_an_airframe_without_trims_hovers_and_says_why():
    published = load("published").parameters
    assert not can_fly_forward(published)
    flight = Flight(plant=published, settings=Settings(leg_mode=LegMode.FORWARD))
    assert flight.autopilot.guided.go_to((60.0, 0.0, HIGH)).accepted
    ((_, decision),) = flight.autopilot.decisions()
    assert (decision.leg_mode, decision.reason) == (LegMode.HOVER, DecisionReason.NO_TRIM)
    flight.fly(30.0)
    assert not flight.flown_forward.any()
    assert np.linalg.norm(flight.p[-1] - (60.0, 0.0, HIGH)) < 1.0
    assert not flight.autopilot.transitions.begin(LegMode.FORWARD).accepted


@pytest.mark.long(after=1)
@pytest.mark.parametrize("seed", DRAWS)
def test_an_airframe_twenty_per_cent_off_either_flies_and_stops_or_hovers(seed):
    """Known to its laws: those that have a trim at every speed take the wing, the others never try."""
    rng = np.random.default_rng(seed)
    plant = perturbed(NOMINAL, {name: 1.0 + 0.2 * rng.uniform(-1.0, 1.0) for name in UNCERTAIN})
    track = hop(plant=plant, up=0.0, seconds=22.0)
    assert track.p[:, 2].min() > LOWEST
    assert not track.failsafes
    if can_fly_forward(plant):
        assert track.flown_forward.any()
        assert track.beyond((DISTANCE, 0.0), 0.0) < 25.0
        assert not is_forward(track.vehicle)
    else:
        assert not track.flown_forward.any()
