import math

import pytest

from sitl.errors import SitlError
from sitl.model.airframe_files import load
from sitl.model.state import Actuators
from sitl.physics.driven_vehicle import DrivenVehicle
from sitl.physics.outputs import SHIPPED, load_outputs
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.start import Start

DARKO = load("darko").parameters


def test_ardupilots_pulses_move_what_their_functions_say():
    command = SHIPPED["ardupilot"].command([1750, 1250, 1500, 1600, *[0] * 12], DARKO)
    assert command.left_elevon == pytest.approx(0.5 * DARKO.delta_max)
    assert command.right_elevon == pytest.approx(-0.5 * DARKO.delta_max)
    assert command.left_motor == pytest.approx(0.5 * DARKO.omega_max)
    assert command.right_motor == pytest.approx(0.6 * DARKO.omega_max)


def test_px4s_motors_are_right_and_left_and_its_elevons_left_and_right():
    command = SHIPPED["px4"].command([0.6, 0.5, 0, 0, 1.0, -1.0, *[0.0] * 10], DARKO)
    assert command == pytest.approx((0.5 * DARKO.omega_max, 0.6 * DARKO.omega_max, DARKO.delta_max, -DARKO.delta_max))


@pytest.mark.parametrize("name", SHIPPED)
def test_motors_at_rest_are_disarmed_and_what_is_out_of_range_is_clipped(name):
    outputs = SHIPPED[name]
    rest, most = [0.0] * 16, [1e9] * 16
    for output in outputs[:2]:
        rest[output.channel - 1] = output.low
    assert outputs.command(rest, DARKO) is None
    assert outputs.command(most, DARKO) == (DARKO.omega_max, DARKO.omega_max, DARKO.delta_max, DARKO.delta_max)


def test_without_a_pulse_a_motor_stops_and_an_elevon_is_in_the_middle():
    assert SHIPPED["ardupilot"].command([0] * 16, DARKO) is None
    command = SHIPPED["ardupilot"].command([0, 2000, 1500, 1500, *[0] * 12], DARKO)
    assert (command.left_elevon, command.right_elevon) == (0.0, DARKO.delta_max)


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_only_finite_values_of_channels_that_are_used_count(wrong):
    values = [1500.0] * 16
    values[15] = wrong
    assert SHIPPED["ardupilot"].is_finite(values)
    values[0] = wrong
    assert not SHIPPED["ardupilot"].is_finite(values)
    assert not SHIPPED["ardupilot"].is_finite([1500.0] * 3)


@pytest.mark.parametrize(
    ("command", "signs"),
    [
        (Actuators(900.0, 900.0, 0.2, 0.0), (0, 1, 1)),  # left elevon up: nose up, clockwise seen from above
        (Actuators(900.0, 900.0, 0.0, 0.2), (0, 1, -1)),
        (Actuators(1000.0, 800.0, 0.0, 0.0), (1, 0, None)),  # more thrust on the left: the right wing down
    ],
)
def test_the_signs_that_the_page_tells_px4_are_those_of_the_plant(command, signs):
    """Rates in the hover frame FRD: x along the belly, z to the tail."""
    turned = []
    for given in (Actuators(900.0, 900.0, 0.0, 0.0), command):
        vehicle = DrivenVehicle(DARKO, seed=1, start=Start(up=50.0, airborne=True), sensors=load_sensors())
        p, q, r = vehicle.drive(given, 50).true_rates
        turned.append((r, q, -p))
    change = [after - before for before, after in zip(*turned, strict=True)]
    for axis, sign in zip(change, signs, strict=True):
        if sign:
            assert axis * sign > 0.05
        elif sign == 0:
            assert abs(axis) < 0.2 * max(map(abs, change))


def test_a_file_names_channels_and_ends(tmp_path):
    file = tmp_path / "outputs.toml"
    file.write_text('base = "ardupilot"\n[left_elevon]\nchannel = 7\nlow = 1900\nhigh = 1100\n')
    outputs = load_outputs(str(file))
    assert outputs.left_elevon == (7, 1900.0, 1100.0)
    assert outputs.right_motor == SHIPPED["ardupilot"].right_motor
    assert outputs.left_elevon.share([0.0] * 6 + [1100.0]) == 1.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[left_motor", "not a TOML file"),
        ("[nose]\nchannel = 1", "nose is not known"),
        ("[left_motor]\nchannel = 1\nlow = 0\nhigh = 1", "right_motor is missing"),
        ('base = "paparazzi"', "base = 'paparazzi' must be one of"),
        ('base = "px4"\n[left_motor]\nchannel = 0\nlow = 0\nhigh = 1', "channel = 0 is not within 1 and 32"),
        ('base = "px4"\n[left_motor]\nchannel = 1.5\nlow = 0\nhigh = 1', "channel = 1.5 is not a whole number"),
        ('base = "px4"\n[left_motor]\nchannel = 1\nlow = 1\nhigh = 1', "high = 1 is the same as low"),
        ('base = "px4"\n[left_motor]\nchannel = 1\nlow = nan\nhigh = 1', "low = nan is not a finite number"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line_that_says_where(tmp_path, text, words):
    file = tmp_path / "outputs.toml"
    file.write_text(text)
    with pytest.raises(SitlError, match=r"outputs\.toml") as error:
        load_outputs(str(file))
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_names_what_is_shipped(tmp_path):
    with pytest.raises(SitlError, match=r"No such file.*betaflight-tailsitter"):
        load_outputs(str(tmp_path / "none.toml"))
