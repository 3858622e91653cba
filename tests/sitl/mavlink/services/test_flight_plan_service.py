"""A flight plan on the link: what stations are told, what they may ask, and the present leg as a mission."""

import math
import zlib

import pytest

from protocol.dialect import mavlink
from protocol.engines.table_values import PIECE_BYTES, plan_key
from protocol.flight_plans import load_flight_plan
from protocol.flight_plans.plan_names import parse_name_mapping
from protocol.flight_plans.plan_package import pack_plan
from protocol.names import Mode
from protocol.plans.plan import MissionItem
from tests.support.disk import full_disk
from tests.support.plans import VOLIERE, plan_of
from tests.support.vehicle.fake_station import Bench, FakeStation
from tests.support.vehicle.planned_flight import PlannedFlight

ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
JUMP, MOVE, SET = (
    mavlink.MAV_CMD_DARKO_JUMP_TO_BLOCK,
    mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT,
    mavlink.MAV_CMD_DARKO_SET_VARIABLE,
)
STAY, LEG, RING = 0, 1, 2
BLOCKS = (
    '<block name="Stay" strip_button="Stay!" key="s" group="g"><stay wp="A"/></block>'
    '<block name="Leg"><go from="A" wp="B" hmode="route"/><stay wp="B"/></block>'
    '<block name="Ring"><circle wp="HOME" radius="-2.5"/></block>'
    '<block name="Locked"><call fun="nav_spray_run()"/></block>'
)
VARIABLES = '<variables><variable var="k" init="2" min="1" max="5" step="0.5" unit="m"/></variables>'
NAN = math.nan


def session(folder, plan, **options):
    """A station that asked for the private messages, and its vehicle."""
    flight = PlannedFlight(plan, **{"up": 2.0, "arena": "open"} | options)
    station = FakeStation(Bench(folder, aircraft=flight.aircraft, settle=0.0))
    station.advance(0.2)
    return station


@pytest.fixture
def station(tmp_path):
    station = session(tmp_path, plan_of(BLOCKS, VARIABLES))
    station.ask_for("DARKO_PLAN_STATUS")
    return station


def entry(station, number):
    station.send(mavlink.MAVLink_darko_plan_request_message(1, 1, number, mavlink.DARKO_PLAN_PART_ENTRY))
    return station.heard[-1]


def whole_table(station):
    return [entry(station, number) for number in range(station.last("DARKO_PLAN_STATUS").entries)]


def named(station, kind):
    return {m.name: m for m in whole_table(station) if m.get_type() == f"DARKO_PLAN_{kind}"}


def command_int(station, command, params, x, y, z, frame=mavlink.MAV_FRAME_LOCAL_ENU):
    four = (*params, *(NAN,) * (4 - len(params)))
    station.send(mavlink.MAVLink_command_int_message(1, 1, frame, command, 0, 0, *four, x, y, z))
    return station.last("COMMAND_ACK").result


def mission(station):
    """The mission as a stock client downloads it."""
    station.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    count = station.last("MISSION_COUNT")
    for seq in range(count.count):
        station.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, 0))
    items = station.all("MISSION_ITEM_INT")[-count.count :] if count.count else []
    return items, count.opaque_id


def test_only_those_who_ask_are_told(tmp_path):
    station = session(tmp_path, plan_of(BLOCKS))
    station.command(JUMP, LEG)
    station.advance(1.0)
    assert not [m for m in station.heard if m.get_type().startswith("DARKO_PLAN")]


def test_the_status_says_where_the_plan_is(station):
    station.heard.clear()
    station.advance(1.0)
    told = station.all("DARKO_PLAN_STATUS")
    assert len(told) == pytest.approx(4, abs=1)
    assert (told[-1].name, told[-1].block, told[-1].stage_text) == ("t", STAY, "stay wp=A")
    assert told[-1].aim == mavlink.DARKO_PLAN_AIM_POINT
    assert told[-1].block_time == pytest.approx(station.vehicle.time, abs=0.3)


def test_the_table_names_blocks_waypoints_variables_and_sectors(tmp_path):
    station = session(tmp_path, load_flight_plan(VOLIERE), arena="voliere")
    station.ask_for("DARKO_PLAN_STATUS")
    blocks, sectors = named(station, "BLOCK"), named(station, "SECTOR")
    assert (blocks["Takeoff"].strip_button, blocks["Takeoff"].shortcut, blocks["Takeoff"].group) == (
        "Take off",
        "t",
        "flight",
    )
    points, variables = named(station, "WAYPOINT"), named(station, "VARIABLE")
    assert (points["p1"].x, points["p1"].y, points["p1"].z, points["p1"].shown) == (1.5, 1.5, 2.0, 1)
    assert points["_R1"].shown == 0
    corners = [points[f"_R{n}"].number for n in (1, 2, 3, 4)]
    assert (sectors["Room"].corners[:5], sectors["Room"].fence) == ([*corners, 0], 1)
    ring = variables["ring"]
    assert (ring.value, ring.minimum, ring.maximum, ring.unit) == (1.5, 1.0, 2.5, "m")


def test_a_locked_block_says_why_and_is_not_entered(station):
    blocks = named(station, "BLOCK")
    assert "nav_spray_run" in blocks["Locked"].locked
    assert station.command(JUMP, blocks["Locked"].number) == DENIED
    assert "Block Locked denied" in station.texts()


def test_a_jump_is_told_at_once(station):
    station.heard.clear()
    assert station.command(JUMP, LEG) == ACCEPTED
    station.advance(0.2)
    told = station.last("DARKO_PLAN_EVENT")
    assert (told.kind, told.to_block, told.text) == (mavlink.DARKO_PLAN_EVENT_KIND_BLOCK, LEG, "Leg: commanded")
    assert station.last("DARKO_PLAN_STATUS").block == LEG


def test_an_event_is_sent_again_on_request(station):
    station.command(JUMP, LEG)
    station.advance(0.2)
    told = station.last("DARKO_PLAN_EVENT")
    station.heard.clear()
    station.send(mavlink.MAVLink_darko_plan_request_message(1, 1, told.number, mavlink.DARKO_PLAN_PART_EVENT))
    assert station.last("DARKO_PLAN_EVENT").to_dict() == told.to_dict()


def test_a_waypoint_is_moved_by_metres_of_the_plans_origin(station):
    a = named(station, "WAYPOINT")["A"]
    station.heard.clear()
    assert command_int(station, MOVE, (a.number,), 10_000, -20_000, NAN) == ACCEPTED
    station.advance(0.2)
    told = station.last("DARKO_PLAN_WAYPOINT")
    assert (told.name, told.x, told.y, told.z) == ("A", 1.0, -2.0, a.z)


def test_a_waypoint_is_moved_by_latitude_and_longitude(station):
    points = named(station, "WAYPOINT")
    frame = mavlink.MAV_FRAME_GLOBAL
    place = (points["B"].lat, points["B"].lon, points["B"].alt + 1.0)
    assert command_int(station, MOVE, (points["A"].number,), *place, frame) == ACCEPTED
    station.advance(0.2)
    told = station.last("DARKO_PLAN_WAYPOINT")
    expected = (points["B"].x, points["B"].y, points["B"].z + 1.0)
    assert (told.name, (told.x, told.y, told.z)) == ("A", pytest.approx(expected, abs=0.02))


def test_a_variable_is_set_within_its_limits(station):
    assert station.command(SET, 1, NAN, 4.5) == ACCEPTED
    station.advance(0.2)
    assert station.last("DARKO_PLAN_VARIABLE").value == 4.5
    for value in (7.0, 0.0, math.inf, NAN):
        assert station.command(SET, 1, NAN, value) == DENIED
    assert "7 is not within 1..5" in station.texts()


def test_a_request_for_another_plan_is_denied(station):
    right = plan_key(station.last("DARKO_PLAN_STATUS").plan_id)
    assert station.command(JUMP, LEG, right + 1.0) == DENIED
    assert station.command(JUMP, LEG, right) == ACCEPTED


@pytest.mark.parametrize("number", [-1.0, 0.5, 99.0, math.inf, NAN, 1e30])
@pytest.mark.parametrize("command", [JUMP, SET])
def test_a_number_that_is_none_of_the_plan_is_denied(station, command, number):
    assert station.command(command, number, NAN, 2.0) == DENIED


@pytest.mark.parametrize(
    ("x", "y", "z", "frame", "result"),
    [
        (0, 0, math.inf, mavlink.MAV_FRAME_LOCAL_ENU, DENIED),
        (0x7FFFFFFF, 0, 2.0, mavlink.MAV_FRAME_LOCAL_ENU, DENIED),
        (2_000_000_000, 0, 2.0, mavlink.MAV_FRAME_LOCAL_ENU, DENIED),
        (2_000_000_000, 0, 2.0, mavlink.MAV_FRAME_GLOBAL, DENIED),
        (0, 0, 2.0, mavlink.MAV_FRAME_BODY_FRD, mavlink.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME),
        (0, 0, 2.0, 200, mavlink.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME),
    ],
)
def test_a_place_that_cannot_be_is_refused(station, x, y, z, frame, result):
    assert command_int(station, MOVE, (2.0,), x, y, z, frame) == result


def test_waypoints_are_not_moved_by_floats(station):
    assert station.command(MOVE, 2.0) == mavlink.MAV_RESULT_COMMAND_INT_ONLY


def test_without_a_plan_requests_are_rejected(tmp_path):
    station = FakeStation.with_vehicle(tmp_path, up=2.0)
    for command in (JUMP, SET):
        assert station.command(command, 0.0) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    station.ask_for("DARKO_PLAN_STATUS")
    assert station.last("DARKO_PLAN_STATUS") is None


# The present leg as a mission


def test_a_leg_is_seen_as_a_mission_of_its_two_ends(station):
    station.command(JUMP, LEG)
    station.advance(1.5)
    points = named(station, "WAYPOINT")
    items, identity = mission(station)
    assert [(i.command, i.x, i.y) for i in items] == [
        (mavlink.MAV_CMD_NAV_WAYPOINT, points[name].lat, points[name].lon) for name in ("A", "B")
    ]
    assert [i.current for i in items] == [0, 1]
    told = station.last("MISSION_CURRENT")
    assert (told.seq, told.total, told.mission_id) == (1, 2, identity)
    assert (told.mission_state, told.mission_mode) == (mavlink.MISSION_STATE_ACTIVE, 1)


def test_a_circle_is_seen_as_a_loiter_with_its_radius(station):
    station.command(JUMP, RING)
    station.advance(1.5)
    (item,), _ = mission(station)
    assert (item.command, item.param3) == (mavlink.MAV_CMD_NAV_LOITER_UNLIM, -2.5)


def test_another_leg_is_told_by_its_id(station):
    station.advance(1.5)
    before = station.last("MISSION_CURRENT").mission_id
    station.command(JUMP, RING)
    station.advance(1.5)
    assert station.last("MISSION_CURRENT").mission_id not in {0, before}


def items_of(count):
    return tuple(
        MissionItem(command=16, frame=3, params=(0.0, 0.0, 0.0, 0.0), x=435641000 + n, y=14829000, z=3.0)
        for n in range(count)
    )


def test_the_mission_is_not_changed_while_a_plan_is_flown_and_comes_back(station):
    assert station.mode(Mode.HOLD) == ACCEPTED
    station.advance(0.2)
    assert station.upload(items_of(3)) == mavlink.MAV_MISSION_ACCEPTED
    _, own = mission(station)
    assert station.mode(Mode.FLIGHT_PLAN) == ACCEPTED
    station.advance(1.2)
    station.heard.clear()
    assert station.upload(items_of(2)) == mavlink.MAV_MISSION_DENIED
    assert "Mission refused: a flight plan is flown" in station.texts()
    station.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    assert station.last("MISSION_ACK").type == mavlink.MAV_MISSION_DENIED
    station.send(mavlink.MAVLink_mission_set_current_message(1, 1, 0))
    assert len(mission(station)[0]) == 1
    assert station.mode(Mode.HOLD) == ACCEPTED
    station.advance(0.2)
    items, identity = mission(station)
    assert (len(items), identity) == (3, own)
    assert station.last("MISSION_CURRENT").mission_id == own


def test_an_upload_under_way_ends_when_the_plan_takes_over(station):
    assert station.mode(Mode.HOLD) == ACCEPTED
    station.advance(0.2)
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 2, 0))
    assert station.mode(Mode.FLIGHT_PLAN) == ACCEPTED
    station.advance(0.2)
    assert station.last("MISSION_ACK").type == mavlink.MAV_MISSION_DENIED


def test_the_fence_is_changed_while_a_plan_is_flown(station):
    station.send(mavlink.MAVLink_mission_clear_all_message(1, 1, mavlink.MAV_MISSION_TYPE_FENCE))
    assert station.last("MISSION_ACK").type == mavlink.MAV_MISSION_ACCEPTED


# Loading


SENT = plan_of('<block name="Fish"><call fun="nav_fish_run(1)"/></block><block name="Stay"><stay wp="A"/></block>')
NAMES = parse_name_mapping("[functions]\nnav_fish_run = 0\n", "names.toml")


def load(station, data):
    """The vehicle's answer to a file."""
    for offset in range(0, len(data), PIECE_BYTES):
        piece = data[offset : offset + PIECE_BYTES]
        padded = list(piece.ljust(PIECE_BYTES, b"\0"))
        station.send(
            mavlink.MAVLink_darko_plan_file_message(len(data), zlib.crc32(data), offset, 1, 1, len(piece), padded)
        )
    return station.last("DARKO_PLAN_FILE_ACK")


def standing(folder, plan=None, **node_options):
    """A station whose vehicle stands on the ground, with a plan of its command line or none."""
    aircraft = None if plan is None else PlannedFlight(plan, arena="open").aircraft
    station = FakeStation(Bench(folder, aircraft=aircraft, settle=0.0, node_options=node_options))
    station.advance(0.2)
    station.ask_for("DARKO_PLAN_STATUS")
    station.advance(0.5)
    return station


def blocks(station):
    return [block.name for block in station.autopilot.flight_plan.blocks()]


def test_a_plan_is_loaded_with_what_its_names_mean(tmp_path):
    station = standing(tmp_path)
    assert load(station, pack_plan(SENT, NAMES)).result == ACCEPTED
    assert [block.locked for block in station.autopilot.flight_plan.blocks()] == ["", "", ""]
    assert station.autopilot.mode is not Mode.FLIGHT_PLAN


def test_names_that_are_not_valid_refuse_the_plan(tmp_path):
    station = standing(tmp_path)
    data = pack_plan(SENT, NAMES).replace(b"= 0", b"= x")
    assert load(station, data).result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "names of plan: not TOML" in station.texts()
    assert station.node.state_folder.flight_plan() is None


def test_a_plan_that_was_sent_outlives_a_restart(tmp_path):
    load(standing(tmp_path), pack_plan(SENT, NAMES))
    again = standing(tmp_path)
    assert blocks(again) == ["Fish", "Stay", "HOME"]
    assert not again.autopilot.flight_plan.blocks()[0].locked
    assert again.autopilot.mode is not Mode.FLIGHT_PLAN
    assert "Stored flight plan loaded; mode FLIGHT_PLAN flies it" in again.texts()


def test_a_vehicle_that_starts_in_the_air_has_its_stored_plan_and_takes_no_other(tmp_path):
    load(standing(tmp_path), pack_plan(SENT, NAMES))
    flying = FakeStation.with_vehicle(tmp_path, up=3.0)
    assert blocks(flying) == ["Fish", "Stay", "HOME"]
    assert load(flying, pack_plan(plan_of(BLOCKS))).result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "land and disarm first" in flying.texts()
    assert blocks(flying) == ["Fish", "Stay", "HOME"]


@pytest.mark.long
def test_the_command_line_comes_before_what_is_stored_unless_that_was_sent_since(tmp_path):
    station = standing(tmp_path, plan_of(BLOCKS))
    assert not station.node.flight_plan_was_sent
    load(station, pack_plan(SENT, NAMES))
    assert station.node.flight_plan_was_sent
    rebooted = standing(tmp_path, plan_of(BLOCKS), stored_plan_first=True)
    assert blocks(rebooted) == ["Fish", "Stay", "HOME"]
    assert rebooted.node.flight_plan_was_sent
    assert blocks(standing(tmp_path, plan_of(BLOCKS))) == ["Stay", "Leg", "Ring", "Locked", "HOME"]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"<flight_plan", "stored:1:"),
        (pack_plan(SENT).replace(b'lat0="43.5641"', b'lat0="10.0"'), "its origin is out of reach"),
    ],
)
def test_a_stored_plan_that_cannot_be_flown_is_left_out(tmp_path, data, words):
    (tmp_path / "flight_plan.xml").write_bytes(data)
    station = standing(tmp_path)
    assert blocks(station) == []
    assert f"Stored flight plan not loaded: {words}" in station.texts()


def test_on_a_full_disk_the_plan_is_flown_and_the_pilot_is_told(tmp_path):
    station = standing(tmp_path)
    with full_disk():
        assert load(station, pack_plan(SENT, NAMES)).result == ACCEPTED
    assert "flight plan not saved" in station.texts()
    assert blocks(station)[0] == "Fish"
    assert blocks(standing(tmp_path)) == []
