"""Requests and what became of them, folded into the snapshot: ours, and those of stations in a recording."""

import math

import pytest

from darko_gcs.state.reduce import reduce
from darko_gcs.state.reduce_events import reduce_event
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.text import RESTARTED
from protocol.dialect import mavlink
from protocol.events import (
    CommandDone,
    MissionFailed,
    ParameterFailed,
    ParametersComplete,
    VehicleFound,
    VehicleLost,
    VehicleReturned,
)
from protocol.frames import Geodetic
from protocol.names import Mode, custom_mode
from protocol.wire.codec import Codec
from tests.support.gcs.messages import arrived, command_long, heartbeat
from tests.support.gcs.snapshots import snapshot_with

HEARD = reduce(EMPTY_SNAPSHOT, arrived(heartbeat()), 1.0)


def test_answers_are_shown_in_words():
    refused = CommandDone(
        request=1,
        command=mavlink.MAV_CMD_NAV_TAKEOFF,
        result=mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
        reason="TEMPORARILY_REJECTED",
    )
    s = reduce_event(EMPTY_SNAPSHOT, refused, 2.0)
    assert s.log.lines[-1].text == "take off: temporarily rejected"
    s = reduce_event(s, MissionFailed("upload", None, "no answer"), 3.0)
    assert s.log.lines[-1].text == "Mission upload failed: no answer"


def test_loss_and_return_of_the_vehicle_are_shown():
    s = reduce_event(HEARD, VehicleLost(3.0), 4.0)
    assert s.link.lost
    assert not reduce_event(s, VehicleReturned(5.0), 9.0).link.lost
    assert not reduce(s, arrived(heartbeat()), 9.0).link.lost


def test_a_vehicle_is_found_by_its_system_id_and_another_component_is_told():
    for source, text in (((1, 1), "Vehicle 1 found"), ((3, 7), "Vehicle 3/7 found")):
        assert reduce_event(HEARD, VehicleFound(*source), 4.0).log.lines[-1].text == text


def test_what_a_restart_interrupted_is_asked_again_and_no_failure():
    for event in (MissionFailed("download", None, RESTARTED), ParameterFailed("", RESTARTED)):
        assert reduce_event(HEARD, event, 4.0).log == HEARD.log
    for event in (MissionFailed("upload", None, RESTARTED), ParameterFailed("DRK_KPP", RESTARTED)):
        assert reduce_event(HEARD, event, 4.0).log.lines[-1].text.endswith(RESTARTED)


def test_an_event_without_a_handler_changes_nothing():
    assert reduce_event(HEARD, ParametersComplete(3), 2.0) is HEARD


GROUND, OTHER_GROUND = Codec(255, 190), Codec(7, 190)
RECORDED = snapshot_with(
    reduce(EMPTY_SNAPSHOT, arrived(heartbeat()), 1.0),
    session={"is_replay": True},
    position={"home": Geodetic(43.5648, 1.4811, 150.0)},
)
HOLD = custom_mode(Mode.HOLD)


def lines(*messages, s=RECORDED, codec=GROUND):
    for message in messages:
        s = reduce(s, arrived(message, codec), 2.0)
    return [line.text for line in s.log.lines]


def go_to(lat, lon, height):
    return mavlink.MAVLink_command_int_message(
        1, 1, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_CMD_DO_REPOSITION, 0, 0,
        math.nan, 1.0, math.nan, math.nan, lat, lon, height,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (command_long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0), "Sent: arm"),
        (command_long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0), "Sent: disarm by force"),
        (command_long(mavlink.MAV_CMD_DO_VTOL_TRANSITION, 4.0), "Sent: front transition"),
        (
            command_long(mavlink.MAV_CMD_DO_SET_MODE, 1.0, float(HOLD >> 16 & 0xFF), float(HOLD >> 24)),
            "Sent: mode HOLD",
        ),
        (command_long(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH), "Sent: return home"),
        (command_long(mavlink.MAV_CMD_MISSION_START, 3.0), "Sent: fly the mission from item 3"),
        (command_long(mavlink.MAV_CMD_MISSION_START, math.nan), "Sent: fly the mission"),
        (go_to(435648000, 14811000, 5.0), "Sent: go to north 0.0, east 0.0 m, 5.0 m up"),
        (mavlink.MAVLink_param_set_message(1, 1, b"DRK_KPP", 2.5, 9), "Sent: parameter DRK_KPP = 2.5"),
        (mavlink.MAVLink_mission_count_message(1, 1, 4), "Sent: mission of 4 items"),
        (mavlink.MAVLink_mission_count_message(1, 1, 1, mission_type=1), "Sent: fence of 1 item"),
        (mavlink.MAVLink_mission_clear_all_message(1, 1), "Sent: clear the mission"),
        (mavlink.MAVLink_mission_set_current_message(1, 1, 2), "Sent: continue at item 2"),
    ],
)
def test_a_request_is_told_in_a_pilots_words(message, text):
    assert lines(message) == [text]


def test_another_station_is_named_and_a_repetition_or_a_request_of_a_program_is_not_told():
    arm = command_long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    assert lines(arm, codec=OTHER_GROUND) == ["Sent by 7/190: arm"]
    assert lines(arm, arm) == ["Sent: arm"]
    assert lines(command_long(mavlink.MAV_CMD_REQUEST_MESSAGE, 242.0)) == []
    assert lines(command_long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, target=(9, 1))) == []


def test_an_answer_in_a_recording_repeats_what_was_asked_for():
    s = reduce(RECORDED, arrived(command_long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0), GROUND), 2.0)
    answer = mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_RESULT_ACCEPTED)
    assert lines(answer, s=s, codec=Codec(1, 1)) == ["Sent: arm", "arm: accepted"]


def test_answers_of_the_vehicle_are_told():
    def answer(result):
        return mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_DO_REPOSITION, result)

    vehicle = Codec(1, 1)
    assert lines(answer(mavlink.MAV_RESULT_ACCEPTED), codec=vehicle) == ["go to: accepted"]
    assert lines(answer(mavlink.MAV_RESULT_IN_PROGRESS), codec=vehicle) == []
    refused = reduce(RECORDED, arrived(answer(mavlink.MAV_RESULT_DENIED), vehicle), 2.0)
    assert refused.log.lines[-1][1:] == (mavlink.MAV_SEVERITY_WARNING, "go to: denied")
    upload = mavlink.MAVLink_mission_ack_message(255, 190, mavlink.MAV_MISSION_ACCEPTED)
    assert lines(upload, codec=vehicle) == ["mission: accepted"]


def test_on_the_link_they_change_nothing():
    live = snapshot_with(RECORDED, session={"is_replay": False})
    assert lines(command_long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0), s=live) == []
    assert lines(mavlink.MAVLink_command_ack_message(16, 0), s=live, codec=Codec(1, 1)) == []
