"""Numbers of the dialect in words, also those of a newer vehicle."""

import pytest

from darko_gcs.state.text import command_name, counted, format_time, label_of, printable, reason_text
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Law, Reason
from protocol.names import as_member, name_of


@pytest.mark.parametrize(
    ("enum", "number", "label", "name"),
    [
        (Law, 5, "forward line-of-sight", "FORWARD_LINE_OF_SIGHT"),
        (Reason, 4, "take-off", "TAKEOFF"),
        (Law, 99, "law 99", "99"),
        (DecisionReason, 200, "decision reason 200", "200"),
    ],
)
def test_numbers_have_labels_and_names_and_unknown_ones_stay_numbers(enum, number, label, name):
    assert (label_of(enum, number), name_of(enum, number)) == (label, name)


def test_an_unknown_number_is_not_a_member():
    assert as_member(Law, 1) is Law.HOVER_LINEAR
    assert as_member(Law, 99) is None


def test_commands_and_results_are_shown_in_lower_case():
    assert command_name(mavlink.MAV_CMD_NAV_TAKEOFF) == "nav takeoff"
    assert command_name(mavlink.MAV_CMD_DARKO_JUMP_TO_BLOCK) == "jump to block"
    assert command_name(mavlink.MAV_CMD_COMPONENT_ARM_DISARM) == "arm disarm"
    assert command_name(7) == "command 7"
    assert reason_text("TEMPORARILY_REJECTED") == "temporarily rejected"
    assert reason_text("DRK_KPP: value out of range") == "DRK_KPP: value out of range"


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.0, "0:00.0"), (83.25, "1:23.2"), (59.96, "1:00.0"), (3601.0, "1:00:01.0")]
)
def test_times_are_minutes_and_seconds(seconds, text):
    assert format_time(seconds) == text


def test_control_characters_become_question_marks():
    assert printable("\x1b[2Jdone\x07") == "?[2Jdone?"


def test_one_thing_is_not_several():
    assert [counted(number, "item") for number in (0, 1, 2)] == ["0 items", "1 item", "2 items"]
