"""The point mass as it is made of an airframe and its tuning, and the two flights as they are compiled."""

import math

import pytest

from sitl.control.reference import leg
from sitl.model.airframe_files import load
from sitl.model.vectors import Vector
from sitl.prediction.forward_leg import WingLeg, fly_wing
from sitl.prediction.hover_leg import HoverLeg, fly_hover
from sitl.prediction.point_mass import point_mass
from sitl.simulation.tuning import Tuning

A = load("nominal").parameters
STILL = Vector(0.0, 0.0, 0.0)
WING = WingLeg(
    leg((0.0, 0.0, 0.0), (100.0, 0.0, 5.0), 15.0), STILL, 0.5, STILL, 0.0, 0.0, 0.5, 3.0,
    begin=True, end=True, upright=False,
)  # fmt: skip
HOVER = HoverLeg(Vector(-20.0, 0.0, -2.0), STILL, Vector(0.0, 2.0, 0.0), 0.0, STILL, 3.0, 0.5)


def test_it_is_made_once_for_a_tuning_and_anew_for_another():
    assert point_mass(A, Tuning()) is point_mass(A, Tuning())
    assert point_mass(A, Tuning(lam=8.0)).lam == 8.0


def test_whole_numbers_as_parameters_do_not_change_its_types():
    """Or its flights would be compiled again, seconds long, while the vehicle is in the air."""
    usual, whole = (
        point_mass(A, tuning)
        for tuning in (Tuning(), Tuning(kpp=2, kpd=1, k_delta=4, lam=9, zeta=1, k_q=2, v_enter=10))
    )

    def types(value):
        return [types(field) for field in value] if isinstance(value, tuple) else type(value)

    assert types(whole) == types(usual)


@pytest.mark.parametrize("tuning", [Tuning(), Tuning(design=1), Tuning(integral=0, governor=0)])
def test_its_tables_are_laid_out_the_same_whatever_the_design(tuning):
    S = point_mass(A, tuning).linear.S
    assert S.flags.c_contiguous
    assert S.shape == (12, 12)


def test_the_linear_law_is_stable_as_the_point_mass_feels_it():
    """s^2 + k_v s + k_p, the lead of the integral given back."""
    law = point_mass(A, Tuning()).linear
    for k_p, k_v, k_i in ((law.k_p, law.k_v, law.k_i), (law.k_z, law.k_vz, law.k_iz)):
        assert min(k_p, k_v, k_i) > 0.0
        whole_k_p = k_p + law.lead * k_i
        assert k_v * whole_k_p > k_i  # Routh, of s^3 + k_v s^2 + k_p s + k_i


def test_compiled_and_plain_the_flights_are_the_same_to_the_bit():
    body = point_mass(A, Tuning())
    for fly, flown in ((fly_hover, HOVER), (fly_wing, WING)):
        assert getattr(fly, "py_func", fly)(flown, body) == fly(flown, body)


def test_nobody_waits_for_a_leg_that_never_ends():
    body = point_mass(A, Tuning())
    assert fly_hover(HOVER._replace(acceptance=-1.0), body) == (math.inf, math.inf)
    storm = WING._replace(wind=Vector(-30.0, 0.0, 0.0))
    assert fly_wing(storm, body) == (math.inf, math.inf)
