"""``darko-sitl run``: its options agree with the vehicle's own tables, and bad ones are refused."""

import pytest

from protocol.frames import Geodetic
from sitl.__main__ import COMMANDS, main
from sitl.autopilot.world import ARENAS
from sitl.commands.run import experiment, parser
from sitl.defaults import HOME
from sitl.errors import SitlError
from sitl.process.vehicle_process import AUTOPILOT_TYPES, build_aircraft
from sitl.simulation.avionics import Navigation

PARSER = parser(COMMANDS)


def choices(option):
    return next(action.choices for action in PARSER._actions if option in action.option_strings)


@pytest.mark.parametrize("name", sorted(ARENAS))
def test_every_arena_that_is_shipped_can_be_chosen(tmp_path, name):
    arguments = ["--state-dir", str(tmp_path), "--arena", name]
    assert build_aircraft(PARSER.parse_args(arguments)).autopilot.world.arena.name == name


def test_an_arena_is_read_from_a_file_with_its_home(tmp_path):
    file = tmp_path / "hall.toml"
    place = "latitude = 43.0\nlongitude = 1.0\naltitude = 100.0\n"
    file.write_text(f'name = "hall"\nsize = [20, 10, 5]\nnet = true\n[origin]\n{place}')
    arguments = ["--state-dir", str(tmp_path), "--arena", str(file)]
    world = build_aircraft(PARSER.parse_args(arguments)).autopilot.world
    assert (world.arena.name, world.frame.origin) == ("hall", Geodetic(43.0, 1.0, 100.0))
    given = build_aircraft(PARSER.parse_args([*arguments, "--home", "1,2,3"])).autopilot.world
    assert given.frame.origin == Geodetic(1.0, 2.0, 3.0)


def test_every_autopilot_type_can_be_chosen():
    assert set(choices("--autopilot")) == set(AUTOPILOT_TYPES)


def test_home_is_the_default_home_unless_it_is_given(tmp_path):
    standing = build_aircraft(PARSER.parse_args(["--nav", "truth", "--state-dir", str(tmp_path)]))
    assert standing.autopilot.world.frame.origin == HOME
    assert PARSER.parse_args(["--home", "1,2,3"]).home.alt == 3.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--home", "89.5,0,0"], "LAT must be within ±89"),
        (["--home", "0,0"], "is not LAT,LON,ALT"),
        (["--start", "0,0,-1,0"], "is below the ground"),
        (["--wind", "-1"], "-1 is negative"),
        (["--param", "DRK_KPP"], "is not NAME=VALUE"),
    ],
)
def test_a_bad_option_is_refused_with_a_reason(capsys, arguments, words):
    with pytest.raises(SystemExit) as caught:
        PARSER.parse_args(arguments)
    assert caught.value.code == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("--seed", "-1", "-1 is negative"),
        ("--home", "0,0,1e308", "ALT must be within ±10000 m"),
        ("--start", "0,0,5,1e300", "YAW must be within ±360"),
    ],
)
def test_a_number_out_of_range_is_refused_with_its_option(capsys, option, value, reason):
    with pytest.raises(SystemExit):
        main(["run", option, value])
    assert f"argument {option}: " in (error := capsys.readouterr().err)
    assert reason in error


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("--start", "1e308,0,5,0", "--start: 1"),
        ("--start", "0,0,1e5,0", "--start: altitude 100000.0 m is outside the arena"),
        ("--airframe", "a" * 5000, "no parameter set 'aaa"),
    ],
)
def test_an_impossible_start_is_one_line(tmp_path, capsys, option, value, reason):
    code = main(["run", "--port", "0", "--state-dir", str(tmp_path), "--quiet", option, value])
    error = capsys.readouterr().err
    assert (code, error.count("\n")) == (2, 1)
    assert reason in error


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--sensors", "no-such.toml"], "no-such.toml: No such file or directory"),
        (["--nav", "truth", "--sensors", "any.toml"], "--sensors: with --nav truth no sensor is read"),
        (["--scenario", "far-target", "--nav", "sensors"], "--nav: scenarios fly on the exact state"),
        (["--scenario", "far-target", "--sensors", "any.toml"], "--sensors: scenarios fly on the exact state"),
        (["--scenario", "far-target", "--arena", "voliere"], "--arena: scenario far-target does not fly under a net"),
        (
            ["--arena", "nowhere"],
            "arena nowhere: No such file or directory; shipped are obstacle-course, open",
        ),
    ],
)
def test_sensors_that_cannot_be_flown_on_are_one_line(tmp_path, capsys, arguments, reason):
    code = main(["run", "--port", "0", "--state-dir", str(tmp_path), "--quiet", *arguments])
    error = capsys.readouterr().err
    assert (code, error.count("\n")) == (2, 1)
    assert reason in error


@pytest.mark.parametrize(
    ("arguments", "navigation", "is_aligned"),
    [
        ([], Navigation.SENSORS, False),
        (["--arena", "voliere"], Navigation.MOCAP, False),
        (["--arena", "voliere", "--nav", "sensors"], Navigation.SENSORS, False),
        (["--start", "0,0,5,0"], Navigation.SENSORS, True),
        (["--nav", "truth"], Navigation.TRUTH, True),
        (["--scenario", "far-target"], Navigation.TRUTH, True),
    ],
)
def test_the_vehicle_navigates_by_what_its_arena_has(tmp_path, arguments, navigation, is_aligned):
    args = PARSER.parse_args(["--state-dir", str(tmp_path), *arguments])
    aircraft = build_aircraft(args, experiment(args))
    assert aircraft.vehicle.avionics.navigation is navigation
    assert aircraft.navigation.is_aligned == is_aligned


def test_a_file_states_sensors_anew(tmp_path):
    file = tmp_path / "slow.toml"
    file.write_text('[gnss.rate]\nvalue = 5.0\nunit = "Hz"\nsource = "an older receiver"\n')
    aircraft = build_aircraft(PARSER.parse_args(["--state-dir", str(tmp_path), "--sensors", str(file)]))
    assert aircraft.vehicle.avionics.sensors.gnss.timing.rate == 5.0


def test_every_navigation_can_be_chosen():
    assert set(choices("--nav")) == {navigation.value for navigation in Navigation}


@pytest.mark.parametrize("arguments", [["--nav", "sensors"], ["--nav", "truth"], []])
def test_the_source_of_poses_is_for_motion_capture_alone(arguments, tmp_path):
    args = PARSER.parse_args(["--mocap", "external", "--state-dir", str(tmp_path), *arguments])
    with pytest.raises(SitlError, match="--mocap external: only with --nav mocap, or in the voliere"):
        build_aircraft(args)


@pytest.mark.parametrize(
    ("source", "awaited"), [("internal", ()), ("external", ("waiting for poses of motion capture",))]
)
def test_with_external_motion_capture_the_arena_s_cameras_are_off(source, awaited, tmp_path):
    args = PARSER.parse_args(["--arena", "voliere", "--mocap", source, "--state-dir", str(tmp_path)])
    aircraft = build_aircraft(args)
    aircraft.advance(1000)
    assert aircraft.navigation.awaited == awaited


def test_a_scenario_has_no_motion_capture(tmp_path):
    args = PARSER.parse_args(["--scenario", "far-target", "--mocap", "external", "--state-dir", str(tmp_path)])
    with pytest.raises(SitlError, match="--mocap: scenarios fly on the exact state"):
        build_aircraft(args, experiment(args))


def test_a_doubtful_airframe_is_flown_with_a_warning(tmp_path, capsys):
    build_aircraft(PARSER.parse_args(["--state-dir", str(tmp_path), "--airframe", "darko"]))
    assert "warning: " in capsys.readouterr().err
    build_aircraft(PARSER.parse_args(["--state-dir", str(tmp_path), "--airframe", "collage"]))
    assert capsys.readouterr().err == ""
