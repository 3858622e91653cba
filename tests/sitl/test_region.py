"""The flown region of attraction of the linear hover law, beside the proved one."""

import math

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.commands.region import _lines
from sitl.design import linearise
from sitl.design.lmi import DECAY, lmi_gains
from sitl.design.lqr import hover_gains, lqr
from sitl.design.region import Certificate, certify
from sitl.errors import SitlError
from sitl.laws import hover_linear
from sitl.studies.region import (
    BANDS,
    LEVEL,
    STEPS,
    Flights,
    Result,
    decay_seen,
    draw,
    fly,
    save_plot,
    share_at,
    steps,
    study,
    threshold,
)
from tests.support import hover_flight
from tests.support.hover_flight import LINEAR_ALONE, NOMINAL, Law

LQR = hover_gains(NOMINAL, integral=False)
REPORT = LQR._replace(reach=math.inf)
GENTLE = LQR._replace(K=np.ascontiguousarray(lqr(*linearise.hover(NOMINAL), np.eye(12), 10.0 * np.eye(4))[0]))


@pytest.fixture(scope="module")
def certificate():
    return certify(NOMINAL, LQR, precision=1.0)


# The flights


@pytest.mark.parametrize("envelope", [True, False])
def test_draws_are_what_they_say(envelope):
    states = draw(LQR.S, 60, 3, envelope=envelope)
    assert np.bincount(states[:, LEVEL + 1].astype(int)).tolist() == [10] * 6
    assert (states == draw(LQR.S, 60, 3, envelope=envelope)).all()
    for state in states:
        x, plant = np.empty(12), np.zeros(25)
        plant[:13] = state[:13]
        hover_linear.error(plant, np.zeros(3), 0.0, x)
        level, band = state[LEVEL:]
        assert hover_linear.lyapunov(x, LQR) == pytest.approx(level)
        assert BANDS[int(band)] <= level <= BANDS[int(band) + 1]
        assert np.linalg.norm(plant[6:10]) == pytest.approx(1.0)


def test_the_study_flies_the_vehicle():
    """Settling times of steps are those of the whole vehicle under the linear law."""
    settling = steps(NOMINAL, LQR)
    for row, axis in ((0, 1), (4, 2)):
        target = np.zeros(3)
        target[axis] = STEPS[row]
        flight = hover_flight.fly(target, law=Law.HOVER_LINEAR, duration=8.0, integral=0, **LINEAR_ALONE)
        assert settling[row, axis] == pytest.approx(flight.settled(0.05), abs=0.011)


def test_flights_from_the_proved_set_converge_and_fewer_do_from_far(certificate):
    near = draw(LQR.S, 20, 1, envelope=False, bands=(0.0, certificate.level))
    flights = fly(NOMINAL, LQR, near, 1e-4)
    assert flights.converged[flights.upright].all()
    assert not flights.upright.all()  # x is as small for some that stand on their heads
    states = draw(LQR.S, 60, 1, envelope=True)
    ours, report, gentle = (fly(NOMINAL, gains, states, 0.01).converged for gains in (LQR, REPORT, GENTLE))
    assert ours[:10].all()
    assert report.mean() < ours.mean() < gentle.mean()
    assert states[~ours, LEVEL].min() > certificate.level


def test_the_decay_flown_is_faster_than_v_s_own_bound():
    assert 0.37 < decay_seen(NOMINAL, LQR) < 1.2


def test_the_lmi_s_gain_settles_like_the_lqr_and_loses_fewer():
    gains = lmi_gains(NOMINAL)
    assert decay_seen(NOMINAL, gains) > DECAY
    assert steps(NOMINAL, gains).max() < steps(NOMINAL, LQR).max() + 1.5
    states = draw(LQR.S, 120, 2, envelope=True)
    ours, theirs = (fly(NOMINAL, law, states, 0.01) for law in (gains, LQR))
    assert ours.converged.mean() > theirs.converged.mean() + 0.1
    assert ours.saturated.mean() < 0.5 * theirs.saturated.mean()


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


# The command


@pytest.fixture
def results():
    flights = flights_of(np.arange(1.0, 400.0), np.arange(1.0, 400.0) < 100.0)
    settling = np.full((5, 3), 3.0)
    certificate = Certificate(0.02, 0.06, 36.0, 0.86)
    return [
        Result("LQI as flown", hover_gains(NOMINAL), None, 0.05, 0.3, 0.6, settling, flights, flights),
        Result("LQR", LQR, certificate, 0.047, 0.3, 0.9, settling, flights, flights),
    ]


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
