"""The study of the region of attraction: thresholds, results of every law, and the plot."""

import math
from functools import partial

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.design.lqr import hover_gains
from sitl.errors import SitlError
from sitl.lab.proofs.region import certify
from sitl.lab.proofs.rise import first_rise
from sitl.lab.studies import hover_region
from sitl.lab.studies.hover_region import _lines, save_plot, share_at, study, threshold
from tests.support.lab.region_results import NOMINAL, flights_of, made_up_results


def test_a_threshold_is_where_the_share_of_converging_flights_falls_below_the_limit():
    flights = flights_of(np.arange(1.0, 400.0), np.arange(1.0, 400.0) < 100.0)
    assert threshold(flights, 0.95) == 99.0
    assert share_at(flights, 50.0) == 1.0
    assert share_at(flights, 100.0) == pytest.approx(20.0 / 46.0)  # 80 to 99 of 80 to 125
    assert math.isnan(share_at(flights, 1000.0))
    assert threshold(flights_of([1.0, 2.0, 3.0], [0, 0, 0]), 0.95) == 0.0
    assert threshold(flights_of([1.0, 2.0, 3.0, 4.0], [1, 0, 1, 1]), 0.66) == 4.0


@pytest.mark.long
def test_the_study_proves_and_flies_every_law(monkeypatch):
    laws = {"LQI": hover_gains(NOMINAL), "LQR": hover_gains(NOMINAL, integral=False)}
    monkeypatch.setattr(hover_region, "laws", lambda _: laws)
    monkeypatch.setattr(hover_region, "certify", partial(certify, precision=1.0))
    monkeypatch.setattr(hover_region, "first_rise", partial(first_rise, searches=1))
    results = study(NOMINAL, 6, 1)
    assert [(result.name, result.certificate is None) for result in results] == [("LQI", True), ("LQR", False)]
    assert results[1].certificate.level < results[1].rise
    for result in results:
        assert result.flown.start.size == result.spread.start.size == 6
        assert (result.flown.start == results[0].flown.start).all()
        assert result.settling[0].max() < 4.0


@pytest.mark.long
def test_the_plot_is_written_or_an_error_names_its_path(tmp_path):
    save_plot(made_up_results(), tmp_path / "region.svg")
    assert "too high" not in (tmp_path / "region.svg").read_text()
    with pytest.raises(SitlError, match="nowhere"):
        save_plot(made_up_results(), tmp_path / "nowhere" / "region.svg")


def test_a_negative_seed_is_refused():
    with pytest.raises(SitlError, match="seed"):
        study(NOMINAL, 60, -1)


# ``darko-sitl study region``: its tables, and refused arguments.


def test_the_tables_show_proved_levels_and_advised_thresholds():
    text = "\n".join(_lines(made_up_results()))
    assert "0.0200   0.0470     0.0600   0.1000    0.860   0.11 m" in text
    assert "1.00 (1.00)" in text
    assert " ".join(text.splitlines()[-1].split()) == "LQR 99 99 50/99 100.0%/100.0% sound 0.0%/0.0% too high"


def test_bad_arguments_are_a_one_line_error(capsys):
    assert main(["study", "region", "--samples", "2"]) == 2
    assert "at least 6" in capsys.readouterr().err
    assert main(["study", "region", "--airframe", "nothing"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
