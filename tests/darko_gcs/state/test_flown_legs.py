"""A leg as it was flown, beside its prediction."""

import math

import pytest

from darko_gcs.state.flown_legs import flown_words
from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, LegMode
from tests.support.gcs.messages import arrived, heartbeat

ACTIVE, PAUSED, DONE = (getattr(mavlink, f"MISSION_STATE_{name}") for name in ("ACTIVE", "PAUSED", "COMPLETE"))


def state(number, seq=1):
    return mavlink.MAVLink_mission_current_message(seq, 4, number)


def energy(ms, joules, power=100.0):
    return mavlink.MAVLink_darko_energy_message(ms, power, joules, [0.0] * 16)


def decided(ms, seq):
    numbers = {"distance": 50.0, "climb": 0.0, "tail_wind": 0.0, "cross_wind": 0.0, "hover_time": 17.0}
    numbers |= {"hover_energy": 3000.0, "forward_time": 10.0, "forward_energy": 900.0}
    return mavlink.MAVLink_darko_decision_message(
        time_boot_ms=ms, seq=seq, way=LegMode.FORWARD, reason=DecisionReason.ENERGY, **numbers
    )


def reached(seq):
    return mavlink.MAVLink_mission_item_reached_message(seq)


def after(*messages):
    s = EMPTY_SNAPSHOT
    for message in (heartbeat(), *messages):
        s = reduce(s, arrived(message), 1.0)
    return s


FLOWN = (
    energy(1000, 500.0), state(ACTIVE), decided(3000, 1), decided(3000, 2), energy(13000, 1500.0), reached(1),
    energy(25000, 2300.0), reached(2),
)  # fmt: skip


def test_a_leg_takes_from_its_decision_to_its_item_and_the_next_one_from_there():
    first, second = (after(*FLOWN).mission.flown[seq] for seq in (1, 2))
    assert (first.time, first.energy) == (10.0, pytest.approx(1500.0 - 700.0))  # of 100 W since the last energy
    assert (second.time, second.energy) == (12.0, pytest.approx(800.0))
    assert (first.predicted_time, first.predicted_energy) == (10.0, 900.0)
    assert (first.distance, first.climb) == (50.0, 0.0)  # as decided, wherever the vehicle is now


def test_the_end_of_the_mission_tells_both():
    (line,) = [line.text for line in after(*FLOWN, state(DONE)).log.lines]
    assert line == "Mission done: 24 s, 1.8 kJ; legs 22.0 s, 1.6 kJ (predicted 20.0 s, 1.8 kJ)"


def test_a_mission_that_is_resumed_goes_on_counting_and_a_new_one_begins_anew():
    resumed = after(*FLOWN, state(PAUSED), state(ACTIVE))
    assert flown_words(resumed)
    assert flown_words(after(*FLOWN, state(DONE), state(ACTIVE))) == ""


def test_without_energy_only_the_time_is_told():
    s = after(decided(3000, 1), decided(9000, 3), reached(1))
    assert math.isnan(s.mission.flown[1].energy)
    assert flown_words(s) == "legs 6.0 s (predicted 10.0 s, 0.9 kJ)"
