"""The commands for scripts, answered by a real process that stands: docs/scripting.md."""

import json
import subprocess
import sys
from functools import partial

import pytest

from darko_gcs.__main__ import main
from tests.e2e.support import answered, free_ports, vehicle
from tests.support.paths import DATA


@pytest.fixture(scope="module")
def port(tmp_path_factory):
    """Port of a vehicle that only answers: in real time, as ten times the telemetry is ten times the work."""
    (number,) = free_ports(1)
    with vehicle(number, tmp_path_factory.mktemp("standing"), "--nav", "truth"):
        yield number


@pytest.fixture
def answer(capsys):
    return partial(answered, capsys)


@pytest.mark.long
def test_watch_prints_an_object_a_line(port):
    done = subprocess.run(
        [sys.executable, "-m", "darko_gcs", "watch", "--count", "3", "--every", "0.1", "--json", "--port", str(port)],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert (done.returncode, len(lines), lines[-1]) == (0, 4, {"ok": True, "lines": 3})
    assert {"time", "mode", "law", "position", "battery"} <= lines[0].keys()
    assert "waiting for a vehicle on 127.0.0.1" in done.stderr


def test_a_command_that_is_refused_says_why_and_exits_with_4(port, answer):
    code, said = answer(port, "cmd", "land")
    assert (code, said["ok"], said["exit_code"]) == (4, False, 4)
    assert said["error"].startswith("landing refused: ")  # the vehicle repeats its own words only after a while


@pytest.mark.long
def test_parameters_are_saved_and_loaded_in_both_formats(port, answer, tmp_path):
    for name in ("mine.params", "mine.parm"):
        assert answer(port, "param", "save", str(tmp_path / name))[1]["saved"] > 50
    assert answer(port, "param", "set", "RTL_RETURN_ALT", "31")[1]["parameters"] == {"RTL_RETURN_ALT": 31.0}
    code, differs = answer(port, "param", "diff", str(tmp_path / "mine.parm"))
    assert (code, list(differs["differ"])) == (0, ["RTL_RETURN_ALT"])
    loaded = answer(port, "param", "load", str(tmp_path / "mine.params"))[1]
    assert list(loaded["parameters"]) == ["RTL_RETURN_ALT"]
    assert answer(port, "param", "get", "NO_SUCH")[1]["error"] == "the vehicle has no parameter NO_SUCH"


@pytest.mark.long
def test_values_are_set_by_name_and_compared_with_the_defaults(port, answer):
    assert answer(port, "param", "set", "NAV_DLL_ACT", "Return")[1]["parameters"] == {"NAV_DLL_ACT": 2}
    differs = answer(port, "param", "diff")[1]["differ"]
    assert differs["NAV_DLL_ACT"] == {"vehicle": 2, "default": 0}
    code, said = answer(port, "param", "set", "NAV_DLL_ACT", "explode")
    names = "go on, hold, return, land"
    assert (code, said["error"]) == (
        2, f"param set NAV_DLL_ACT: 'explode' is not a number, nor one of: {names}"
    )  # fmt: skip
    assert answer(port, "param", "set", "NAV_DLL_ACT", "0")[1]["parameters"] == {"NAV_DLL_ACT": 0}


def test_of_a_file_what_is_refused_is_told_by_name_and_the_rest_is_set(port, answer, tmp_path):
    file = tmp_path / "some.parm"
    file.write_text("DRK_KPP 1.25\nNOT_HERE 1\nRTL_RETURN_ALT 1e6\nGF_ACTION 4\n")
    code, said = answer(port, "param", "load", str(file))
    assert (code, said["ok"], said["parameters"]) == (4, False, {"DRK_KPP": 1.25})
    assert said["error"] == "3 of 4 parameters refused: GF_ACTION, NOT_HERE, RTL_RETURN_ALT"
    reasons = {name: (row["value"], row["reason"]) for name, row in said["refused"].items()}
    assert reasons["NOT_HERE"] == (1.0, "the vehicle has no such parameter")
    assert reasons["RTL_RETURN_ALT"] == (1e6, "RTL_RETURN_ALT = 1e+06 refused: 1e+06 is outside 1..500")
    assert "4 (terminate) is not available" in reasons["GF_ACTION"][1]
    assert answer(port, "param", "get", "GF_ACTION")[1]["parameters"] == {"GF_ACTION": 2}


@pytest.mark.long
def test_a_mission_goes_up_and_down(port, answer, tmp_path):
    back = tmp_path / "back.plan"
    assert answer(port, "mission", "upload", str(DATA / "square.plan"))[1]["items"] == 6
    assert answer(port, "mission", "download", str(back))[1]["items"] == 6
    assert json.loads(back.read_text())["mission"]["items"]
    assert answer(port, "mission", "clear")[1]["items"] == 0
    assert answer(port, "mission", "status")[1]["items"] == 0


def fenced(path):
    """A plan with fence, rally point and home."""
    plan = json.loads((DATA / "square.plan").read_text())
    plan["geoFence"] = {
        "circles": [{"circle": {"center": [43.5648, 1.4811], "radius": 100}, "inclusion": True, "version": 1}],
        "polygons": [
            {"inclusion": False, "polygon": [[43.5645, 1.4811], [43.5645, 1.4812], [43.5644, 1.4811]], "version": 1}
        ],
        "version": 2,
    }
    plan["rallyPoints"] = {"points": [[43.5649, 1.4812, 20.0]], "version": 2}
    path.write_text(json.dumps(plan))
    return plan


@pytest.mark.long
def test_what_is_downloaded_is_the_whole_plan(port, answer, tmp_path):
    plan, back = fenced(tmp_path / "in.plan"), tmp_path / "back.plan"
    assert answer(port, "mission", "upload", str(tmp_path / "in.plan"))[0] == 0
    code, said = answer(port, "mission", "download", str(back))
    assert (code, said["items"], said["fence"], said["rally"], "left_out" in said) == (0, 6, 4, 1, False)
    held = json.loads(back.read_text())
    assert held["geoFence"] == plan["geoFence"]
    assert held["rallyPoints"] == plan["rallyPoints"]
    assert held["mission"]["plannedHomePosition"] == pytest.approx(said["home"])
    assert (held["mission"]["firmwareType"], len(held["mission"]["items"])) == (12, 6)
    waypoints = tmp_path / "back.waypoints"
    left_out = answer(port, "mission", "download", str(waypoints))[1]["left_out"]
    assert left_out == ["4 fence items, which only a .plan holds", "1 rally point, which only a .plan holds"]
    assert waypoints.read_text().splitlines()[1].split("\t")[8:10] != ["0.00000000", "0.00000000"]


def test_an_upload_that_is_refused_names_the_item_and_why(port, answer, tmp_path):
    plan = json.loads((DATA / "square.plan").read_text())
    plan["mission"]["items"][1] |= {"command": 183, "frame": 2, "params": [1, 1500, 0, 0, 0, 0, 0]}
    (tmp_path / "servo.plan").write_text(json.dumps(plan))
    code, said = answer(port, "mission", "upload", str(tmp_path / "servo.plan"))
    assert (code, said["ok"], said["item"]) == (4, False, 1)
    assert said["error"].startswith("upload failed: ")
    assert "183" in said["error"]
    assert any("item 1" in words for words in said["said"])


def test_rows_of_other_components_are_named_and_not_set(port, answer, tmp_path):
    before = answer(port, "param", "get", "DRK_HOV_VMAX")[1]["parameters"]["DRK_HOV_VMAX"]
    file = tmp_path / "gimbal.params"
    file.write_text("1\t154\tDRK_HOV_VMAX\t1.1\t9\n")
    code, said = answer(port, "param", "load", str(file))
    assert (code, said["ok"], said["parameters"]) == (0, True, {})
    assert [(row["name"], row["component"]) for row in said["left_out"]] == [("DRK_HOV_VMAX", 154)]
    file.write_text(f"1\t1\tDRK_HOV_VMAX\t{before}\t9\n1\t154\tDRK_HOV_VMAX\t7\t9\n")
    assert answer(port, "param", "diff", str(file))[1]["differ"] == {}
    assert answer(port, "param", "get", "DRK_HOV_VMAX")[1]["parameters"] == {"DRK_HOV_VMAX": before}


def test_without_a_vehicle_it_says_so_in_its_time(answer):
    (silent,) = free_ports(1)
    code, said = answer(silent, "cmd", "arm", "--timeout", "0.5")
    told = {"ok": False, "command": "cmd arm", "error": "no vehicle heard for 0.5 s", "exit_code": 3}
    assert (code, said) == (3, told)


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("cmd", "goto", "1"), "goto takes 3 values, not 1"),
        (("cmd", "takeoff", "high"), "high are not numbers"),
        (("param", "diff", "a.parm", "b.parm"), "param diff takes 0 or 1 values, not 2"),
        (("mission", "upload", "none.plan"), "cannot be read"),
    ],
)
def test_a_wrong_argument_needs_no_vehicle(words, said, capsys):
    assert main(words) == 2
    assert said in capsys.readouterr().err
