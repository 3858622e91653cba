"""Failures on purpose from seeds: what is flown, and how it is counted."""

import math

import pytest

from sitl.errors import SitlError
from sitl.sensors.instruments import OFF, STUCK
from sitl.studies.failure_flights import (
    FAILING_UNITS,
    FailedFlight,
    FailureDraw,
    FailureEnd,
    FailurePhase,
    draws,
    failures_of,
    fly_failure,
    run_failures,
    summary,
)

FLOWN = FailedFlight(
    unit="motor", failure="off", phase=FailurePhase.HOVER, seed=1, end=FailureEnd.CUT, noticed=2.1, said="Motors cut",
    away=40.0, astray=0.2, impact=17.6, time=4.4,
)  # fmt: skip


def test_every_failure_of_a_unit_is_drawn_in_every_phase_by_every_seed():
    drawn = draws([1, 2], ["motor", "battery"])
    assert len(drawn) == len(set(drawn)) == (4 + 2) * 3 * 2
    assert {draw.seed for draw in drawn} == {1, 2}
    assert all(OFF in failures_of(unit) for unit in FAILING_UNITS)


def test_nothing_to_fly_is_refused():
    with pytest.raises(SitlError, match="0 flights"):
        run_failures([])


def test_a_motor_that_is_off_is_noticed_and_the_vehicle_comes_down_with_motors_off():
    flight = fly_failure(FailureDraw("motor", OFF, FailurePhase.HOVER, 1))
    assert (flight.end, flight.failure) == (FailureEnd.CUT, "off")
    assert flight.said.startswith("Motors cut: a motor or an elevon failed")
    assert flight.noticed < flight.time < 10.0
    assert flight.impact > 5.0


def test_in_cruise_a_magnetometer_that_is_stuck_is_noticed_and_changes_nothing():
    flight = fly_failure(FailureDraw("magnetometer", STUCK, FailurePhase.CRUISE, 1))
    assert flight.end is FailureEnd.FLIES
    assert flight.noticed < 5.0
    assert flight.astray < 2.0


def test_the_summary_counts_the_ends_and_names_the_worst():
    flies = FLOWN._replace(seed=2, end=FailureEnd.FLIES, noticed=math.inf, impact=0.0, away=3.0)
    (row,) = summary([FLOWN, flies])[2:]
    assert row == "| motor off | hover | 1 flies, 1 motors off | - | 40.0 m | 0.2 m | 18 m/s |"
