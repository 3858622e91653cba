"""The study of the hover's V in winds: equilibria, their table, the figures of flights, and refused arguments."""

import math

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.design.proved import proved_gains
from sitl.lab.proofs.closed_loop import linear_loop, lyapunov_matrix
from sitl.lab.studies import hover_winds
from sitl.lab.studies.hover_winds import (
    WIND_GRID,
    Equilibria,
    WindDraw,
    WindLooks,
    equilibrium,
    fly,
    jacobian,
    lines,
    near_equilibria,
    rates,
    row,
)
from sitl.lab.studies.seeded_flights import Craft
from sitl.model.airframe_files import load

NOMINAL = load("nominal").parameters
GAINS = proved_gains(NOMINAL)
P = lyapunov_matrix(GAINS)
CALM = np.zeros(3)


def test_the_calm_hover_is_an_equilibrium_and_the_loop_there_is_the_proof_s():
    assert np.abs(rates(np.zeros(15), CALM, NOMINAL, GAINS)).max() < 1e-12
    assert jacobian(np.zeros(15), CALM, NOMINAL, GAINS) == pytest.approx(linear_loop(NOMINAL, GAINS), abs=1e-4)


@pytest.mark.parametrize("wind", [(3.0, 0.0, 0.0), (-4.0, 0.0, 0.0), (2.0, -3.0, 0.5)])
def test_the_law_stands_still_at_an_equilibrium_in_a_wind(wind):
    x = equilibrium(np.array(wind), NOMINAL, GAINS)
    assert np.abs(rates(x, np.array(wind), NOMINAL, GAINS)).max() < 1e-8
    assert not x[:6].any()
    assert not x[9:12].any()


def test_a_wind_from_the_side_leaves_the_hover_as_it_is():
    assert np.abs(equilibrium(np.array((0.0, 4.0, 0.0)), NOMINAL, GAINS)).max() < 1e-8


def test_the_table_holds_the_equilibria_and_interpolates_them(monkeypatch):
    monkeypatch.setattr(hover_winds, "WIDEST_WIND", 2.0)
    table, wind = Equilibria.of(NOMINAL, GAINS), np.array((-2.0, 1.0, 0.0))
    found = equilibrium(wind, NOMINAL, GAINS)
    at = table.at(np.array([wind, (-1.5, 1.0, 0.0), (-9.0, 1.0, 0.0)]))
    assert at[0] == pytest.approx(found, abs=1e-6)
    assert at[1] == pytest.approx(0.5 * (found + table.at(np.array([(-1.0, 1.0, 0.0)]))[0]), abs=1e-9)
    assert at[2] == pytest.approx(found, abs=1e-6)
    assert pytest.approx(1.0) == WIND_GRID


def looks(believed, true, wind=3.0):
    """A flight of three looks under the linear law, the last two settled."""
    blowing = np.tile((-wind, 0.0, 0.0), (3, 1))
    return WindLooks(wind, np.array([1.0, 30.0, 39.0]), np.ones(3, dtype=bool), believed, true, blowing, blowing)


def test_v_is_judged_about_the_equilibrium_in_the_wind():
    """At it V about the calm hover is too large; one that moves off by a metre leaves."""
    table, home = Equilibria.of(NOMINAL, GAINS), equilibrium(np.array((-3.0, 0.0, 0.0)), NOMINAL, GAINS)
    still = np.tile(home, (3, 1))
    away = still.copy()
    away[2, 0] += 1.5
    made = row([looks(still, still), looks(still, away)], table, P)
    assert (made.wind, made.flights, made.entered) == (3.0, 2, 2)
    assert (made.calm, made.windy, made.stayed, made.inside) == (0.0, 1.0, 0.5, 0.75)
    assert made.usual < 1e-6


def test_a_flight_that_never_enters_counts_for_nothing():
    flight = looks(np.zeros((3, 15)), np.zeros((3, 15)))._replace(is_linear=np.zeros(3, dtype=bool))
    made = row([flight], Equilibria.of(NOMINAL, GAINS), P)
    assert made.entered == 0
    assert math.isnan(made.calm)
    assert len(list(lines([made]))) == 2


def test_v_of_the_calm_hover_does_not_fall_near_the_equilibrium_in_a_wind():
    falls = [float(line.split()[-2]) for line in list(near_equilibria(NOMINAL, GAINS))[1:]]
    assert falls[0] > 0.05
    assert falls[-1] < -0.5
    assert falls == sorted(falls, reverse=True)


def test_a_recovery_ends_near_the_equilibrium_in_its_wind(monkeypatch):
    monkeypatch.setattr(hover_winds, "RECOVERY_SECONDS", 12.0)
    flown = fly(WindDraw(1, 2.0, 0.0), Craft("nominal"))
    assert np.hypot(*flown.blowing[-1][:2]) == pytest.approx(2.0)
    assert flown.is_linear[-1]
    home = equilibrium(flown.blowing[-1], NOMINAL, GAINS)
    assert np.abs(flown.true[-1] - home)[6:9].max() < 0.02
    assert np.abs(flown.believed[-1] - flown.true[-1])[:3].max() < 0.5


def test_an_airframe_that_nothing_is_proved_of_and_too_many_gusts_are_refused(capsys):
    assert main(["study", "winds", "--airframe", "darko", "--flights", "1"]) == 2
    assert "no V is stored" in capsys.readouterr().err
    assert main(["study", "winds", "--gusts", "11", "--flights", "1"]) == 2
