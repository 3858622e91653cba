"""The ground of the simulated world: given before the start the vehicle stands on it; later it moves under none."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from sitl import Simulation, SitlError, Start, fly_batch, hover_at, load_airframe
from sitl.model.ground import LEVEL_GROUND, clearance, ground_plane, height_over
from sitl.model.quaternions import x_axis
from sitl.simulation.avionics import Navigation
from sitl.vehicle.parameters import WorldSettings
from tests.support.vehicle.fake_station import Bench, make_aircraft

NOMINAL = load_airframe("nominal").parameters
HILL = WorldSettings(ground_height=2.0, ground_slope=5.0, ground_rises_to=90.0)  # towards the east


@pytest.mark.parametrize("navigation", [Navigation.TRUTH, Navigation.SENSORS])
def test_a_vehicle_starts_on_the_ground_that_it_is_given(navigation):
    aircraft = make_aircraft(world_settings=HILL, navigation=navigation)
    aircraft.advance(500)
    body = aircraft.vehicle.truth.body
    assert clearance(HILL.ground, body.position) == pytest.approx(NOMINAL.foot_x, abs=5e-3)
    assert math.degrees(math.acos(x_axis(body.attitude).z)) == pytest.approx(5.0, abs=0.5)
    assert x_axis(body.attitude).y > 0.0  # it leans downhill: west
    assert aircraft.vehicle.law is Law.LANDED
    assert aircraft.vehicle.estimate.on_ground
    assert aircraft.vehicle.estimate.position.z == pytest.approx(body.position.z, abs=1.5)


def test_level_ground_at_the_origin_is_no_change():
    aircraft = make_aircraft(world_settings=WorldSettings(ground_rises_to=70.0))
    assert aircraft.vehicle.surroundings.ground == LEVEL_GROUND
    assert aircraft.vehicle.flight == make_aircraft().vehicle.flight


def test_under_a_vehicle_that_flies_the_ground_may_move():
    aircraft = make_aircraft(up=6.0)
    aircraft.configure(aircraft.configuration.replaced({"SIM_GND_ALT": 4.0, "SIM_GND_SLOPE": 3.0}))
    aircraft.autopilot.guided.land()
    aircraft.advance(10000)
    assert aircraft.vehicle.law is Law.LANDED
    assert height_over(aircraft.vehicle.surroundings.ground, aircraft.vehicle.truth.body.position) < 0.2
    assert aircraft.vehicle.truth.body.position.z > 3.5  # not on the ground of before, which was at 0


@pytest.mark.parametrize(
    ("up", "values", "words"),
    [
        (0.0, {"SIM_GND_SLOPE": 5.0}, "the vehicle is on the ground"),
        (6.0, {"SIM_GND_ALT": 5.5}, "the ground would come to where the vehicle is"),
        (6.0, {"SIM_GND_ALT": 50.0}, "the ground would come to where the vehicle is"),
    ],
)
def test_ground_is_not_moved_under_a_standing_vehicle_nor_into_a_flying_one(up, values, words):
    aircraft = make_aircraft(up=up)
    aircraft.advance(10)
    before = aircraft.configuration
    with pytest.raises(SitlError, match=words):
        aircraft.configure(before.replaced(values | {"SIM_GUST_RMS": 1.0}))
    assert aircraft.configuration == before
    assert aircraft.vehicle.environment.gust_rms == 0.0
    assert aircraft.vehicle.surroundings.ground == LEVEL_GROUND


def test_a_flight_may_begin_in_the_air_below_where_level_ground_would_be():
    aircraft = make_aircraft(up=0.5, world_settings=WorldSettings(ground_height=-4.0))
    assert aircraft.vehicle.truth.body.position.z == 0.5
    with pytest.raises(SitlError, match="the ground would come to where the vehicle is"):
        make_aircraft(up=2.5, world_settings=HILL)


def test_a_standing_vehicle_keeps_its_ground_when_all_parameters_are_reset(tmp_path):
    bench = Bench(tmp_path, world_settings=HILL._replace(wind_speed=1.0))
    station = bench.station()
    assert station.command(mavlink.MAV_CMD_PREFLIGHT_STORAGE, 2) == mavlink.MAV_RESULT_ACCEPTED
    assert bench.aircraft.configuration.world == HILL


def on_slope(seed):
    """Falls onto ground of its own."""
    made = Simulation(NOMINAL, seed=seed, start=Start(north=3.0, up=4.0, airborne=True))
    made.surroundings.ground = ground_plane(0.1 * seed, 0.02 * seed, seed)
    made.begin_flight(Law.HOVER_LINEAR)
    made.landing = True
    made.reference = hover_at((3.0, 0.0, -2.0), 0.0)
    return made


def test_in_a_batch_every_flight_has_its_own_ground():
    together, alone = [on_slope(seed) for seed in range(5)], [on_slope(seed) for seed in range(5)]
    fly_batch(together, 6.0)
    for one in alone:
        one.step(6.0)
    assert [one.flight for one in together] == [one.flight for one in alone]
    heights = [height_over(one.surroundings.ground, one.truth.body.position) for one in alone]
    assert all(height < 0.3 for height in heights)
