"""Messages of estimate, other vehicles, DarkO's own dialect and flight plans, folded into the snapshot."""

import math

import pytest

from darko_gcs.state.reduce_telemetry import MAX_HAPPENINGS
from protocol.dialect import mavlink
from tests.support.gcs.planned_snapshots import P1, PlannedVehicle, after, planned
from tests.support.gcs.snapshots import HOVERING


def test_the_table_fills_the_state():
    _, s = planned()
    plan = s.flight_plan
    assert (plan.name, plan.block_name(plan.block), plan.stage_text, plan.line) == (
        "Flying room",
        "Standby",
        "stay wp=A",
        7,
    )
    assert plan.is_complete
    assert [b.name for b in plan.blocks.values()][:3] == ["Engine off", "Takeoff", "Standby"]
    assert (plan.blocks[1].label, plan.blocks[0].label) == ("Take off", "Engine off")
    assert plan.points[P1].position == (1.5, 1.5, 2.0)
    assert s.position.local(plan.points[P1].place)[:2] == pytest.approx((1.5, 1.5), abs=0.02)
    assert plan.areas[1].is_fence
    assert s.flies_plan


def test_entries_before_a_status_and_of_another_plan_are_ignored():
    vehicle = PlannedVehicle()
    assert after(HOVERING, *vehicle.table()).flight_plan is None
    other = vehicle.table()[0]
    other.plan_id ^= 1
    assert after(HOVERING, vehicle.status(), other).flight_plan.blocks == {}


def test_another_plan_begins_empty():
    vehicle, s = planned()
    told = vehicle.status()
    told.plan_id ^= 1
    assert after(s, told).flight_plan.received == 0


def test_an_entry_behind_the_end_of_the_table_is_ignored():
    vehicle, s = planned()
    entry = vehicle.table()[0]
    entry.entry, entry.number = s.flight_plan.entries, 99
    assert 99 not in after(s, entry).flight_plan.blocks


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e30])
def test_a_waypoint_that_is_nowhere_is_ignored(value):
    vehicle, s = planned()
    (entry,) = vehicle.moved(P1, "p1", 2.0, 2.0)
    entry.x = value
    assert after(s, entry).flight_plan.points == s.flight_plan.points


def test_texts_cannot_control_the_terminal():
    vehicle, s = planned()
    entry = vehicle.table()[0]
    entry.name = "\x1b[2Jgone"
    assert after(s, entry).flight_plan.blocks[0].name == "?[2Jgone"


def test_what_happened_is_kept_in_order_once_and_bounded():
    vehicle, s = planned()
    late, early = vehicle.event("b", at=70.0), vehicle.event("a", at=65.0)
    s = after(s, late, early, late)
    assert [h.text for h in s.flight_plan.happenings] == ["datalink_time > 10", "a", "b"]
    many = [vehicle.event(str(n), mavlink.DARKO_PLAN_EVENT_KIND_REMARK, 80.0 + n) for n in range(MAX_HAPPENINGS + 20)]
    assert len(after(s, *many).flight_plan.happenings) == MAX_HAPPENINGS


def test_an_old_event_is_not_taken_for_a_restart():
    vehicle, s = planned()
    s = after(s, *(vehicle.event("old", at=1.0) for _ in range(5)))
    assert (s.link.restarts, s.flight_plan.happenings[0].text) == (0, "old")
