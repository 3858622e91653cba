"""The study of the region of attraction: thresholds, tables, plot and command."""

import math
from functools import partial

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.airframe import load
from sitl.commands.region import _lines
from sitl.design.lqr import hover_gains
from sitl.design.region import Certificate, certify
from sitl.errors import SitlError
from sitl.studies import region
from sitl.studies.region import Result, share_at, study, threshold
from sitl.studies.region_flights import BANDS, Flights
from sitl.studies.region_plot import save_plot

NOMINAL = load("nominal").parameters


def flights_of(start, converged):
    n = len(start)
    band = np.searchsorted(BANDS, start, side="right") - 1
    yes, no = np.ones(n, dtype=bool), np.zeros(n)
    return Flights(np.array(start, dtype=float), band, yes, np.array(converged, dtype=bool), yes, no, no)


def test_a_threshold_is_where_the_share_falls_below():
    flights = flights_of(np.arange(1.0, 400.0), np.arange(1.0, 400.0) < 100.0)
    assert threshold(flights, 0.95) == 99.0
    assert share_at(flights, 50.0) == 1.0
    assert share_at(flights, 100.0) == pytest.approx(20.0 / 46.0)  # 80 to 99 of 80 to 125
    assert math.isnan(share_at(flights, 1000.0))
    assert threshold(flights_of([1.0, 2.0, 3.0], [0, 0, 0]), 0.95) == 0.0
    assert threshold(flights_of([1.0, 2.0, 3.0, 4.0], [1, 0, 1, 1]), 0.66) == 4.0


def test_the_study_proves_and_flies_every_law(monkeypatch):
    laws = {"LQI": hover_gains(NOMINAL), "LQR": hover_gains(NOMINAL, integral=False)}
    monkeypatch.setattr(region, "laws", lambda _: laws)
    monkeypatch.setattr(region, "certify", partial(certify, precision=1.0))
    results = study(NOMINAL, 6, 1)
    assert [(result.name, result.certificate is None) for result in results] == [("LQI", True), ("LQR", False)]
    assert results[1].certificate.level < results[1].rise
    for result in results:
        assert result.flown.start.size == result.spread.start.size == 6
        assert (result.flown.start == results[0].flown.start).all()
        assert result.settling[0].max() < 4.0


@pytest.fixture
def results():
    flights = flights_of(np.arange(1.0, 400.0), np.arange(1.0, 400.0) < 100.0)
    settling = np.full((5, 3), 3.0)
    certificate = Certificate(0.02, 0.06, 36.0, 0.86)
    return [
        Result("LQI as flown", hover_gains(NOMINAL), None, 0.05, 0.3, 0.6, settling, flights, flights),
        Result(
            "LQR", hover_gains(NOMINAL, integral=False), certificate, 0.047, 0.3, 0.9, settling, flights, flights
        ),
    ]  # fmt: skip


def test_the_tables_say_what_is_proved_and_what_is_advised(results):
    text = "\n".join(_lines(results))
    assert "0.0200   0.0470     0.0600    0.860   0.11 m" in text
    assert "1.00 (1.00)" in text
    assert " ".join(text.splitlines()[-1].split()) == "LQR 99 99 50/99 100.0%/100.0% sound 0.0%/0.0% too high"


def test_the_plot_is_written_or_said_not_to_be(results, tmp_path):
    save_plot(results, tmp_path / "region.svg")
    assert "too high" not in (tmp_path / "region.svg").read_text()
    with pytest.raises(SitlError, match="nowhere"):
        save_plot(results, tmp_path / "nowhere" / "region.svg")


def test_too_few_samples_are_one_line(capsys):
    assert main(["region", "--samples", "2"]) == 2
    assert "at least 6" in capsys.readouterr().err
    assert main(["region", "--airframe", "nothing"]) == 2
    with pytest.raises(SitlError, match="seed"):
        study(NOMINAL, 60, -1)
