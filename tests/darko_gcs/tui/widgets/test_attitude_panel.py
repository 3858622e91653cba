"""The artificial horizon of a tail-sitter, as its messages make it."""

import math

import pytest

from darko_gcs.tui.widgets.hybrid_panel import AttitudePanel, display_offset
from protocol.dialect import mavlink
from protocol.frames import SHOW_AS_TOLD, SHOW_PITCHED_UP, displayed, euler_from_quaternion, quaternion_from_euler
from tests.support.gcs.home import snapshot_after
from tests.support.gcs.messages import heartbeat, vtol_state
from tests.support.gcs.screens import panel_text

HOVER, FORWARD = mavlink.MAV_VTOL_STATE_MC, mavlink.MAV_VTOL_STATE_FW
TO_HOVER = mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC
COPTER = mavlink.MAV_TYPE_QUADROTOR


def told(angles, offset=SHOW_AS_TOLD):
    """ATTITUDE_QUATERNION of angles [deg]."""
    q1, q2, q3, q4 = quaternion_from_euler(*map(math.radians, angles))
    return mavlink.MAVLink_attitude_quaternion_message(10, q1, q2, q3, q4, 0, 0, 0, list(offset))


def shown(s):
    """Angles of the horizon [deg]."""
    return [math.degrees(angle) for angle in euler_from_quaternion(displayed(s.q, display_offset(s)))]


def text(s):
    return panel_text(AttitudePanel("", id="x"), s, width=40, height=10)


@pytest.mark.parametrize(
    ("state", "angles", "offset", "horizon", "line"),
    [
        (HOVER, (0.0, 0.0, 30.0), SHOW_AS_TOLD, (0.0, 0.0, 30.0), ("nose +90", "tilt 0")),
        (HOVER, (0.0, -20.0, 30.0), SHOW_AS_TOLD, (0.0, -20.0, 30.0), ("nose +70", "tilt 20")),
        (FORWARD, (0.0, -85.0, 30.0), SHOW_PITCHED_UP, (0.0, 5.0, 30.0), ("nose +5", "bank +0")),
        (TO_HOVER, (0.0, -60.0, 30.0), SHOW_AS_TOLD, (0.0, 30.0, 30.0), ("nose +30", "bank +0")),
    ],
)
def test_a_tail_sitter_is_shown_level_whichever_way_it_flies(state, angles, offset, horizon, line):
    s = snapshot_after(heartbeat(), vtol_state(state), told(angles, offset))
    assert shown(s) == pytest.approx(horizon, abs=1e-4)
    assert all(words in text(s) for words in line), text(s)


def test_without_quaternions_a_hover_is_shown_level():
    angles = mavlink.MAVLink_attitude_message(10, 0.0, 0.0, 1.0, 0, 0, 0)
    s = snapshot_after(heartbeat(), vtol_state(HOVER), angles)
    assert shown(s) == pytest.approx((0.0, 0.0, math.degrees(1.0)), abs=1e-4)
    assert "nose +90" in text(s)


def test_a_multicopter_is_shown_as_it_is():
    s = snapshot_after(heartbeat(kind=COPTER), told((10.0, 5.0, 30.0), (0.0, 0.0, 0.0, 0.0)))
    assert shown(s) == pytest.approx((10.0, 5.0, 30.0), abs=1e-4)
    assert "nose +5" in text(s)
    assert "bank +10" in text(s)
