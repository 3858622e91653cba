"""darko-sitl plan: what is flown, what is refused, and the nearest mission; and flying a plan from the command line."""

import json

import pytest

from protocol.names import Mode
from protocol.plans import load
from sitl.__main__ import COMMANDS, main
from sitl.commands.run import parser
from sitl.errors import SitlError
from sitl.process.vehicle_process import build_aircraft
from tests.support.plans import OUR_PLANS, VOLIERE, plan_text

FISH = plan_text('<block name="a"><stay wp="A"/></block><block name="b"><call fun="nav_fish()"/></block>')


@pytest.fixture
def fish(tmp_path):
    path = tmp_path / "fish.xml"
    path.write_text(FISH)
    return path


def test_a_plan_that_is_flown(capsys):
    assert main(["plan", str(VOLIERE)]) == 0
    out = capsys.readouterr().out
    assert "13 waypoints, 10 blocks" in out
    assert out.endswith("All of it is flown.\n")


def test_a_refusal_names_its_construct_and_place(fish, capsys):
    assert main(["plan", str(fish)]) == 2
    out = capsys.readouterr().out
    assert "locked: nav_fish()" in out
    assert f"refused: {fish}:3:74: nav_fish(): no such function of this autopilot (block b)" in out
    assert "1 of its blocks is locked" in out


def test_a_mapping_makes_it_flown(fish, tmp_path, capsys):
    names = tmp_path / "names.toml"
    names.write_text("[functions]\nnav_fish = 0\n")
    assert main(["plan", str(fish), "--names", str(names)]) == 0
    assert "All of it is flown" in capsys.readouterr().out


def test_findings_as_json(fish, capsys):
    assert main(["plan", str(fish), "--json"]) == 2
    told = json.loads(capsys.readouterr().out)
    assert told["blocks"] == [{"name": "a", "flown": True}, {"name": "b", "flown": False}]
    (refused,) = told["refused"]
    assert (refused["construct"], refused["line"], refused["block"]) == ("nav_fish()", 3, "b")


@pytest.mark.parametrize("suffix", [".plan", ".waypoints"])
def test_the_nearest_mission(suffix, tmp_path, capsys):
    path = tmp_path / f"m{suffix}"
    assert main(["plan", str(VOLIERE), "--to", str(path)]) == 0
    assert len(load(path).items) > 5
    out = capsys.readouterr().out
    assert "not in it:" in out
    assert "exception to Safe landing" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plan", "none.xml"], "cannot be read"),
        (["plan", str(VOLIERE), "--names", "none.toml"], "cannot be read"),
        (["plan", str(VOLIERE), "--to", "m.xml"], "the suffix of a mission"),
        (["plan", str(VOLIERE), "--to", "/none/m.plan"], "cannot be written"),
        (["plan", str(OUR_PLANS / "procedures" / "descend.xml")], "a procedure is flown by a plan"),
        (["--flight-plan-names", "n.toml"], "--flight-plan-names needs --flight-plan"),
    ],
)
def test_faults_are_one_line(arguments, words, capsys):
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert words in error
    assert len(error.splitlines()) == 1


def built(tmp_path, *arguments):
    return build_aircraft(parser(COMMANDS).parse_args(["--state-dir", str(tmp_path), *arguments]))


def test_the_plan_is_in_force_from_the_start_at_its_own_origin(tmp_path):
    autopilot = built(tmp_path, "--flight-plan", str(VOLIERE), "--arena", "voliere", "--nav", "truth").autopilot
    assert autopilot.mode is Mode.FLIGHT_PLAN
    assert autopilot.flight_plan.status().block_name == "Engine off"
    origin = autopilot.world.frame.origin
    assert (origin.lat_deg, origin.alt) == (pytest.approx(43.5640917), 146.0)


def test_a_home_that_is_given_is_the_origin_and_the_plan_lies_beside_it(tmp_path):
    arguments = ("--flight-plan", str(VOLIERE), "--nav", "truth", "--home", "43.5639,1.4829194,100")
    autopilot = built(tmp_path, *arguments).autopilot
    autopilot.update(autopilot.view)
    home = next(point for point in autopilot.flight_plan.waypoints() if point.name == "HOME")
    assert home.place.lat_deg == pytest.approx(43.5640917, abs=1e-6)
    assert home.place.alt == pytest.approx(102.0)  # as high above the ground as in the plan


def test_what_is_left_out_is_told_at_the_start_and_listed_by_the_plans_command(tmp_path, capsys):
    path = tmp_path / "drop.xml"
    path.write_text(plan_text('<block name="a"><call_once fun="DropOpen()"/><stay wp="A"/></block>'))
    built(tmp_path, "--flight-plan", str(path), "--nav", "truth")
    assert "1 calls, values or exceptions of a build are left out" in capsys.readouterr().err
    assert main(["plan", str(path)]) == 0
    out = capsys.readouterr().out
    assert "DropOpen(): payload of a build: left out" in out
    assert out.endswith("All of it is flown, but for what is left out.\n")


def test_what_cannot_be_flown_is_refused_before_anything_is_built(fish, tmp_path, capsys):
    with pytest.raises(SitlError, match="flies by itself"):
        built(tmp_path, "--flight-plan", str(VOLIERE), "--scenario", "far-target")
    fish.write_text(FISH.replace('<stay wp="A"/>', '<stay wp="A" vmode="climb"/>'))
    with pytest.raises(SitlError, match="vmode 'climb': needs the attribute"):
        built(tmp_path, "--flight-plan", str(fish))
    fish.write_text(FISH.replace('lat0="43.5641"', 'lat0="89.5"'))
    with pytest.raises(SitlError, match=r"no flight at lat0 89\.5"):
        built(tmp_path, "--flight-plan", str(fish))
    fish.write_text(FISH)
    assert built(tmp_path, "--flight-plan", str(fish), "--nav", "truth").autopilot.mode is Mode.FLIGHT_PLAN
    assert "block b is locked" in capsys.readouterr().err
