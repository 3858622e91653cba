"""The page of ``darko-sitl study validate``: what stands on it, its exit code, and what it refuses."""

import math
import re

import pytest

from sitl import load_airframe
from sitl.__main__ import main
from sitl.lab.reproduction.experiment import Conditions, Expectation, Experiment, ExperimentResult, Statement
from sitl.lab.validation import validation_page
from sitl.lab.validation.validation_page import wall_experiment, wall_statements
from sitl.lab.validation.wall_flight import Comparison, SteadyFlight, compared


@pytest.fixture
def few(monkeypatch):
    """Leave one experiment beside the wall flight: with a row that nothing explains, or one that agrees."""

    def leave(value):
        statement = Statement("thesis 3", "a number", Expectation("1", 0.5, 1.5, "± 0.5"), value)
        experiment = Experiment("one", "One", "thesis 3", "A run.", lambda _: ExperimentResult([statement], []))
        monkeypatch.setattr(validation_page, "CURVE_EXPERIMENTS", (experiment,))

    return leave


def test_the_page_holds_the_flight_with_its_drawing_and_says_what_agrees(tmp_path, few, capsys):
    few(1.0)
    out = tmp_path / "page.html"
    assert main(["study", "validate", "-o", str(out)]) == 0
    text = out.read_text()
    for part in ("22 statements: 22 reproduced.", "10 of 10 numbers derived again",
                 "12 of 12 numbers that constants were fitted to", '<section id="wall-flight">',
                 "<svg", "pitch at 3.38 m/s, predicted"):  # fmt: skip
        assert part in text
    assert not re.search(r'(src|href)="(?!#)|<script|Errata', text)
    told = capsys.readouterr()
    assert "every limit kept" in told.out
    assert f"wrote {out}" in told.out


@pytest.mark.long
def test_a_row_without_a_cause_makes_the_exit_code_one(tmp_path, few, capsys):
    few(2.0)
    assert main(["study", "validate", "-o", str(tmp_path / "page.html")]) == 1
    assert "unexplained: thesis 3, a number: 1, here 2" in capsys.readouterr().err
    few(1.0)
    assert main(["study", "validate", "--airframe", "collage", "-o", str(tmp_path / "page.html")]) == 1
    assert "missed in 2.57 m/s: pitch" in capsys.readouterr().out


def test_a_page_that_cannot_be_is_refused_before_anything_is_computed(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(validation_page, "compared", lambda *_: pytest.fail("computed"))
    assert main(["study", "validate", "-o", str(tmp_path / "missing" / "page.html")]) != 0
    assert "there is no folder" in capsys.readouterr().err


def test_the_flight_s_limits_are_the_rows_limits():
    flown = SteadyFlight(3.0, 80.0, 2.0, 3.0)
    off = Comparison(flown, SteadyFlight(3.0, 83.1, 5.1, 3.13), fitted=False)
    near = Comparison(flown, SteadyFlight(3.0, 82.9, 4.9, 3.11), fitted=False)
    assert [row.expected.holds(row.value) for row in wall_statements([off])] == [False] * 4
    assert [row.expected.holds(row.value) for row in wall_statements([near])] == [True, True, True, False]
    untold = Comparison(flown._replace(thrust=math.nan), near.model, fitted=False)
    assert len(wall_statements([untold])) == 3


def test_the_flight_is_an_experiment_of_the_airframe_that_is_asked_for():
    darko = load_airframe("darko")
    experiment = wall_experiment(darko.name, compared(darko.parameters), darko.parameters)
    assert experiment.airframes == ("darko",)
    assert len(experiment.run(Conditions()).panels) == 1
