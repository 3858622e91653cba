"""Panels of attitude, motors and elevons, and the hybrid controller: law in force, Lyapunov values, jumps."""

import math

import pytest

from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.tui.widgets.hybrid_panel import LAW_STYLES, ActuatorPanel, AttitudePanel, HybridPanel, display_offset
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Limit, Saturation
from protocol.frames import SHOW_AS_TOLD, SHOW_PITCHED_UP, displayed, euler_from_quaternion, quaternion_from_euler
from tests.support.gcs.home import snapshot_after
from tests.support.gcs.messages import arrived, heartbeat, vtol_state
from tests.support.gcs.screens import panel_text
from tests.support.gcs.snapshots import snapshot_with
from tests.support.vehicle.darko_messages import actuators, hybrid_state

HOVER, FORWARD = mavlink.MAV_VTOL_STATE_MC, mavlink.MAV_VTOL_STATE_FW
TO_HOVER = mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC
COPTER = mavlink.MAV_TYPE_QUADROTOR


def told(angles, offset=SHOW_AS_TOLD):
    """ATTITUDE_QUATERNION of angles [deg]."""
    q1, q2, q3, q4 = quaternion_from_euler(*map(math.radians, angles))
    return mavlink.MAVLink_attitude_quaternion_message(10, q1, q2, q3, q4, 0, 0, 0, list(offset))


def attitude_shown(s):
    """Angles of the horizon [deg]."""
    return [math.degrees(angle) for angle in euler_from_quaternion(displayed(s.attitude.q, display_offset(s)))]


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
    assert attitude_shown(s) == pytest.approx(horizon, abs=1e-4)
    assert all(words in text(s) for words in line), text(s)


def test_without_quaternions_a_hover_is_shown_level():
    angles = mavlink.MAVLink_attitude_message(10, 0.0, 0.0, 1.0, 0, 0, 0)
    s = snapshot_after(heartbeat(), vtol_state(HOVER), angles)
    assert attitude_shown(s) == pytest.approx((0.0, 0.0, math.degrees(1.0)), abs=1e-4)
    assert "nose +90" in text(s)


def test_a_multicopter_is_shown_as_it_is():
    s = snapshot_after(heartbeat(kind=COPTER), told((10.0, 5.0, 30.0), (0.0, 0.0, 0.0, 0.0)))
    assert attitude_shown(s) == pytest.approx((10.0, 5.0, 30.0), abs=1e-4)
    assert "nose +5" in text(s)
    assert "bank +10" in text(s)


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


def test_within_all_limits_and_saturated_exclude_each_other():
    def drawn(**states):
        s = reduce(EMPTY_SNAPSHOT, arrived(actuators(1000, **states)), 1.0)
        return panel_text(ActuatorPanel("", id="x"), s, height=8)

    text = drawn(saturation=Saturation.THRUST | Saturation.BOOST)
    assert "saturated: thrust, boost" in text
    assert "within all limits" not in text
    both = drawn(saturation=Saturation.THRUST, limits=Limit.MOTOR_LEFT)
    assert "saturated: thrust" in both
    assert "at limit: motor L" in both


@pytest.mark.parametrize(("height", "lines"), [(8, 5), (4, 3)])
def test_outputs_of_another_autopilot_are_shown_as_pulses(height, lines):
    raw = mavlink.MAVLink_servo_output_raw_message(0, 0, 1500, 1100, 0, 1900, 1000, 2000, 0, 0)
    s = reduce(EMPTY_SNAPSHOT, arrived(raw), 1.0)
    text = panel_text(ActuatorPanel("", id="x"), s, width=60, height=height)
    assert len(text.splitlines()) == lines
    assert all(words in text for words in ("S1", "1500 us", "S6", "2000 us"))
    assert "S3" not in text


def shown(message):
    return panel_text(HybridPanel("", id="x"), reduce(EMPTY_SNAPSHOT, arrived(message), 1.0))


def test_every_law_has_a_style():
    assert set(LAW_STYLES) == set(Law)
    assert LAW_STYLES[Law.FAILSAFE] == LAW_STYLES[Law.CRASHED] == "bad"
    assert "CRASHED" in shown(hybrid_state(100, Law.CRASHED))


def test_a_law_that_is_never_left_has_an_infinite_threshold():
    assert "(50/inf)" in shown(hybrid_state(100, v_hover_leave=math.inf))


def test_an_unknown_law_is_shown_by_its_number():
    text = shown(hybrid_state(100, 15, last_law=14, last_reason=13))
    assert "LAW 15" in text
    assert "from law 14: reason 13" in text


def test_a_vehicle_without_a_hybrid_state_is_reported():
    panel = HybridPanel("", id="x")
    assert "no vehicle yet" in panel_text(panel, EMPTY_SNAPSHOT)
    assert "no hybrid state" in panel_text(panel, snapshot_with(EMPTY_SNAPSHOT, identity={"source": (1, 1)}))


def test_the_cause_of_the_last_jump_is_whole_on_a_narrow_panel():
    s = reduce(EMPTY_SNAPSHOT, arrived(hybrid_state(100, jumps=12, last_law=Law.HOVER_ZERO_MOMENT, last_reason=1)), 1.0)
    narrow = " ".join(panel_text(HybridPanel("", id="x"), s, width=38).split())
    wide = panel_text(HybridPanel("", id="x"), s, width=100).splitlines()[2].strip()
    assert wide.startswith("jump 12 from hover zero-moment")
    assert wide in narrow


def test_each_curve_and_threshold_names_its_law():
    s = reduce(EMPTY_SNAPSHOT, arrived(hybrid_state(100, Law.HOVER_LINEAR)), 1.0)
    lines = HybridPanel("", id="x").draw(s, 80, 14)
    text = panel_text(HybridPanel("", id="x"), s, height=14)
    assert "hover leave" in text
    assert "hover enter" in text
    assert {"hover ", "h"} <= {part for line in lines for part, style in line if style == "hover"}
    assert "fwd " in {part for line in lines for part, style in line if style == "forward"}


@pytest.mark.parametrize(
    ("parameters", "v", "width", "words"),
    [
        ({"DRK_FWD_LIN": 0.0}, math.nan, 80, "fwd off (DRK_FWD_LIN)"),
        ({"DRK_FWD_LIN": 0.0}, math.nan, 36, "fwd off"),
        ({"DRK_FWD_LIN": 1.0}, math.nan, 80, "fwd -- ("),
        ({}, math.nan, 80, "fwd -- ("),
        ({"DRK_FWD_LIN": 0.0}, 2.0, 80, "fwd 2 ("),
    ],
)
def test_a_law_that_is_known_to_be_off_is_called_off(parameters, v, width, words):
    s = reduce(EMPTY_SNAPSHOT, arrived(hybrid_state(100, v_forward=v)), 1.0)
    s = snapshot_with(s, parameters={"values": parameters})
    assert words in panel_text(HybridPanel("", id="x"), s, width=width).splitlines()[1]


def test_the_governor_is_never_cut():
    for width in (38, 80):
        s = reduce(
            EMPTY_SNAPSHOT, arrived(hybrid_state(100, Law.HOVER_ZERO_MOMENT, governor=0.95, v_hover=2457.0)), 1.0
        )
        first = panel_text(HybridPanel("", id="x"), s, width=width).splitlines()[0]
        assert first.endswith("governor 95 %")
        assert len(first) <= width
