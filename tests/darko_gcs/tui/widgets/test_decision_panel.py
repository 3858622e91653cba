"""The decision with its leg and its age."""

from dataclasses import replace

import pytest

from darko_gcs.tui.widgets.decision_panel import DecisionPanel, decision_summary
from protocol.dialect import mavlink
from tests.support.gcs.screens import panel_text
from tests.support.gcs.snapshots import FORWARD

ACTIVE, PAUSED = mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED


@pytest.mark.parametrize(("state", "current", "is_past"), [(ACTIVE, 3, False), (ACTIVE, 4, True), (PAUSED, 3, True)])
def test_a_decision_on_a_leg_that_is_over_says_so(state, current, is_past):
    s = replace(FORWARD, mission_state=state, mission_current=current, boot=FORWARD.decision.time + 12.0)
    text = panel_text(DecisionPanel("", id="x"), s)
    assert "12 s ago" in text
    assert ("past leg" in text) == is_past
    assert decision_summary(s).startswith("past leg to 3" if is_past else "to 3")
