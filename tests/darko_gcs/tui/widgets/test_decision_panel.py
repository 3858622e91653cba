"""The decision with its leg and its age."""

from dataclasses import replace

import pytest

from darko_gcs.tui.widgets.flight_panel import DecisionPanel, decision_summary
from protocol.dialect import mavlink
from tests.support.gcs.screens import panel_text, styled_text
from tests.support.gcs.snapshots import FORWARD

ACTIVE, PAUSED = mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED


@pytest.mark.parametrize(("state", "current", "is_past"), [(ACTIVE, 3, False), (ACTIVE, 4, True), (PAUSED, 3, True)])
def test_a_decision_on_a_leg_that_is_over_says_so(state, current, is_past):
    s = replace(FORWARD, mission_state=state, mission_current=current, boot=FORWARD.decision.time + 12.0)
    text = panel_text(DecisionPanel("", id="x"), s)
    assert "decided 12 s ago" in text
    assert ("a past leg" in text) == is_past
    assert decision_summary(s, 80).startswith("past leg to 3" if is_past else "leg to 3")


def test_the_decision_is_shortened_to_the_room_there_is():
    s = replace(FORWARD, mission_state=ACTIVE, mission_current=3)
    texts = {width: decision_summary(s, width) for width in (60, 36, 30, 20)}
    assert texts[60] == "leg to 3: forward, less energy, saves 65 %"
    assert texts[36] == texts[30] == "leg to 3: forward, less energy"
    assert texts[20] == "leg to 3: forward"


def test_no_line_of_the_decision_is_cut_in_the_panel_of_120_columns():
    lines = panel_text(DecisionPanel("", id="x"), replace(FORWARD, mission_state=PAUSED, boot=1e4), width=37).split(
        "\n"
    )
    assert max(map(len, lines)) <= 37


def test_a_past_decision_is_not_in_the_colour_of_what_holds():
    s = replace(FORWARD, mission_state=PAUSED, mission_current=3)
    assert styled_text(DecisionPanel("", id="x").draw(s, 40, 9), "good") == ""
    assert "FORWARD" not in panel_text(DecisionPanel("", id="x"), s)
    active = replace(s, mission_state=ACTIVE)
    assert "forward" in styled_text(DecisionPanel("", id="x").draw(active, 40, 9), "good")
