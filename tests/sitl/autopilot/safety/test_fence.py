"""The fence: when it is breached, and that the vehicle stays inside, in hover and in forward flight."""

import math

import numpy as np
import pytest

from protocol.dialect.vocabulary import LegMode
from protocol.names.modes import Mode
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import Circle, Fence, FenceWatch, Polygon, path_to_stop
from sitl.guidance.view import VehicleView
from tests.support.flights.recorded_flight import HIGH, Flight


def at(p, v=(0.0, 0.0, 0.0), time=0.0, **rest):
    return VehicleView(time, p, v, 0.0, 0.0, False, 1.0, **rest)


def test_a_polygon_contains_the_points_of_non_zero_winding_number():
    rng = np.random.default_rng(3)
    angle = np.sort(rng.uniform(0.0, math.tau, 17))
    corners = np.column_stack([rng.uniform(10.0, 60.0, 17) * f(angle) for f in (np.cos, np.sin)])
    p = rng.uniform(-60.0, 60.0, (400, 2))
    away = corners[None] - p[:, None]
    bearing = np.arctan2(away[..., 1], away[..., 0])
    turn = np.angle(np.exp(1j * (np.roll(bearing, -1, axis=1) - bearing))).sum(axis=1)
    assert Polygon(corners).contains(p).tolist() == (np.abs(turn) > 1.0).tolist()


# When it is breached

DISC_OF_50 = Fence(inclusions=(Circle((0.0, 0.0), 50.0),))


def test_the_path_to_a_stop_is_longer_in_forward_flight():
    v = (15.0, 0.0, 0.0)
    views = (at((0.0, 0.0, 20.0), v, forward=forward, stopping_distance=60.0) for forward in (False, True))
    upright, flying = (path_to_stop(view)[-1][0] for view in views)
    assert upright == pytest.approx(22.5)
    assert flying == pytest.approx(60.0 + 0.3 * 15.0)


def test_a_breach_is_reported_once_before_it_happens_and_again_only_after_a_while_inside():
    watch = FenceWatch()
    towards = at((46.0, 0.0, 5.0), (3.0, 0.0, 0.0))
    assert "about to be" in watch.check(towards, DISC_OF_50).text
    assert watch.check(towards._replace(time=0.1), DISC_OF_50) is None
    assert watch.breached
    watch.check(at((40.0, 0.0, 5.0), time=0.5), DISC_OF_50)
    assert watch.breached
    watch.check(at((40.0, 0.0, 5.0), time=1.2), DISC_OF_50)
    assert not watch.breached
    assert watch.check(at((51.0, 0.0, 5.0), time=2.0), DISC_OF_50).text == "outside the fence"
    assert watch.count == 2


@pytest.mark.parametrize(("p", "kind"), [((0.0, 0.0, 31.0), 2), ((41.0, 0.0, 5.0), 3)])
def test_the_cylinder_about_home_is_a_fence_by_itself(p, kind):
    assert Fence(max_distance=40.0, max_height=30.0).breach([p]).kind == kind


# What the vehicle does about it


def flown_out(action, *, airspeed=15.0, wind=0.0, gusts=0.0):
    """A flight northwards in forward flight, towards a fence 200 m from home."""
    settings = Settings(leg_mode=LegMode.FORWARD, airspeed=airspeed)
    flight = Flight(settings=settings, wind_speed=wind, wind_from=180.0, gusts=gusts)
    assert flight.autopilot.guided.go_to((600.0, 0.0, HIGH)).accepted
    flight.fly(5.0)
    flight.autopilot.configure(settings._replace(fence_action=action, fence_distance=200.0))
    return flight


@pytest.mark.parametrize(
    ("airspeed", "wind", "gusts"), [(8.0, 0.0, 0.0), (15.0, 0.0, 0.0), (20.0, 0.0, 0.0), (15.0, 4.0, 0.7)]
)
def test_in_forward_flight_it_stops_before_the_fence(airspeed, wind, gusts):
    flight = flown_out(2, airspeed=airspeed, wind=wind, gusts=gusts)
    flight.fly_until(lambda: flight.texts, 40.0)
    assert flight.texts[0] == "Fence: about to be farther than 200 m from home: holding"
    flight.fly(20.0)
    assert flight.autopilot.mode is Mode.HOLD
    assert not flight.autopilot.view.forward
    assert 190.0 < np.linalg.norm(flight.p[:, :2], axis=1).max() < 200.0
    assert len(flight.texts) == 1


def test_a_return_from_the_fence_stops_before_it_turns_round():
    flight = flown_out(3)
    flight.fly(45.0)
    assert flight.texts[0].endswith("returning")
    assert flight.autopilot.mode is Mode.RTL
    assert np.linalg.norm(flight.p[:, :2], axis=1).max() < 200.0
    assert np.abs(flight.p[:, 1]).max() < 15.0
    assert np.linalg.norm(flight.p[-1, :2]) < 1.0


def test_a_landing_at_the_fence_comes_down_inside():
    flight = flown_out(5)
    flight.fly(45.0)
    assert "Landed" in flight.texts
    assert not flight.failsafes
    assert np.linalg.norm(flight.p[:, :2], axis=1).max() < 200.0


def test_a_warning_is_only_a_warning():
    flight = flown_out(1)
    flight.fly(15.0)
    assert flight.texts == ["Fence: about to be farther than 200 m from home: going on"]
    assert flight.p[-1, 0] > 210.0


@pytest.mark.parametrize("level", [(3.0, 0.0), (2.0, 2.0)])
def test_in_hover_a_streamed_velocity_ends_before_the_fence(level):
    flight = Flight()
    flight.autopilot.load_fence(Fence(inclusions=(Circle((0.0, 0.0), 20.0),)))
    v = (*level, 0.0)

    def stream():
        flight.autopilot.offboard.set_velocity(v)

    stream()
    assert flight.autopilot.set_mode(Mode.OFFBOARD).accepted
    flight.fly(15.0, stream)
    assert flight.autopilot.mode is Mode.HOLD
    assert 14.0 < np.linalg.norm(flight.p[:, :2], axis=1).max() < 20.0
