"""The proved and the flown region of attraction of the linear hover law."""

import math

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.airframe import load
from sitl.commands.region import _lines
from sitl.design import linearise, region
from sitl.design.closed_loop import AttitudeBoxes, coordinates
from sitl.design.lqr import hover_gains, lqr
from sitl.design.region import Certificate, certify, chart_level, first_rise, lyapunov_rate, saturation_level
from sitl.errors import SitlError
from sitl.laws import hover_linear
from sitl.laws.allocation import allocate
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
TO_X = np.linalg.inv(np.linalg.cholesky(LQR.S))  # rows of unit y to V = 1


@pytest.fixture(scope="module")
def certificate():
    return certify(NOMINAL, LQR, precision=1.0)


def directions(count, seed=1):
    y = np.random.default_rng(seed).standard_normal((count, 12))
    return y / np.linalg.norm(y, axis=1)[:, None] @ TO_X


# The proof


@pytest.mark.parametrize("airframe", [NOMINAL, load("published").parameters])
def test_the_proof_s_matrices_are_the_plant(airframe):
    """On boxes that are points, with the rates, airspeed and elevons of the state, y' W y is -V' exactly."""
    gains = hover_gains(airframe, integral=False)
    proof = region._Proof.of(airframe, gains)
    for x in 0.2 * directions(20):
        f = (coordinates() @ x)[None]
        at = AttitudeBoxes(f, f)
        W = proof.W - np.einsum("nj,jkl->nkl", f, proof.tilt) - np.einsum("j,jkl->kl", x[9:], proof.gyro)
        u, command, none = np.empty(4), np.empty(4), (np.zeros((1, 12, 12)), np.zeros(1))
        hover_linear.control(x, np.zeros(3), 0.0, gains, u)
        assert allocate(u, airframe, command) == 0
        eta = math.sqrt(x[3:6] @ x[3:6] + airframe.mu * airframe.c**2 * x[9:] @ x[9:])
        deflections = (1.0, command[2] + command[3], command[2] - command[3])
        for G, d in zip(proof.aero, deflections, strict=True):
            W = W + 0.5 * airframe.rho * airframe.S * eta * d * region._take_off(proof._air(at, G), *none)[0]
        W, slack = region._take_off(proof._remainder(at), W, np.zeros(1))
        y = proof.L.T @ x
        assert slack == pytest.approx(0.0, abs=1e-9)
        assert -(y @ W[0] @ y) == pytest.approx(lyapunov_rate(x, gains, airframe), rel=1e-9, abs=1e-12)


def test_v_falls_on_the_plant_everywhere_in_the_proved_set(certificate):
    shares = np.linspace(0.02, 1.0, 3000)
    for share, x in zip(shares, directions(3000), strict=True):
        assert lyapunov_rate(math.sqrt(share * certificate.level) * x, LQR, NOMINAL) < 0.0


def test_the_proof_is_within_a_factor_of_the_first_rise(certificate):
    rise = first_rise(NOMINAL, LQR, searches=2)
    assert 0.04 < rise < 0.06
    assert rise < 4.0 * certificate.level
    proof = region._Proof.of(NOMINAL, LQR)
    assert proof.holds(0.1 * certificate.level)
    assert not proof.holds(rise)


def test_no_actuator_meets_a_limit_below_the_saturation_level():
    level = saturation_level(NOMINAL, LQR)
    assert region.greatest_deflection(LQR, level) == pytest.approx(NOMINAL.delta_max)
    u, command = np.empty(4), np.empty(4)
    most = 0.0
    for sign in (-1.0, 1.0):  # where the ellipsoid touches the plane of an elevon's limit
        x = np.linalg.solve(LQR.S, NOMINAL.delta_max * LQR.K[0] + sign * LQR.K[2])
        x *= math.sqrt(level / (x @ LQR.S @ x))
        hover_linear.control(x, np.zeros(3), 0.0, LQR, u)
        most = max(most, abs(u[2]) / u[0])
    assert most == pytest.approx(NOMINAL.delta_max)
    for x in math.sqrt(level) * directions(500):
        hover_linear.control(x, np.zeros(3), 0.0, LQR, u)
        assert allocate(u, NOMINAL, command) == 0


def test_v_does_not_tell_a_vehicle_on_its_head_from_the_hover():
    """Turned over its back to 1 deg from straight down: x holds eps alone, and eps is the hover's."""
    plant, x = np.zeros(25), np.empty(12)
    half = math.radians(269.0 / 2.0)
    plant[6], plant[8] = math.cos(half), -math.sin(half)
    hover_linear.error(plant, np.zeros(3), 0.0, x)
    assert hover_linear.lyapunov(x, LQR) < 0.01


def test_below_the_chart_s_level_eta_cannot_vanish():
    level = chart_level(LQR)
    eps = np.random.default_rng(1).standard_normal((20_000, 3))
    off = eps / np.linalg.norm(eps, axis=1)[:, None] - (0.0, -math.sqrt(0.5), 0.0)
    least = np.einsum("ni,ij,nj->n", off, region._marginal(LQR.S, slice(6, 9)), off).min()
    assert level <= least < 1.02 * level


def test_what_the_proof_does_not_cover_is_refused():
    with pytest.raises(SitlError, match="integral"):
        certify(NOMINAL, hover_gains(NOMINAL))
    with pytest.raises(SitlError, match="no pair"):
        certify(NOMINAL, LQR._replace(S=np.eye(12)))


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
