"""Whether an instrument is believed: refusals, leaps, and what is noted of them."""

import pytest

from sitl.estimation import fusion
from sitl.estimation.nominal_state import ATTITUDE_ERROR
from sitl.model.vectors import Vector
from sitl.sensors.instruments import (
    FIRST_DELAYED,
    MOTION_CAPTURE,
)
from tests.support.flights.observed_cruise import CRUISE, PERIODS, filter_with, fused


def test_how_well_a_reading_agreed_is_noted():
    wrong = CRUISE._replace(position=Vector(10.0, -20.0, 130.0))
    _, _, _, f = fused("pose", wrong)
    line = MOTION_CAPTURE - FIRST_DELAYED
    assert f["ratio"][line] > 0.0
    assert f["refused_since"][line] == PERIODS or f["fused_at"][line] == PERIODS
    _, _, _, f = fused("pose", CRUISE)
    assert f["fused_at"][line] == PERIODS
    assert f["refused_since"][line] == -1.0
    assert f["scalars"][line] == 6.0


@pytest.mark.parametrize("axis", range(3))
def test_a_belief_that_turns_about_any_axis_turns_its_errors(axis, monkeypatch):
    _, f = filter_with()
    seen = []
    monkeypatch.setattr(fusion, "turn_errors", lambda _P, _states, turn: seen.append(turn))
    fusion.correct_nominal(f)
    assert seen == []
    f["errors"][ATTITUDE_ERROR + axis] = 0.01
    fusion.correct_nominal(f)
    assert seen == [tuple(0.01 * (k == axis) for k in range(3))]


def test_an_instrument_that_fits_again_is_mistrusted_for_half_a_second_and_its_leap_forgotten_after_a_third():
    _, f = filter_with()
    slot, now = MOTION_CAPTURE - FIRST_DELAYED, 5000
    for age, leapt, fits in (
        (0.1, 1.0, False),
        (0.3, 1.0, False),
        (0.302, 0.0, False),
        (0.5, 0.0, False),
        (0.502, 0.0, True),
    ):
        f["leapt"][slot], f["refused_at"][slot] = 1.0, now - round(age / 0.002)
        assert fusion.may_be_fused(f, slot, now, 0.0) == fits
        assert f["leapt"][slot] == leapt


@pytest.mark.parametrize(
    ("gates", "helped", "leapt"), [(3.9, 0.1, 0.0), (4.1, 0.1, 1.0), (4.1, 0.998, 1.0), (4.1, 1.0, 0.0)]
)
def test_the_first_refusal_is_a_leap_if_it_is_four_gates_off_and_was_right_just_before(gates, helped, leapt):
    _, f = filter_with()
    slot, now = MOTION_CAPTURE - FIRST_DELAYED, 5000
    f["fused_at"][slot] = now - round(helped / 0.002)
    assert not fusion.may_be_fused(f, slot, now, (gates * f["settings"]["gate"]) ** 2)
    assert f["leapt"][slot] == leapt
    assert f["refused_at"][slot] == now
