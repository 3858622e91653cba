"""A plan as a mission, and the list of what it lost."""

import math

import pytest

from protocol import units
from protocol.dialect import mavlink
from protocol.flight_plans import load_flight_plan
from protocol.flight_plans.mission_export import to_mission
from protocol.plans import load, save
from tests.support.plans import VOLIERE, plan_of


def commands(export):
    return [item.command for item in export.mission.items]


def test_stages_become_items_in_their_order():
    plan = plan_of(
        '<block name="a"><stay wp="A" vmode="climb" climb="nav.climb_vspeed"/><go wp="A"/>'
        '<go from="A" wp="B" hmode="route"/>'
        '<stay wp="B" until="stage_time @GT 10"/><circle wp="C" radius="-30" until="NavCircleCount() > 2"/>'
        '<path wpts="A B"/><stay wp="C"/><stay wp="A" vmode="climb" climb="-0.5"/></block>'
    )
    export = to_mission(plan)
    nav = {name: getattr(mavlink, f"MAV_CMD_NAV_{name}") for name in
           ("TAKEOFF", "WAYPOINT", "LOITER_TIME", "LOITER_TURNS", "LOITER_UNLIM", "LAND")}  # fmt: skip
    names = "TAKEOFF WAYPOINT WAYPOINT WAYPOINT LOITER_TIME LOITER_TURNS WAYPOINT WAYPOINT LOITER_UNLIM LAND"
    assert commands(export) == [nav[name] for name in names.split()]
    timed, turned = export.mission.items[4:6]
    assert timed.params[0] == 10.0
    assert (turned.params[0], turned.params[2]) == (2.0, -30.0)
    assert [item.z for item in export.mission.items[1:4]] == [102.0, 102.0, 103.0]
    assert export.losses == ()
    lat, lon = (units.from_e7(value) for value in (export.mission.items[1].x, export.mission.items[1].y))
    assert (lat - 43.5641) * 111_120 == pytest.approx(4.0, abs=0.02)
    assert lon > 1.4829


def test_what_is_lost_is_named_with_its_place():
    plan = plan_of(
        '<block name="a" pre_call="NavKillThrottle()"><exception cond="1" deroute="HOME"/>'
        '<while cond="1"><go wp="A"/></while>'
        '<call_once fun="NavResurrect()"/><circle wp="A" radius="nav.radius"/>'
        '<stay wp="A" until="GetPosX() > 1"/></block>'
    )
    texts = [str(loss) for loss in to_mission(plan).losses]
    assert all(text.startswith("t.xml:3:") for text in texts)
    told = " ".join(texts)
    for word in (
        "exception from block a to HOME",
        "<while>",
        "<call_once>",
        "<circle>",
        "until GetPosX",
        "NavKillThrottle",
    ):
        assert word in told


def test_stages_that_no_mission_has_are_lost():
    stages = (
        '<follow ac_id="7" distance="3" height="2"/><manual roll="0" yaw="0"/><attitude roll="10"/>'
        '<stay wp="A" vmode="xyz"/><stay wp="A" vmode="throttle" throttle="1"/>'
    )
    export = to_mission(plan_of(f'<block name="a"><go wp="A"/>{stages}</block>'))
    lost = ["<follow>", "<manual>", "<attitude>", "<stay> by the sticks", "<stay> with a throttle"]
    assert [str(loss).split(": ", 1)[1] for loss in export.losses] == lost
    assert len(export.mission.items) == 1


@pytest.mark.parametrize("name", ["m.plan", "m.waypoints"])
def test_exports_are_saved_and_loaded(tmp_path, name):
    export = to_mission(load_flight_plan(VOLIERE), with_fence_of_sector=name.endswith(".plan"))
    save(export.mission, tmp_path / name)
    assert load(tmp_path / name).items == export.mission.items
    assert any("fence Room" in loss.text for loss in export.losses) == name.endswith(".waypoints")
    assert len(export.mission.geo_fence["polygons"]) == int(name.endswith(".plan"))


def test_an_item_holds_what_its_stage_says_and_nothing_else():
    stages = '<go wp="A"/><stay wp="A" until="stage_time > 10"/><circle wp="C" radius="30"/><home/>'
    export = to_mission(plan_of(f'<block name="a">{stages}</block>'))
    params = [item.params[:3] for item in export.mission.items]
    assert params == [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (0.0, 0.0, 30.0), (0.0, 0.0, 0.0)]
    assert all(math.isnan(item.params[3]) for item in export.mission.items)


@pytest.mark.parametrize(
    ("climb", "command", "altitude"), [("0.5", "TAKEOFF", 102.0), ("0", "LAND", 100.0), ("-0.5", "LAND", 100.0)]
)
def test_a_climb_is_a_takeoff_to_its_waypoint_and_a_descent_a_landing_on_the_ground(climb, command, altitude):
    export = to_mission(plan_of(f'<block name="a"><stay wp="A" vmode="climb" climb="{climb}"/></block>'))
    (item,) = export.mission.items
    assert (item.command, item.z) == (getattr(mavlink, f"MAV_CMD_NAV_{command}"), altitude)


def test_a_waypoint_that_a_loop_names_is_lost_and_not_flown_to_as_the_origin():
    plan = plan_of('<block name="a"><path wpts="A $i B"/><go wp="$i"/><stay wp="$i"/><go from="$i" wp="A"/></block>')
    export = to_mission(plan)
    assert [str(loss).split(": ", 1)[1] for loss in export.losses] == [
        "<path> over $i", "<go> to $i", "<stay> at $i",
    ]  # fmt: skip
    assert commands(export) == [mavlink.MAV_CMD_NAV_WAYPOINT] * 3
    assert [item.z for item in export.mission.items] == [102.0, 103.0, 102.0]
