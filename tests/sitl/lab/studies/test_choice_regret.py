"""Cost of the choice between hover and forward flight: the arithmetic, and a leg flown both ways briskly."""

import math

import pytest

from protocol.dialect.vocabulary import LegMode
from sitl.defaults import AIRFRAME, BRISK
from sitl.lab.studies.break_even import FlownLeg
from sitl.lab.studies.choice_regret import BothWays, fly_both, summary
from sitl.prediction.corners import Leg
from sitl.prediction.point_mass import Prediction

LEG = Leg(60.0, 0.0)


def flown(energy, predicted, leg_mode):
    return FlownLeg(LEG, leg_mode, energy / 100.0, energy, Prediction(predicted / 100.0, predicted), False, 0.0, 0.0)


def both(hover, forward):
    return BothWays(flown(*hover, LegMode.HOVER), flown(*forward, LegMode.FORWARD))


def test_the_regret_is_of_the_way_that_was_predicted_to_need_less():
    right, wrong = both((900.0, 880.0), (600.0, 620.0)), both((500.0, 700.0), (550.0, 600.0))
    assert right.regret == 0.0
    assert wrong.chosen is wrong.forward
    assert wrong.regret == pytest.approx(0.1)
    assert math.isinf(both((900.0, 880.0), (math.inf, 620.0)).regret)
    lines = summary([right, wrong])
    assert lines[0] == "2 legs: 0 hovered, 2 forward"
    assert lines[1].startswith("the other way needed less: 1 of 2")
    assert lines[2].startswith("regret: mean 5.00%")
    assert "worst 10.0% (60 m, climb +0 m" in lines[2]
    assert any(line.startswith("to hover all of them would cost 27.3%") for line in lines)


@pytest.mark.long
def test_a_brisk_leg_is_flown_as_it_was_predicted():
    found = fly_both((LEG, 15.0), AIRFRAME, BRISK)
    assert found.chosen is found.forward
    assert found.regret == 0.0
    assert found.forward.time == pytest.approx(found.forward.predicted.time, rel=0.15)
    assert found.forward.energy == pytest.approx(found.forward.predicted.energy, rel=0.15)
