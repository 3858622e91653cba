"""Start of each vehicle of a fleet, and the options that several vehicles cannot combine."""

from pathlib import Path

import pytest

from sitl.commands.run import parser
from sitl.errors import SitlError
from sitl.process.fleet_process import grid, member_arguments


def members(*options):
    return member_arguments(parser({}).parse_args(options), Path("state"))


def test_vehicles_start_on_a_grid_with_ids_seeds_and_folders_of_their_own():
    made = members("--vehicles", "3", "--sysid", "7", "--seed", "40", "--start", "10,20,3,90", "--spacing", "4")
    assert [one.start for one in made] == [(10, 20, 3, 90), (10, 24, 3, 90), (14, 20, 3, 90)]
    assert [(one.sysid, one.seed) for one in made] == [(7, 40), (8, 41), (9, 42)]
    assert [one.state_dir for one in made] == [
        Path("state/vehicle-7"),
        Path("state/vehicle-8"),
        Path("state/vehicle-9"),
    ]


def test_one_vehicle_alone_forwards_between_peers():
    assert [one.forwards for one in members("--vehicles", "3")] == [True, False, False]


@pytest.mark.parametrize("count", [1, 2, 5, 9, 20])
def test_a_grid_is_as_square_as_can_be_and_has_each_place_once(count):
    places = grid(count)
    rows, columns = (max(place[axis] for place in places) + 1 for axis in (0, 1))
    assert len(set(places)) == count
    assert 0 <= columns - rows <= 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--scenario", "far-target"), "--scenario: not with --vehicles 2"),
        (("--day", "a.toml"), "--day: not with --vehicles 2"),
        (("--flight-plan", "a.xml"), "--flight-plan: not with --vehicles 2"),
        (("--speed", "0"), "--speed 0: not with --vehicles 2"),
        (("--sysid", "254"), "system ids 254 to 255 would go beyond 254"),
    ],
)
def test_what_cannot_be_combined_is_refused_by_name(options, words):
    with pytest.raises(SitlError, match=words):
        members("--vehicles", "2", *options)


@pytest.mark.parametrize("option", [("--vehicles", "0"), ("--sysid", "255"), ("--spacing", "0")])
def test_senseless_numbers_are_refused_with_their_option(option, capsys):
    with pytest.raises(SystemExit):
        parser({}).parse_args(option)
    assert f"argument {option[0]}" in capsys.readouterr().err
