"""A take-off that arms first leaves no propellers turning where the vehicle refuses it."""

import pytest

from darko_gcs.station.armed_take_off import REFUSED, UNANSWERED, UNASKED, ArmedTakeOff
from protocol.dialect import mavlink
from protocol.events import CommandDone

ARM, TAKE_OFF = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_NAV_TAKEOFF
YES, NO = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED


class Told:
    """In place of a station: what it was asked to do."""

    def __init__(self):
        self.done = []

    def arm(self, _now):
        self.done.append("arm")

    def disarm(self, _now):
        self.done.append("disarm")

    def add_line(self, _now, text):
        self.done.append(text)


def told(answers, *, waits_for_arming, command=TAKE_OFF):
    """Everything that is done for a command and the answers to it."""
    station = Told()
    take_off = ArmedTakeOff(station)
    take_off.begin(command, lambda: station.done.append("ask"), 1.0, waits_for_arming=waits_for_arming)
    for answered, result in answers:
        take_off.follow(CommandDone(request=1, command=answered, result=result, reason=""), 1.0)
    return station.done


@pytest.mark.parametrize(
    ("answers", "done"),
    [
        ([(ARM, YES), (TAKE_OFF, YES)], []),
        ([(ARM, YES), (TAKE_OFF, NO)], [f"Take-off {REFUSED}", "disarm"]),
        ([(ARM, YES), (TAKE_OFF, None)], [f"Take-off {UNANSWERED}"]),
        ([(ARM, NO), (TAKE_OFF, NO)], []),
        ([(ARM, YES), (TAKE_OFF, NO), (TAKE_OFF, NO)], [f"Take-off {REFUSED}", "disarm"]),
    ],
)
def test_it_is_disarmed_again_once_if_it_was_armed_for_a_take_off_that_is_refused(answers, done):
    assert told(answers, waits_for_arming=False) == ["arm", "ask", *done]


@pytest.mark.parametrize(
    ("answers", "done"),
    [
        ([(TAKE_OFF, NO)], []),
        ([(TAKE_OFF, None)], [f"Take-off {UNASKED}"]),
        ([(TAKE_OFF, YES), (ARM, YES)], ["arm"]),
        ([(TAKE_OFF, YES), (ARM, NO)], ["arm", "disarm"]),
        ([(TAKE_OFF, YES), (ARM, None)], ["arm", f"Take-off {UNANSWERED}"]),
        ([(ARM, YES), (TAKE_OFF, NO), (ARM, NO)], []),
    ],
)
def test_a_vehicle_that_waits_for_arming_is_armed_only_after_its_yes(answers, done):
    assert told(answers, waits_for_arming=True) == ["ask", *done]


def test_a_refused_take_off_of_a_vehicle_that_was_armed_before_stops_nothing():
    station = Told()
    ArmedTakeOff(station).follow(CommandDone(request=1, command=TAKE_OFF, result=NO, reason=""), 1.0)
    assert station.done == []


def test_a_mission_that_was_armed_for_and_is_refused_stops_the_propellers_too():
    start = mavlink.MAV_CMD_MISSION_START
    answers = ((ARM, YES), (TAKE_OFF, NO), (start, NO))
    assert told(answers, waits_for_arming=False, command=start) == ["arm", "ask", f"Mission {REFUSED}", "disarm"]
