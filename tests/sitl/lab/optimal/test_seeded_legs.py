"""Legs of the table on sensors: one flight of each pace, what is told of many, and bad arguments."""

import math

import numpy as np
import pytest

pytest.importorskip("casadi")

from protocol.dialect.vocabulary import LegMode
from sitl.commands import optimal
from sitl.defaults import AIRFRAME, BRISK, GENTLE
from sitl.errors import SitlError
from sitl.lab.optimal.flown_leg import WayToFly, fly_way, ways_to_fly
from sitl.lab.optimal.seeded_legs import LegDraw, RowBounds, SeededLeg, fly_seeded, ratios, summary
from sitl.lab.optimal.yardstick import row_question
from sitl.lab.studies.seeded_flights import Craft

OPTIONS = optimal.parser({"optimal": ""})
LEG = SeededLeg("level-30", 1, time=5.0, energy=600.0, end=0.1, beyond=0.0, below=1.0, above=0.5, fault="")
BOUNDS = {"level-30": RowBounds(4.0, 500.0), "up-30": RowBounds(math.nan, math.nan)}


@pytest.mark.long
def test_a_brisk_leg_takes_less_time_and_energy_and_ends_at_its_end():
    craft = Craft(AIRFRAME)
    gentle, brisk = (
        fly_seeded(LegDraw("level-30", 1, 0.5, 0.1, WayToFly(LegMode.FORWARD, 15.0, pace)), craft)
        for pace in (GENTLE, BRISK)
    )
    for flown in (gentle, brisk):
        assert flown.fault == ""
        assert flown.end < 0.5
        assert flown.beyond < 1.0
    assert brisk.time < 0.85 * gentle.time
    assert brisk.energy < 0.9 * gentle.energy


@pytest.mark.long
def test_a_brisk_leg_does_not_sink_while_the_wing_takes_over():
    leg = fly_way(row_question("level-100", AIRFRAME), "hybrid", WayToFly(LegMode.FORWARD, 18.0, BRISK))
    height = leg.plant[:, 2]
    assert height[0] - height.min() < 0.6  # led below its end and with a slow filter: 1.7 m
    assert leg.time < 10.2


@pytest.mark.long
@pytest.mark.parametrize(("row", "most"), [("to-cruise-30", 3.5), ("to-hover-30", 4.8)])
def test_a_leg_to_or_from_a_cruise_is_flown_by_the_brisk_pace_alone(row, most):
    question = row_question(row, AIRFRAME)
    gentle, brisk = (fly_way(question, "hybrid", way) for way in ways_to_fly(question, briskly=True))
    assert (gentle.way.speed, brisk.way.speed, brisk.way.pace) == (question.airspeed, question.airspeed, BRISK)
    assert brisk.time < most < gentle.time
    start = brisk.plant[0]
    assert abs(start[0]) < 1.0
    assert np.linalg.norm(start[3:6]) == pytest.approx(15.0 if row == "to-hover-30" else 0.0, abs=0.5)


def test_a_cruise_that_is_not_reached_in_time_is_no_flight():
    flown = fly_way(row_question("to-cruise-10", AIRFRAME), "hybrid", WayToFly(LegMode.FORWARD, 15.0, GENTLE))
    assert (flown.time, flown.energy) == (math.inf, math.inf)
    assert flown.plant[-1, 0] == pytest.approx(11.0, abs=0.5)


@pytest.mark.long
def test_a_cruise_on_sensors_is_judged_where_its_end_is_passed():
    way = WayToFly(LegMode.NONE, 18.0, BRISK)
    flown = fly_seeded(LegDraw("to-cruise-100", 1, 0.5, 0.1, way), Craft(AIRFRAME))
    assert flown.end < 1.5
    assert flown.beyond < 1.0


def test_medians_stand_beside_the_bounds_and_the_lost_are_named():
    lost = LEG._replace(seed=3, time=math.inf, energy=math.inf, end=math.inf, fault="crashed after 2.0 s")
    legs = [LEG, LEG._replace(seed=2, time=6.0, energy=650.0), lost]
    lines = summary(legs, {"level-30": BOUNDS["level-30"]})
    assert lines[2].split()[:7] == ["level-30", "3", "1", "6.00", "1.50", "650", "1.30"]
    assert any(line.startswith("not lost: 2 of 3") for line in lines)
    assert lines[-1] == "level-30, seed 3: crashed after 2.0 s"


def test_a_row_without_a_bound_is_left_out_of_the_ratios():
    found = ratios([LEG, LEG._replace(row="up-30")], BOUNDS)
    assert found == pytest.approx((1.25, 1.2))
    assert all(map(math.isnan, ratios([LEG], {"level-30": BOUNDS["up-30"]})))


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["level-31"], "the table has no row 'level-31'"),
        (["level-30", "--gusts", "11"], "--gusts 11 is not within 0 and 10"),
        (["level-30", "--airspeed", "30"], "--airspeed 30 is not within 0 and 22"),
        (["level-30", "--flights", "0"], "--flights 0: there must be at least 1"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(words, error):
    with pytest.raises(SitlError, match=error):
        optimal.run(OPTIONS.parse_args(["flights", *words, "--flights-only"]))
