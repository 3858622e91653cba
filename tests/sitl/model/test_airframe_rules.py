"""The rules that the values of a parameter set have to keep together, at their limits."""

import math

import pytest

from sitl.model.airframe_files import RULES, AirframeError, load

NOMINAL = load("nominal").parameters
BIT = 1e-9


def holds(rule, **values):
    return RULES[rule].holds(NOMINAL._replace(**values))


@pytest.mark.parametrize("rule", RULES)
def test_the_nominal_set_keeps_every_rule(rule):
    assert holds(rule)


@pytest.mark.parametrize("largest", ["J1", "J2", "J3"])
def test_no_inertia_is_further_above_the_sum_of_the_other_two_than_an_error_of_measurement(largest):
    others = {"J1", "J2", "J3"} - {largest}
    small = dict.fromkeys(others, 0.25)
    assert holds("inertia", **small, **{largest: 0.525 - BIT})
    assert not holds("inertia", **small, **{largest: 0.525})


def test_an_inertia_that_reaches_that_sum_is_warned_of(tmp_path):
    rest = NOMINAL.J1 + NOMINAL.J2
    for inertia, warns in ((rest * 0.999, False), (rest * 1.02, True)):
        assert bool(mine_of(tmp_path, "J3", inertia, "kg m2").warnings) == warns
    (text,) = mine_of(tmp_path, "J3", rest * 1.02, "kg m2").warnings
    assert "one is 2.0 % above the sum of the other two" in text
    assert str(tmp_path) in text


def test_no_more_than_the_wing_is_blown():
    assert holds("blown", blown_share=1.0)
    assert not holds("blown", blown_share=1.0 + BIT)


def test_motors_idle_slower_than_they_can_turn():
    assert holds("speeds", omega_min=NOMINAL.omega_max - BIT)
    assert not holds("speeds", omega_min=NOMINAL.omega_max)


def test_elevons_turn_by_less_than_a_right_angle():
    assert holds("deflection", delta_max=math.pi / 2 - BIT)
    assert not holds("deflection", delta_max=math.pi / 2)


def test_both_propellers_at_full_speed_lift_the_weight():
    """The wing's drag takes its share of the slipstream's thrust."""
    thrust = 2.0 * NOMINAL.k_f * NOMINAL.omega_max * NOMINAL.omega_max
    mass = (1.0 - NOMINAL.S_ratio * NOMINAL.C_d0) * thrust / NOMINAL.g
    assert holds("weight", m=mass * (1.0 - BIT))
    assert not holds("weight", m=mass * (1.0 + BIT))
    exact = {"m": 2.0, "g": 10.0, "k_f": 0.1, "omega_max": 10.0, "C_d0": 0.0}
    assert not holds("weight", **exact)  # just as much is not enough


def test_the_slipstream_leaves_thrust():
    assert holds("slipstream", S_ratio=0.5, C_d0=2.0 - BIT)
    assert not holds("slipstream", S_ratio=0.5, C_d0=2.0)


def mine(tmp_path, key, value, unit):
    return mine_of(tmp_path, key, value, unit).parameters


def mine_of(tmp_path, key, value, unit):
    path = tmp_path / "mine.toml"
    path.write_text(
        '[set]\nname = "mine"\ndescription = "x"\nbase = "nominal"\n'
        f'[{key}]\nvalue = {value}\nunit = "{unit}"\nsource = "measured"\n'
    )
    return load(str(path))


@pytest.mark.parametrize("key", ["C_d0", "mu"])
def test_what_must_not_be_negative_may_be_zero(tmp_path, key):
    assert getattr(mine(tmp_path, key, 0.0, "-"), key) == 0.0
    with pytest.raises(AirframeError, match=f"{key} = -0.001 must not be negative"):
        mine(tmp_path, key, -0.001, "-")


def test_what_must_be_positive_must_not_be_zero(tmp_path):
    with pytest.raises(AirframeError, match=r"m = 0\.0 must be positive"):
        mine(tmp_path, "m", 0.0, "kg")


def test_a_moment_coefficient_may_have_either_sign_and_be_a_whole_number(tmp_path):
    assert mine(tmp_path, "C_np", -1, "-").C_np == -1.0
    assert mine(tmp_path, "C_np", 0, "-").C_np == 0.0


def test_angles_are_given_in_degrees_and_used_in_radians(tmp_path):
    assert mine(tmp_path, "delta_max", 45.0, "deg").delta_max == pytest.approx(math.pi / 4)


@pytest.mark.parametrize("value", ["true", "inf", "-inf", "nan"])
def test_no_number_is_no_value(tmp_path, value):
    with pytest.raises(AirframeError, match="is not a finite number"):
        mine(tmp_path, "C_np", value, "-")
