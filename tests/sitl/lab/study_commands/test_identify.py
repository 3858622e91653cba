"""``darko-sitl study identify``: its arguments, and from a flight to a file that flies."""

import json

import pytest

from sitl.__main__ import main
from sitl.model.airframe_files import load
from tests.support.paths import DATA


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "identify takes a flight's log, or --fly and the log to write"),
        (["a.tlog", "--fly", "b.tlog"], "identify takes a flight's log, or --fly"),
        (["a.tlog"], "a.tlog: cannot be read"),
        (["a.tlog", "--airframe", "none"], "no parameter set 'none'"),
        (["a.tlog", "--known", "J2"], "--known J2: must be KEY=VALUE"),
        (["a.tlog", "--known", "J2=-1"], "J2 = -1 must be positive"),
        (["a.tlog", "--known", "C_x=1"], "C_x is not one of m, g"),
        (["a.tlog", "--mass", "0"], "m = 0 must be positive"),
        (["a.tlog", "--channels", "1,2,3"], "--channels 1,2,3: must be four different outputs"),
        (["a.tlog", "--channels", "1,2,3,-3"], "must be four different outputs"),
        (["a.tlog", "--channels", "1,2,3,x"], "must be four different outputs"),
        (["a.tlog", "--write", "mine.txt"], "--write mine.txt: the name must end in .toml"),
        (["a.tlog", "--write", "/nowhere/mine.toml"], "there is no folder /nowhere"),
        (["a.tlog", "--plot", "/nowhere/x.png"], "there is no folder /nowhere"),
        (["--fly", "/nowhere/a.tlog"], "there is no folder /nowhere"),
        (["--fly", "a.tlog", "--off", "0.5"], "--off 0.5 is not within 0 and 0.3"),
        (["--fly", "a.tlog", "--wind", "9"], "--wind 9 is not within 0 and 8"),
        (["--fly", "a.tlog", "--seed", "-1"], "--seed -1: seeds are not negative"),
    ],
)
def test_bad_arguments_are_refused(arguments, message, capsys):
    assert main(["study", "identify", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_a_log_without_imu_says_so(capsys):
    assert main(["study", "identify", str(DATA / "square-flight.tlog")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "cannot identify from this log: no IMU (HIGHRES_IMU" in line


def test_a_flight_becomes_figures_and_an_airframe(tmp_path, capsys):
    log, mine, plot = (str(tmp_path / name) for name in ("flight.tlog", "mine.toml", "left.png"))
    assert main(["study", "identify", "--fly", log, "--hover", "--off", "0.1", "--seed", "2"]) == 0
    assert "17 s of physical, 10 % off by seed 2; it flew on" in capsys.readouterr().out
    arguments = ["--mass", "0.5", "--known", "J2=0.0028", "C_d0=0.025", "--write", mine, "--plot", plot, "--json"]
    assert main(["study", "identify", log, *arguments]) == 0
    told = capsys.readouterr()
    assert f"--airframe {mine}" in told.err
    assert load(mine).parameters.m == 0.5
    assert load(mine).parameters.J2 == 0.0028
    assert (tmp_path / "left.png").stat().st_size > 10_000
    found = json.loads(told.out)
    rows = {row["key"]: row for row in found["parameters"]}
    assert 0.0 < rows["k_f"]["interval"] < 0.1 * rows["k_f"]["estimate"]
    assert not {"J2", "C_d0", "m"} & rows.keys()
    assert found["mass"] == 0.5
    assert found["not_told"][0] == "mass"
    assert found["replay"]["after"]["position"] < found["replay"]["before"]["position"]
