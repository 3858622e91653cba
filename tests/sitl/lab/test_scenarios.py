"""Scenarios flown as fast as possible."""

import math
from dataclasses import replace

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.reference import hover_at
from sitl.errors import SitlError
from sitl.lab.scenarios import (
    ORIGIN_HEIGHT,
    RATE,
    SCENARIOS,
    Scenario,
    ScenarioEvent,
    fly,
    next_reference,
    settling_time,
    whole_samples,
)
from sitl.model.airframe_files import load
from sitl.simulation.flight_errors import DivergedError
from sitl.simulation.start import Start

NOMINAL = load("nominal").parameters
HOVER = SCENARIOS["hover"]


def scenario(*events, duration=1.0, **changes):
    return Scenario("test", "", "", Start(), events, duration, list, **changes)


@pytest.mark.long
def test_a_track_has_fifty_samples_a_second_relative_to_the_report_s_origin():
    track = fly(scenario(duration=1.0))
    assert track.time == pytest.approx(np.arange(50) / RATE)
    assert track.p[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert track.target[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert [jump.target for jump in track.jumps] == [Law.HOVER_LINEAR]  # at once: it already hovers at its target
    assert (track.law == Law.HOVER_LINEAR).all()


def test_an_event_is_in_force_from_its_time_on():
    flown = fly(scenario(ScenarioEvent(0.5, target=(0.0, 0.0, 30.0)), ScenarioEvent(0.25, wind=(3.0, 0.0, 0.0))))
    still = fly(scenario())
    assert flown.target[:, 2] == pytest.approx(np.where(np.arange(50) < 25, 0.0, 30.0))
    assert flown.v_hover[25] > 100.0 > flown.v_hover[24]
    windy = 13  # the first sample after a quarter of a second, which is no whole sample
    assert (flown.p[:windy] == still.p[:windy]).all()
    assert (flown.p[windy + 1 :, 0] > still.p[windy + 1 :, 0]).all()


def test_times_are_rounded_up_to_whole_samples():
    assert whole_samples(0.25) == pytest.approx(0.26)
    assert whole_samples(0.3) == pytest.approx(0.3)
    assert whole_samples(1e-9) == 0.0


def test_a_target_with_an_airspeed_is_a_leg_from_the_one_before():
    first = next_reference(hover_at((0.0, 0.0, ORIGIN_HEIGHT), 0.0), (50.0, 0.0, 0.0), 10.0)
    assert first.forward
    assert (first.path.start, first.path.end) == ((0.0, 0.0, ORIGIN_HEIGHT), (50.0, 0.0, ORIGIN_HEIGHT))
    assert first.path.airspeed == 10.0
    assert not next_reference(first, (0.0, 0.0, 0.0), None).forward


def test_a_diverged_flight_can_be_kept_up_to_its_end():
    feather = NOMINAL._replace(J2=1e-6)  # turns faster than the steps can follow
    track = fly(HOVER, airframe=feather, keep_diverged=True)
    assert "diverged" in track.diverged
    assert np.isfinite(track.p).all()
    assert track.time[-1] < HOVER.duration - 1.0
    with pytest.raises(DivergedError):
        fly(HOVER, airframe=feather)


def test_one_seed_is_one_flight_and_another_airframe_is_another_flight():
    short = replace(HOVER, duration=2.0)
    assert (fly(short).p == fly(short).p).all()
    assert (fly(short, airframe="nominal-first-order").p != fly(short).p).any()


def test_a_scenario_without_duration_flies_nothing():
    with pytest.raises(SitlError, match="no duration"):
        fly(scenario(duration=0.0))


def test_settling_counts_from_the_last_time_outside():
    track = fly(HOVER)
    settled = settling_time(track, 0.05)
    late = track.time >= settled
    off = np.linalg.norm(track.p - track.target, axis=1)
    assert off[late].max() <= 0.05 < off[late.argmax() - 1]
    assert settling_time(track, 100.0) == 0.0
    assert math.isnan(settling_time(track, 1e-9, until=2.0))


# The flights of the report under the vehicle's supervisor: each number is as the report or the design expects.


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_finding_of_a_report_scenario_is_as_expected(name):
    track = fly(SCENARIOS[name])
    missed = [f"{f.name} = {f.value:.3f} {f.unit}" for f in SCENARIOS[name].findings(track) if not f.holds]
    assert not missed
