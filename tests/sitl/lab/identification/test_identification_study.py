"""An identification as a person reads it."""

import json
from dataclasses import replace

import pytest

from protocol.dialect.vocabulary import Law
from sitl.__main__ import main
from sitl.control.reference import hover_at
from sitl.errors import SitlError
from sitl.lab.identification.identification_study import as_text, write_airframe
from sitl.model.airframe_files import load
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from tests.support.lab.identified_flight import identified
from tests.support.paths import DATA


@pytest.mark.long
def test_the_tables_say_values_intervals_ratios_and_what_is_not_told():
    found = identified("collage", 3, hovering=True)
    lines = as_text(found, "collage", mass_given=False).splitlines()
    (thrust,) = [line for line in lines if line.startswith("k_f ")]
    row = next(row for row in found.parameters if row.key == "k_f")
    assert thrust.split()[-6:-3] == [f"{row.before:.4g}", f"{row.estimate:.4g}", f"{row.interval:.2g}"]
    assert thrust.endswith(f"{row.estimate / row.before:.3f}")
    assert any(line.startswith("yaw damping, 15 m/s") and line.endswith("not told") for line in lines)
    assert any(line.startswith("specific force z") and line.endswith("m/s2") for line in lines)
    assert any("0.492 kg is that of collage (--mass)" in line for line in lines)
    assert any(line.startswith("  forward flight: at most") for line in lines)


@pytest.mark.long
def test_a_given_mass_is_called_given():
    text = as_text(identified("collage", 3, hovering=True), "collage", mass_given=True)
    assert "kg is what you gave (--mass)" in text


# An identified airframe as a file that flies.


def differing(one, other):
    """Names of the constants in which two airframes differ."""
    return {name for name in one._fields if getattr(one, name) != pytest.approx(getattr(other, name), rel=1e-4)}


@pytest.mark.long
def test_the_file_is_the_identified_airframe_and_flies(tmp_path):
    found, path = identified("collage", 3), tmp_path / "mine.toml"
    write_airframe(found, load("collage"), {}, "flight.tlog", path)
    mine = load(str(path))
    assert mine.name == "mine"
    assert differing(mine.parameters, found.airframe) <= {"vibration_speed"}  # which goes with the hover
    vehicle = Simulation(mine.parameters, start=Start(up=20.0, airborne=True))
    vehicle.begin_flight(Law.HOVER_ZERO_MOMENT)
    vehicle.reference = hover_at((0.0, 0.0, 20.0), 0.0)
    vehicle.step(2.0)
    assert vehicle.truth.body.position == pytest.approx((0.0, 0.0, 20.0), abs=0.1)


@pytest.mark.long
def test_a_set_of_a_file_of_its_own_is_written_in_full(tmp_path):
    found, first, second = identified("collage", 3), tmp_path / "first.toml", tmp_path / "second.toml"
    write_airframe(found, load("collage"), {}, "flight.tlog", first)
    rows = tuple(row._replace(estimate=1.0) if row.key == "advance" else row for row in found.parameters)
    again = replace(found, base=load(str(first)).parameters, parameters=rows)
    write_airframe(again, load(str(first)), {"m": 0.6}, "flight.tlog", second)
    assert "base =" not in second.read_text()
    assert differing(load(str(second)).parameters, found.airframe._replace(m=0.6)) <= {"vibration_speed"}


@pytest.mark.long
def test_a_propeller_takes_more_power_than_it_gives(tmp_path):
    found, path = identified("collage", 3), tmp_path / "mine.toml"
    rows = tuple(row._replace(estimate=0.3 * row.before) if row.key == "k_m" else row for row in found.parameters)
    write_airframe(replace(found, parameters=rows), load("collage"), {}, "flight.tlog", path)
    torque = load(str(path)).values["torque_factor"]
    assert torque.value > 0.3
    assert torque.source.startswith("raised from 0.3")


@pytest.mark.long
def test_what_was_not_told_says_so(tmp_path):
    path = tmp_path / "hover.toml"
    write_airframe(identified("collage", 3, hovering=True), load("collage"), {}, "h.tlog", path)
    values = load(str(path)).values
    assert values["C_nr"].source == "identified from h.tlog, which hardly tells it: near the set's value"
    assert "within" in values["thrust_factor"].source


@pytest.mark.long
def test_a_file_that_cannot_be_written_is_named(tmp_path):
    path = tmp_path / "nowhere" / "mine.toml"
    with pytest.raises(SitlError, match=r"mine\.toml: cannot be written"):
        write_airframe(identified("collage", 3), load("collage"), {}, "flight.tlog", path)


# ``darko-sitl study identify``: its arguments, and from a flight to a file that flies.


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


@pytest.mark.long
def test_a_flight_becomes_figures_and_an_airframe(tmp_path, capsys):
    log, mine, plot = (str(tmp_path / name) for name in ("flight.tlog", "mine.toml", "left.png"))
    assert main(["study", "identify", "--fly", log, "--hover", "--off", "0.1", "--seed", "2"]) == 0
    assert "17 s of collage, 10 % off by seed 2; it flew on" in capsys.readouterr().out
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
