"""Bounds of legs between the rows of the table, and legs of a log beside them."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, LegMode
from protocol.flight_log.flight_summary import summarise
from protocol.flight_log.flown_legs import leg_costs
from protocol.flight_log.leg_bounds import LegCost, bound_table, lacks_bound, leg_bound
from protocol.names import Mode
from protocol.tlog import TlogReader
from tests.support.gcs.messages import decision
from tests.support.gcs.sample_logs import at, beat, log_of_messages
from tests.support.vehicle.darko_messages import energy

TABLE = bound_table()


def cost(kind, row):
    return LegCost(TABLE[kind]["time"][row], TABLE[kind]["energy"][row])


@pytest.mark.parametrize(
    ("kind", "climb", "along", "across"),
    [
        ("level", 0.0, 0.0, 0.0),
        ("up", 20.0, 0.0, 0.0),
        ("down", -20.0, 0.0, 0.0),
        ("ahead", 0.0, -5.0, 0.0),
        ("behind", 0.0, 5.0, 0.0),
        ("aside", 0.0, 0.0, -5.0),
    ],
)
def test_a_leg_of_the_table_has_its_row(kind, climb, along, across):
    for row, distance in enumerate(TABLE["distances"][: len(TABLE[kind]["time"])]):
        assert leg_bound(distance, climb, along, across) == pytest.approx(cost(kind, row))


def test_between_rows_a_bound_lies_between_and_shares_of_climb_and_wind_add_up():
    level, longer = cost("level", 1), cost("level", 2)
    middle = leg_bound(math.sqrt(30.0 * 100.0), 0.0, 0.0, 0.0)
    assert middle == pytest.approx([0.5 * (a + b) for a, b in zip(level, longer, strict=True)])
    both = leg_bound(30.0, 10.0, -2.5, 0.0)
    added = [a + 0.5 * (b - a) + 0.5 * (c - a) for a, b, c in zip(level, cost("up", 1), cost("ahead", 1), strict=True)]
    assert both == pytest.approx(added)


@pytest.mark.parametrize(
    "leg", [(9.0, 0, 0, 0), (301.0, 0, 0, 0), (50.0, 21.0, 0, 0), (50.0, 0, -6.0, 0), (50.0, 0, 0, 5.5)]
)
def test_outside_of_the_table_there_is_no_bound(leg):
    assert leg_bound(*leg) is None
    assert leg_bound(math.nan, 0.0, 0.0, 0.0) is None


@pytest.mark.parametrize(
    ("leg", "why"),
    [
        ((9.0, 0, 0, 0), "shorter than 10 m"),
        ((301.0, 0, 0, 0), "longer than 300 m"),
        ((50.0, -21.0, 0, 0), "climbs or sinks more than 20 m"),
        ((50.0, 0, -6.0, 0), "wind over 5 m/s"),
        ((50.0, 0, 0, 5.5), "wind over 5 m/s"),
        ((math.nan, 0, 0, 0), "length or wind not told"),
        ((50.0, 0, 0, 0), ""),
    ],
)
def test_a_leg_without_a_bound_says_why(leg, why):
    assert lacks_bound(*leg) == why


def test_a_faint_crosswind_counts_for_nothing_and_a_kind_ends_with_its_rows():
    assert leg_bound(100.0, 0.0, 0.0, 0.9) == leg_bound(100.0, 0.0, 0.0, 0.0)
    beyond = TABLE["distances"][len(TABLE["aside"]["time"]) - 1] * 1.01
    assert leg_bound(beyond, 0.0, 0.0, 3.0) is None


def reached(seq):
    return mavlink.MAVLink_mission_item_reached_message(seq)


def legs_of(speed_at_end=0.0, item=2, made=None):
    """A leg of 100 m that climbs 10 m, begun at 3 s and over at 12 s, a message a second."""
    messages = [
        beat(Mode.MISSION, armed=True), energy(100.0, {Law.INDI: 100.0}), at(0.0, 10.0, 0.0), made or decision(seq=2),
        at(0.0, 10.0, 0.0), *(at(18.0 * k, 10.0, 18.0) for k in range(1, 6)), at(100.0, 20.0, speed_at_end),
        energy(1300.0, {Law.INDI: 1300.0}), reached(item), beat(Mode.MISSION),
    ]  # fmt: skip
    for second, message in enumerate(messages):
        if hasattr(message, "time_boot_ms"):
            message.time_boot_ms = 1000 * second
    (flight,) = summarise(TlogReader(log_of_messages(messages))).flights
    return flight.legs


def test_a_leg_that_hovers_at_both_ends_stands_beside_its_bound():
    (leg,) = legs_of()
    assert (leg.seq, leg.distance, leg.climb) == (2, 100.0, 10.0)
    assert leg.flown_time == pytest.approx(9.0)
    assert leg.flown_energy == pytest.approx(1200.0 * 8 / 10)  # told at 1 s and at 11 s
    least = leg_bound(100.0, 10.0, -1.2, 0.5)
    assert [leg.bound_time, leg.bound_energy] == pytest.approx([least.time, least.energy])


def test_a_leg_in_words_has_its_ratios_where_it_has_a_bound():
    (leg,) = legs_of()
    assert leg_costs(leg) == (
        f"9.0 s of {leg.bound_time:.1f}: {9.0 / leg.bound_time:.2f}, "
        f"960 J of {leg.bound_energy:.0f}: {960.0 / leg.bound_energy:.2f} (predicted 12.1 s, 1757 J)"
    )
    (through,) = legs_of(speed_at_end=9.0)
    assert leg_costs(through) == ("9.0 s, 960 J (no least: passes its end without a stop) (predicted 12.1 s, 1757 J)")


def test_a_leg_has_what_was_predicted_for_the_way_that_was_decided():
    made = decision(seq=2)
    made.way, made.hover_time, made.hover_energy = LegMode.HOVER, 8.5, 900.0
    made.forward_time, made.forward_energy = 6.0, math.inf
    (leg,) = legs_of(made=made)
    assert (leg.predicted_time, leg.predicted_energy) == (8.5, 900.0)
    assert leg_costs(leg).endswith(" (predicted 8.5 s, 900 J)")
    made.way = LegMode.FORWARD
    (impossible,) = legs_of(made=made)
    assert math.isnan(impossible.predicted_time)
    assert "predicted" not in leg_costs(impossible)


def test_a_leg_flown_through_has_no_bound_and_one_that_never_ends_is_none():
    (leg,) = legs_of(speed_at_end=9.0)
    assert math.isnan(leg.bound_time)
    assert leg.flown_time == pytest.approx(9.0)
    assert legs_of(item=3) == ()
