"""The table of the mission screen, figures and warnings of the whole plan, and its differences from another plan."""

import math

import pytest

from darko_gcs.state.mission_legs import mission_legs
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.values import FlownLeg, LegPrediction, LogLine
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.screens.mission_table import flown_leg_words, last_words, plan_status, plan_warnings, whole_parts
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, LegMode
from protocol.plans import Plan
from sitl.defaults import HOME
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.vehicle.mission_items import LAND, TAKE_OFF, item, waypoint

AT_HOME = snapshot_with(EMPTY_SNAPSHOT, position={"home": HOME})


def chosen(way):
    return LegPrediction(leg_mode=way, reason=DecisionReason.ENERGY, hover_time=9.0, hover_energy=9.0, forward_time=9.0,
                         forward_energy=9.0)  # fmt: skip


@pytest.mark.parametrize(
    ("predictions", "words"),
    [
        ({}, "LOW: leg to 2 below 10 m in forward flight"),
        ({1: chosen(LegMode.FORWARD)}, "LOW: legs to 1, 2 below 10 m in forward flight"),
        ({1: chosen(LegMode.FORWARD), 2: chosen(LegMode.HOVER)}, "LOW: leg to 1 below 10 m in forward flight"),
        ({2: chosen(LegMode.HOVER)}, None),
    ],
)
def test_legs_that_are_flown_forward_near_the_ground_are_named(predictions, words):
    items = (TAKE_OFF, waypoint(5.0, 0.0, 3.0), waypoint(90.0, 0.0, 3.0), waypoint(92.0, 0.0, 3.0), LAND)
    assert plan_warnings(items, AT_HOME, predictions) == ([] if words is None else [words])


def test_a_mission_that_ends_in_the_air_is_told():
    assert plan_warnings((waypoint(5.0, 0.0, 20.0),), AT_HOME, {}) == ["no landing: it hovers at its last item"]
    assert plan_warnings((), AT_HOME, {}) == []


def test_of_two_warnings_about_one_thing_both_are_shown():
    note, warning = mavlink.MAV_SEVERITY_INFO, mavlink.MAV_SEVERITY_WARNING
    why = LogLine(1.0, warning, "Mission refused: item 2 is outside the arena")
    failed, later = LogLine(1.2, warning, "Mission upload failed: invalid"), LogLine(9.0, warning, "Wind is strong")
    assert last_words([LogLine(0.0, note, "Armed"), why, failed]) == [why.text, failed.text]
    assert last_words([why, failed, later]) == [later.text]
    assert last_words([failed, LogLine(1.3, note, "Armed")]) == ["Armed"]
    assert last_words([]) == []


def test_a_line_about_an_item_has_whole_parts():
    parts = ("3 waypoint", "", "20 m", "hover: no room for transitions", "43.5648178 1.4811000")
    assert whole_parts(parts, 78) == "3 waypoint  20 m  hover: no room for transitions  43.5648178 1.4811000"
    assert whole_parts(parts, 60) == "3 waypoint  20 m  hover: no room for transitions"


def test_a_flown_leg_has_its_time_and_energy_beside_what_was_predicted():
    leg = FlownLeg(began=1.0, energy_before=0.0, predicted_time=11.8, predicted_energy=610.0, time=12.1, energy=640.0)
    s = snapshot_with(HOVERING, mission={"flown": {2: leg, 3: leg._replace(time=math.nan)}})
    assert flown_leg_words(s, 2) == "flown 12.1 s, 640 J (predicted 11.8 s, 610 J)"
    assert flown_leg_words(s, 3) == flown_leg_words(s, 0) == ""
    draft = PlanDraft(plan=Plan(items=HOVERING.plans.mission))
    assert "flown: legs 12.1 s, 0.6 kJ (predicted 11.8 s, 0.6 kJ)" in plan_status(draft, s, (), {}, is_live=True)
    draft.changed = True
    assert "flown" not in plan_status(draft, s, (), {}, is_live=True)


STANDING = snapshot_with(HOVERING, status={"landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND, "armed": False})
FLOWN_LEG = FlownLeg(
    began=1.0, energy_before=0.0, predicted_time=11.8, predicted_energy=610.0, time=12.1, energy=640.0, distance=50.0
)


def predicted(time, energy):
    return LegPrediction(time, energy, time, energy, LegMode.HOVER, 0)


def test_after_a_flight_the_totals_are_of_the_next_one_and_the_flown_legs_of_the_last():
    items = tuple(waypoint(north, 0.0, 20.0) for north in (40.0, 118.0))
    s = snapshot_with(STANDING, mission={"flown": {1: FLOWN_LEG}}, position={"p": (0.0, 0.0, 0.0)})
    legs, told = mission_legs(items, s), {0: predicted(9.0, 500.0), 1: predicted(15.0, 900.0)}
    draft = PlanDraft(plan=Plan(items=items))
    status = plan_status(draft, s, legs, told, is_live=True)
    assert "next flight: legs 118 m, predicted 24 s, 1.4 kJ; last flight: legs 12.1 s, 0.6 kJ" in status
    assert flown_leg_words(s, 1) == "last flight 12.1 s, 640 J (predicted 11.8 s, 610 J)"
    aloft = s._replace(status=HOVERING.status)
    status = plan_status(draft, aloft, legs, told, is_live=True)  # in flight, as in its row
    assert "; legs 90 m, predicted 21 s, 1.1 kJ; flown: legs 12.1 s" in status


def test_the_totals_are_told_in_battery_too_and_name_what_is_not_in_them():
    items = (
        TAKE_OFF,
        waypoint(40.0, 0.0, 20.0, hold=3.0),
        item(mavlink.MAV_CMD_NAV_LOITER_TIME, 90.0, 0.0, 20.0),
        LAND,
    )
    s = snapshot_with(STANDING, parameters={"values": {"SIM_BAT_ENERGY": 10e3}})
    told = {1: predicted(9.0, 500.0), 2: predicted(15.0, 900.0), 3: predicted(0.0, 0.0)}
    legs = mission_legs(items, s)
    status = plan_status(PlanDraft(plan=Plan(items=items)), s, legs, told, is_live=True)
    assert "1.4 kJ, 14 % of the battery (without take-off, loiter, waits, landing)" in status
    untold = s._replace(parameters=EMPTY_SNAPSHOT.parameters)
    assert "battery" not in plan_status(PlanDraft(plan=Plan(items=items)), untold, legs, told, is_live=True)
    assert "without" not in plan_status(PlanDraft(plan=Plan(items=items[1:2])), s, (), {}, is_live=True)


async def test_on_the_ground_the_columns_are_marked_as_of_the_last_flight():
    flown = {2: FLOWN_LEG, 3: FLOWN_LEG._replace(time=math.nan)}
    app = GroundStationApp(FakeFeed(snapshot_with(STANDING, mission={"flown": flown})))
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: "last pred last s J" in screen_text(app))
        assert screen_text(app).count(" 12  610   12  640") == 1
        assert "..." not in screen_text(app).split("last s J")[1].split("Map")[0]


def test_a_recording_that_has_no_items_of_a_mission_says_that_there_is_one():
    s = snapshot_with(EMPTY_SNAPSHOT, mission={"total": 6, "current": 4})
    words = plan_status(PlanDraft(), s, (), {}, is_live=False)
    assert words == "the mission's 6 items are not in the recording: only what item it is at"
    assert plan_status(PlanDraft(), EMPTY_SNAPSHOT, (), {}, is_live=False) == "no mission in the recording so far"


async def test_the_table_has_the_flown_leg_with_its_own_length_beside_its_prediction_and_no_column_is_cut():
    leg = FlownLeg(
        began=1.0, energy_before=0.0, predicted_time=11.8, predicted_energy=610.0, time=12.1, energy=640.0,
        distance=777.0, climb=-7.0,
    )  # fmt: skip
    app = GroundStationApp(FakeFeed(snapshot_with(HOVERING, mission={"flown": {2: leg}})))
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: "predicted flown s J" in screen_text(app))
        assert " 12  610   12  640" in screen_text(app)
        (row,) = [line for line in screen_text(app).splitlines() if " 12  610 " in line]
        assert " 777 " in row
        assert " -7.0 " in row
