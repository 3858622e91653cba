"""An identified airframe as a file that flies."""

from dataclasses import replace

import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.reference import hover_at
from sitl.errors import SitlError
from sitl.lab.identification.identification_study import write_airframe
from sitl.model.airframe_files import load
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from tests.support.lab.identified_flight import identified


def test_the_file_is_the_identified_airframe_and_flies(tmp_path):
    found, path = identified("physical", 3), tmp_path / "mine.toml"
    write_airframe(found, load("physical"), {}, "flight.tlog", path)
    mine = load(str(path))
    assert mine.name == "mine"
    assert mine.parameters == pytest.approx(found.airframe, rel=1e-4)
    vehicle = Simulation(mine.parameters, start=Start(up=20.0, airborne=True))
    vehicle.begin_flight(Law.HOVER_ZERO_MOMENT)
    vehicle.reference = hover_at((0.0, 0.0, 20.0), 0.0)
    vehicle.step(2.0)
    assert vehicle.truth.body.position == pytest.approx((0.0, 0.0, 20.0), abs=0.1)


def test_a_set_of_a_file_of_its_own_is_written_in_full(tmp_path):
    found, first, second = identified("physical", 3), tmp_path / "first.toml", tmp_path / "second.toml"
    write_airframe(found, load("physical"), {}, "flight.tlog", first)
    rows = tuple(row._replace(estimate=1.0) if row.key == "advance" else row for row in found.parameters)
    again = replace(found, base=load(str(first)).parameters, parameters=rows)
    write_airframe(again, load(str(first)), {"m": 0.6}, "flight.tlog", second)
    assert "base =" not in second.read_text()
    assert load(str(second)).parameters == pytest.approx(found.airframe._replace(m=0.6), rel=1e-4)


def test_a_propeller_takes_more_power_than_it_gives(tmp_path):
    found, path = identified("physical", 3), tmp_path / "mine.toml"
    rows = tuple(row._replace(estimate=0.3 * row.before) if row.key == "k_m" else row for row in found.parameters)
    write_airframe(replace(found, parameters=rows), load("physical"), {}, "flight.tlog", path)
    torque = load(str(path)).values["torque_factor"]
    assert torque.value > 0.3
    assert torque.source.startswith("raised from 0.3")


def test_what_was_not_told_says_so(tmp_path):
    path = tmp_path / "hover.toml"
    write_airframe(identified("physical", 3, hovering=True), load("physical"), {}, "h.tlog", path)
    values = load(str(path)).values
    assert values["C_nr"].source == "identified from h.tlog, which hardly tells it: near the set's value"
    assert "within" in values["thrust_factor"].source


def test_a_file_that_cannot_be_written_is_named(tmp_path):
    path = tmp_path / "nowhere" / "mine.toml"
    with pytest.raises(SitlError, match=r"mine\.toml: cannot be written"):
        write_airframe(identified("physical", 3), load("physical"), {}, "flight.tlog", path)
