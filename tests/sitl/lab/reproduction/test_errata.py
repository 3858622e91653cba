"""The errata and what they do if they stay."""

import numpy as np
import pytest

from sitl.lab.reproduction.errata import errata, power_of_rates, propeller_energy, rate_force_matrix, torque_sign
from sitl.lab.reproduction.experiment import Conditions
from sitl.model.airframe_files import load

PUBLISHED = load("published").parameters


def effect(place, word):
    (found,) = [e.effect for e in errata(Conditions()) if e.place.startswith(place) and word in e.printed]
    return found


def test_every_erratum_is_complete_and_stands_once():
    listed = errata(Conditions())
    assert all(all(cell.strip() for cell in erratum) for erratum in listed)
    assert len({(erratum.place, erratum.printed) for erratum in listed}) == len(listed)


def test_the_printed_force_from_body_rates_makes_energy_and_its_transpose_hardly_any():
    printed, transposed = power_of_rates(PUBLISHED, 1)
    assert printed.share > 2.0
    assert printed.greatest > 5.0
    assert transposed.share < 0.5
    assert transposed.greatest < 0.1


def test_with_a_damping_that_damps_the_transpose_makes_no_energy_at_all():
    """The remaining power with the transpose comes from C_lr and C_np."""
    _, transposed = power_of_rates(PUBLISHED._replace(C_lr=0.0, C_np=0.0), 2)
    assert transposed == (0.0, 0.0)


def test_the_force_of_the_rates_is_the_one_the_report_prints():
    a = PUBLISHED
    Phi = rate_force_matrix(a)
    expected = np.zeros((3, 3))
    expected[1, 2] = a.Delta_r / a.c * a.C_l
    assert Phi == pytest.approx(expected, abs=1e-9)


def test_the_propeller_makes_energy_in_fast_flight():
    text = propeller_energy(load("published").parameters)
    assert "1.45 at 25 m/s" in text
    assert "hover is 0.13" in text


@pytest.mark.long
def test_effects_follow_the_airframe():
    assert "0.012 N m" in effect("2.1.2", "J_p")
    assert "that of 2.2.1" in effect("2.1.2", "N_i")
    doubled = torque_sign(PUBLISHED._replace(k_m=2.0 * PUBLISHED.k_m))
    assert doubled.split()[0] == "144"
    assert torque_sign(PUBLISHED).split()[0] == "72"
