"""Actuators and their limits as text."""

import pytest

from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.tui.widgets.hybrid_panel import ActuatorPanel
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Limit
from tests.support.gcs.messages import arrived
from tests.support.gcs.screens import panel_text
from tests.support.vehicle.darko_messages import actuators

UNKNOWN_LIMIT = 1 << 9  # of a newer vehicle


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        (0, "within all limits"),
        (Limit.MOTOR_RIGHT | Limit.ELEVON_LEFT, "at limit: motor R, elevon L"),
        (Limit.MOTOR_LEFT_RATE, "at limit: motor L rate"),
        (UNKNOWN_LIMIT, "within all limits"),
    ],
)
def test_limits_are_named(limits, words):
    s = reduce(EMPTY_SNAPSHOT, arrived(actuators(1000, limits=limits)), 1.0)
    assert words in panel_text(ActuatorPanel("", id="x"), s)


@pytest.mark.parametrize(("height", "lines"), [(8, 5), (4, 3)])
def test_outputs_of_another_autopilot_are_shown_as_pulses(height, lines):
    raw = mavlink.MAVLink_servo_output_raw_message(0, 0, 1500, 1100, 0, 1900, 1000, 2000, 0, 0)
    s = reduce(EMPTY_SNAPSHOT, arrived(raw), 1.0)
    text = panel_text(ActuatorPanel("", id="x"), s, width=60, height=height)
    assert len(text.splitlines()) == lines
    assert all(words in text for words in ("S1", "1500 us", "S6", "2000 us"))
    assert "S3" not in text
