"""Legs in a log: where they begin and end, which are listed, and where along them the time went."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.flight_log.flight_clock import flight_clock
from protocol.flight_log.flown_legs import flown_legs, leg_costs, leg_name, leg_parts
from protocol.tlog import TlogReader
from tests.support.gcs.messages import decision, heartbeat, position
from tests.support.logs import T0, bare, record
from tests.support.vehicle.darko_messages import energy

NO_ITEM = 0xFFFF
RAMP, CRUISE = 2.0, 10.0  # [s] of speeding up and of slowing down; [m/s]


def where(second, length):
    """Way [m] and speed [m/s] a time after a leg's beginning: evenly faster, even, evenly slower."""
    even = length / CRUISE - RAMP
    if second < RAMP:
        return 0.5 * CRUISE / RAMP * second**2, CRUISE / RAMP * second
    if second < RAMP + even:
        return CRUISE * (second - RAMP / 2.0), CRUISE
    left = max(2.0 * RAMP + even - second, 0.0)
    return length - 0.5 * CRUISE / RAMP * left**2, CRUISE / RAMP * left


def target(ms, north):
    return mavlink.MAVLink_position_target_local_ned_message(ms, 1, 0, north, 0.0, -30.0, *[0.0] * 8)


def decided(ms, seq, distance, wind=0.0):
    made = decision(seq=seq)
    made.time_boot_ms, made.distance, made.climb, made.tail_wind, made.cross_wind = ms, distance, 0.0, wind, 0.0
    return made


def flight(*events, length=100.0, begun=2.0, until=30.0):
    """A log of a vehicle that flies north by ``length`` from a time on, 200 W all the way; events: (time [s], message).

    Messages tell the time by their own clock, 5 s ahead of the log's.
    """
    told = [(0.0, heartbeat()), *events]
    for k in range(round(until * 20)):
        time = k / 20
        way, speed = where(max(time - begun, 0.0), length)
        ms = 5000 + 50 * k
        told.append((time, position(ms, way, z=-30.0, vx=speed)))
        if k % 4 == 0:
            told.append((time, target(ms, length if time > begun + 0.1 else 0.0)))
        if k % 10 == 0:
            told.append((time, energy(0.0, {})))
            told[-1][1].time_boot_ms, told[-1][1].energy = ms, 200.0 * time
    records = (record(T0 + round(at * 1e6), bare(message)) for at, message in sorted(told, key=lambda pair: pair[0]))
    return flown_legs(flight_clock(TlogReader(b"".join(records)), (1, 1)))


def reached(seq):
    return mavlink.MAVLink_mission_item_reached_message(seq)


ARRIVAL = 2.0 * RAMP + 100.0 / CRUISE - RAMP  # of the leg [s]


@pytest.mark.parametrize("hold", [0.0, 5.0, 60.0])
def test_a_leg_ends_where_the_vehicle_comes_to_rest_and_not_behind_its_hold(hold):
    (leg,) = flight((2.0, decided(7000, 1, 100.0)), (2.0 + ARRIVAL + hold, reached(1)), until=30.0 + hold)
    assert leg.flown_time == pytest.approx(ARRIVAL, abs=0.15)  # 0.5 m and 0.5 m/s before
    assert leg.flown_energy == pytest.approx(200.0 * leg.flown_time, rel=0.01)
    assert leg.no_bound == ""
    assert leg.bound_time > 1.0


def test_a_leg_that_is_told_to_be_reached_before_the_vehicle_rests_ends_there():
    (leg,) = flight((2.0, decided(7000, 1, 100.0)), (2.0 + 11.5, reached(1)))
    assert leg.flown_time == pytest.approx(11.5, abs=0.05)


def test_a_leg_to_no_item_is_listed_once_the_vehicle_came_to_rest_at_its_target():
    (leg,) = flight((2.0, decided(7000, NO_ITEM, 100.0)))
    assert (leg.seq, leg_name(leg)) == (None, "leg, 100 m")
    assert leg.flown_time == pytest.approx(ARRIVAL, abs=0.15)
    assert leg.bound_time > 1.0
    assert flight((2.0, decided(7000, NO_ITEM, 100.0)), (8.0, decided(13000, NO_ITEM, 400.0))) == ()
    assert flight((2.0, decided(7000, NO_ITEM, 100.0)), until=10.0) == ()


def test_legs_that_are_flown_through_are_listed_and_each_begins_where_the_one_before_ended():
    """An item is told to be reached behind the decision for the next leg."""
    first, second = flight(
        (2.0, decided(7000, 1, 50.0)), (6.5, decided(11500, 2, 50.0)), (7.0, reached(1)), (15.0, reached(2))
    )
    assert (first.time, first.flown_time) == (pytest.approx(2.0, abs=0.05), pytest.approx(5.0, abs=0.05))
    assert second.time == pytest.approx(7.0, abs=0.05)
    assert (first.no_bound, second.no_bound) == ("passes its end without a stop", "begins in flight")
    assert "(no least: begins in flight)" in leg_costs(second)


@pytest.mark.parametrize(
    ("distance", "wind", "why"), [(100.0, 7.0, "wind over 5 m/s"), (100.0, math.nan, "length or wind not told")]
)
def test_every_leg_has_a_figure_or_a_reason(distance, wind, why):
    (leg,) = flight((2.0, decided(7000, 1, distance, wind)), (2.0 + ARRIVAL, reached(1)))
    assert (leg.no_bound, math.isnan(leg.bound_time)) == (why, True)
    assert f"(no least: {why})" in leg_costs(leg)


def test_time_and_energy_are_told_of_the_first_metres_the_middle_and_the_last():
    (leg,) = flight((2.0, decided(7000, 1, 100.0)), (2.0 + ARRIVAL + 5.0, reached(1)))
    start, middle, stop = leg.parts
    assert start.time == pytest.approx(RAMP, abs=0.06)  # 10 m at 5 m/s on average
    assert middle.time == pytest.approx(8.0, abs=0.15)
    assert stop.time == pytest.approx(leg.flown_time - start.time - middle.time, abs=1e-9)
    assert sum(part.energy for part in leg.parts) == pytest.approx(leg.flown_energy)
    assert leg_parts(leg).startswith(f"start {start.time:.1f} s {start.energy:.0f} J, middle ")


def test_a_short_leg_has_no_parts():
    (leg,) = flight((2.0, decided(7000, 1, 8.0)), (9.0, reached(1)), length=20.0, begun=20.0)
    assert (leg.parts, leg_parts(leg)) == ((), "")
