"""Folding messages into the snapshot."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from darko_gcs.mode_names import COPTER, PLANE
from darko_gcs.snapshot import EMPTY, Thresholds
from darko_gcs.store import CERTAIN, KEPT_LINES, KEPT_TRACK, note, reduce, reduce_event
from darko_gcs.store_darko import KEPT_V
from darko_gcs.widgets.map import MapPanel, decision_words
from darko_gcs.widgets.numbers import DecisionPanel, FlightPanel
from darko_gcs.widgets.panels import ActuatorPanel, AttitudePanel, HybridPanel, MessagePanel
from darko_gcs.widgets.status import StatusBar
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Limit, Saturation
from protocol.events import CommandDone, MissionFailed, VehicleLost, VehicleReturned
from protocol.tlog import read_tlog
from tests.support.darko_messages import actuators, hybrid_state
from tests.support.messages import OTHER, heartbeat, position, told
from tests.support.paths import DATA


def fold(messages, s=EMPTY):
    for message in messages:
        s = reduce(s, told(message), 1.0)
    return s


def test_a_heartbeat_names_the_vehicle_its_mode_and_arming():
    s = fold([heartbeat(armed=True)])
    assert (s.source, s.mode, s.armed, s.heartbeat_at) == ((1, 1), "HOLD", True, 1.0)


def test_a_vehicle_whose_failsafes_see_cause_for_alarm_says_so_in_the_status_line():
    line = {state: str(StatusBar().draw(fold([heartbeat(state=state)]), 120, 1)[0]) for state in range(3, 7)}
    assert [state for state, text in line.items() if "FAILSAFE" in text] == [5, 6]  # critical, emergency


def test_a_second_vehicle_is_not_mixed_in():
    s = fold([heartbeat(), position(10, 1.0)])
    after = reduce(s, told(position(20, 99.0), OTHER), 2.0)
    assert after.p == s.p
    assert reduce(s, told(heartbeat(armed=True), OTHER), 2.0).armed is False


def test_v_is_kept_by_the_vehicles_time_and_bounded():
    s = fold([hybrid_state(100 * n, v_hover=float(n)) for n in range(KEPT_V + 50)])
    assert len(s.v_history) == KEPT_V
    assert s.v_history[-1][:2] == pytest.approx(((KEPT_V + 49) / 10, KEPT_V + 49))
    assert math.isnan(s.v_history[-1][2])
    assert fold([hybrid_state(1)], s) is not s


def test_the_time_of_a_law_begins_when_it_changes():
    s = fold([hybrid_state(1000, Law.HOVER_ZERO_MOMENT), hybrid_state(2000), hybrid_state(5000)])
    assert s.law == "hover linear"
    assert s.law_since == 2.0


def test_a_restart_of_the_vehicle_clears_what_belonged_to_the_old_flight():
    s = fold([heartbeat(), hybrid_state(60_000), position(60_000, 5.0)])
    s = fold([position(500 + 50 * n, 0.0) for n in range(CERTAIN)], s)
    assert s.v_history == ()
    assert s.track == ((0.0, 0.0),)
    assert s.source == (1, 1)
    assert "restarted" in s.messages[-1].text


def test_a_message_that_was_held_up_on_its_way_is_no_restart_and_not_shown():
    s = fold([heartbeat(), position(60_000, 5.0)])
    for late in range(10):
        s = fold([position(1000 + late, 9.0), position(60_000 + late, 5.0)], s)
    assert (s.restarts, s.p[0], s.boot) == (0, 5.0, 60.009)


def test_a_track_is_thinned_not_cut():
    s = fold([position(n, 0.2 * n) for n in range(1, 2 * KEPT_TRACK)])
    assert len(s.track) <= KEPT_TRACK
    assert s.track[0][0] < 1.0
    assert s.track[-1][0] == pytest.approx(0.2 * (2 * KEPT_TRACK - 1), rel=1e-6)


def test_a_long_status_text_is_joined():
    chunks = [mavlink.MAVLink_statustext_message(4, text, 9, n) for n, text in enumerate((b"a" * 50, b"end"))]
    assert fold(chunks).messages[-1].text == "a" * 50 + "end"


def test_a_chunk_that_goes_on_with_nothing_is_a_line_of_its_own_however_often_it_comes():
    s = fold([mavlink.MAVLink_statustext_message(4, b"b" * 50, 9, 7)] * 400, fold([heartbeat()]))
    assert len(s.messages) == KEPT_LINES
    assert {line.text for line in s.messages} == {"b" * 50}


def test_a_text_cannot_command_the_terminal():
    s = fold([mavlink.MAVLink_statustext_message(4, b"\x1b[2Jdone\x07", 0, 0)])
    assert s.messages[-1].text == "?[2Jdone?"


def test_another_component_of_the_vehicle_may_speak_but_not_tell_where_the_vehicle_is():
    s = fold([heartbeat(), position(10, 1.0)])
    for message in (position(20, 99.0), mavlink.MAVLink_statustext_message(4, b"camera ready", 0, 0)):
        s = reduce(s, told(message, Codec(1, 100)), 2.0)
    assert s.p[0] == 1.0
    assert s.messages[-1].text == "camera ready"


def test_jumps_are_counted_once_however_often_they_arrive():
    jump = mavlink.MAVLink_darko_jump_message(1_000_000, 3, 42.0, 2, 1, 1, b"enter_linear")
    s = fold([jump, jump])
    assert [j.name for j in s.jumps] == ["enter_linear"]


def test_thresholds_of_v_are_those_of_both_linear_laws_whichever_flies():
    s = fold([hybrid_state(100, v_forward=7.0), hybrid_state(200, Law.FORWARD_LINEAR, v_forward=7.0)])
    assert (s.hybrid.hover, s.hybrid.forward) == (Thresholds(50.0, 100.0), Thresholds(5.0, 20.0))
    assert s.v_history == (pytest.approx((0.1, 1.0, 7.0)), pytest.approx((0.2, math.nan, 7.0), nan_ok=True))


def test_a_law_that_is_never_left_has_an_infinite_threshold():
    s = fold([hybrid_state(100, v_hover_leave=math.inf)])
    assert s.hybrid.hover == (50.0, math.inf)
    assert "(50/inf)" in drawn(HybridPanel, s)


@pytest.mark.parametrize("law", Law)
def test_the_lyapunov_value_is_that_of_the_law_in_force(law):
    forward = {Law.TO_FORWARD, Law.FORWARD_LINE_OF_SIGHT, Law.FORWARD_LINEAR}
    h = fold([hybrid_state(100, law, v_hover=1.0, v_forward=2.0, v_attitude=3.0)]).hybrid
    assert h.v == (3.0 if law is Law.HOVER_ATTITUDE else 2.0 if law in forward else 1.0)
    assert h.is_forward == (law in forward)


def test_a_law_of_a_newer_vehicle_is_a_number_and_no_law_of_this_one():
    s = fold([hybrid_state(100, 15, last_law=14, last_reason=13)])
    text = drawn(HybridPanel, s)
    assert s.law == "law 15"
    assert math.isnan(s.hybrid.v)
    assert "LAW 15" in text
    assert "from law 14: reason 13" in text


def test_saturated_axes_are_remembered_with_their_time():
    pitch, boost = Saturation.PITCH, Saturation.BOOST
    s = fold([actuators(1000, saturation=pitch), actuators(2000, saturation=boost), actuators(2500)])
    assert s.actuators.saturation == 0
    assert s.saturated_at == {pitch: 1.0, boost: 2.0}


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        (0, "within all limits"),
        (Limit.MOTOR_RIGHT | Limit.ELEVON_LEFT, "at limit: motor R, elevon L"),
        (Limit.MOTOR_LEFT_RATE, "at limit: motor L rate"),
        (1 << 9, "within all limits"),  # of a newer vehicle
    ],
)
def test_limits_are_named(limits, words):
    assert words in drawn(ActuatorPanel, fold([actuators(1000, limits=limits)]))


def drawn(panel, s):
    lines = panel("", id="x").draw(s, 80, 12)
    return "\n".join("".join(text for text, _ in line) for line in lines)


def decision(way=2, reason=1, seq=3, times=(29.2, 12.1), energies=(4983.0, 1757.0)):
    return mavlink.MAVLink_darko_decision_message(
        59_000, 100.0, 10.0, -1.2, 0.5, times[0], energies[0], times[1], energies[1], seq, way, reason
    )


def test_a_decision_says_what_it_saves():
    d = fold([decision()]).decision
    assert (d.seq, d.way, d.reason, d.distance, d.climb) == (3, 2, 1, 100.0, 10.0)
    assert d.saving == pytest.approx(1 - 1757 / 4983)
    hover = fold([decision(way=1, energies=(500.0, 2000.0))]).decision
    assert hover.saving == pytest.approx(0.75)


def test_an_impossible_way_leaves_nothing_to_compare():
    assert math.isnan(fold([decision(times=(29.2, math.inf), way=1)]).decision.saving)
    assert math.isnan(fold([decision(way=0)]).decision.saving)
    assert fold([decision(seq=0xFFFF)]).decision.seq is None


def test_the_air_is_told_twice_and_the_path_once():
    s = fold([
        mavlink.MAVLink_darko_air_message(100, [1.0, 2.0, 0.0], [1.5, 2.5, 0.1], 13.0, 13.5),
        mavlink.MAVLink_nav_controller_output_message(0, 0, 10, 90, 42, 0.25, 0, -1.75),
    ])  # fmt: skip
    assert s.air.wind_estimate == (1.0, 2.0, 0.0)
    assert s.air.wind_true == pytest.approx((1.5, 2.5, 0.1))
    assert (s.air.airspeed_estimate, s.air.airspeed_true) == (13.0, 13.5)
    assert s.navigation == (-1.75, 0.25, 42.0, pytest.approx(math.pi / 2))


def test_a_restart_forgets_the_decision_of_the_old_flight():
    s = fold([heartbeat(), hybrid_state(60_000), decision(), *[position(500, 0.0)] * CERTAIN])
    assert s.decision is None


def test_a_vehicle_without_a_display_offset_is_still_shown_from_its_quaternion():
    s = fold([
        mavlink.MAVLink_attitude_quaternion_message(10, 0.5, 0.5, 0.5, 0.5, 0, 0, 0),
        mavlink.MAVLink_attitude_message(20, 0.0, 0.1, 0.2, 0, 0, 0),
    ])  # fmt: skip
    assert s.q == (0.5, 0.5, 0.5, 0.5)


def test_a_transition_switches_the_view_once_and_at_its_end():
    def state(vtol):
        return mavlink.MAVLink_extended_sys_state_message(vtol, mavlink.MAV_LANDED_STATE_IN_AIR)

    order = ("MC", "TRANSITION_TO_FW", "FW", "TRANSITION_TO_MC", "MC")
    s, seen = EMPTY, []
    for name in order:
        s = fold([state(getattr(mavlink, f"MAV_VTOL_STATE_{name}"))], s)
        seen.append(s.is_forward)
    assert seen == [False, False, True, True, False]


@pytest.mark.parametrize(
    ("autopilot", "kind", "number", "name"),
    [
        (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_FIXED_WING, 19, "QLOITER"),
        (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_QUADROTOR, 16, "POSHOLD"),
        (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_SUBMARINE, 16, "MODE 16"),
        (mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_QUADROTOR, 4 << 16 | 8 << 24, "FOLLOW_TARGET"),
        (mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_QUADROTOR, 3 << 16 | 1 << 24, "POSCTL"),
        (mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_QUADROTOR, 99 << 16, f"MODE {99 << 16}"),
        (mavlink.MAV_AUTOPILOT_GENERIC, mavlink.MAV_TYPE_QUADROTOR, 1, "MODE 1"),
    ],
)
def test_modes_of_other_autopilots_have_their_names(autopilot, kind, number, name):
    assert fold([mavlink.MAVLink_heartbeat_message(kind, autopilot, 1, number, 4, 3)]).mode == name


def test_mode_names_are_those_of_the_field():
    from pymavlink import mavutil

    assert mavutil.mode_mapping_apm == PLANE
    assert mavutil.mode_mapping_acm == COPTER


def test_answers_are_said_in_words():
    s = reduce_event(EMPTY, CommandDone(1, mavlink.MAV_CMD_NAV_TAKEOFF, 1, "TEMPORARILY_REJECTED"), 2.0)
    assert s.messages[-1].text == "nav takeoff: temporarily rejected"
    s = reduce_event(s, MissionFailed("upload", None, "no answer"), 3.0)
    assert s.messages[-1].text == "Mission upload failed: no answer"


def test_loss_and_return_of_the_vehicle_show():
    s = reduce_event(fold([heartbeat()]), VehicleLost(3.0), 4.0)
    assert s.lost
    assert not reduce_event(s, VehicleReturned(5.0), 9.0).lost
    assert not reduce(s, told(heartbeat()), 9.0).lost


def test_the_log_is_bounded():
    s = EMPTY
    for n in range(KEPT_LINES + 20):
        s = note(s, float(n), 6, str(n))
    assert len(s.messages) == KEPT_LINES
    assert s.messages[-1].text == str(KEPT_LINES + 19)


@settings(deadline=None, max_examples=150)
@given(st.sampled_from(sorted(mavlink.mavlink_map)), st.binary(min_size=0, max_size=280))
def test_no_message_of_the_dialect_can_break_the_store(number, payload):
    size = mavlink.mavlink_map[number].unpacker.size
    s = reduce(EMPTY, told(heartbeat()), 0.0)
    frame = _frame(number, payload[:size].ljust(size, b"\0"))
    for decoded in Codec(255, 190).decode(frame):
        reduce(s, decoded, 1.0)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(st.integers(53000, 53005), st.binary(min_size=120, max_size=120)), max_size=6))
def test_no_message_of_the_vehicles_dialect_can_break_a_panel(told_by_the_wire):
    s = fold([heartbeat(), position(10, 1.0)])
    for number, payload in told_by_the_wire:
        size = mavlink.mavlink_map[number].unpacker.size
        for decoded in Codec(255, 190).decode(_frame(number, payload[:size])):
            s = reduce(s, decoded, 1.0)
    for panel in (HybridPanel, ActuatorPanel, AttitudePanel, FlightPanel, DecisionPanel, MapPanel, MessagePanel):
        panel("", id="x").draw(s, 40, 12)
    decision_words(s)


def _frame(number, payload):
    header = bytes((0xFD, len(payload), 0, 0, 0, 1, 1)) + number.to_bytes(3, "little")
    crc = mavlink.x25crc(header[1:] + payload)
    crc.accumulate(bytes((mavlink.mavlink_map[number].crc_extra,)))
    return header + payload + crc.crc.to_bytes(2, "little")


def test_a_recorded_flight_folds_to_its_known_end():
    reader, s = read_tlog(DATA / "square-flight.tlog"), EMPTY
    for row, (time, _) in enumerate(reader.records()):
        message = reader.decode(row)
        if message is not None:
            s = reduce(s, message, time / 1e6)
    assert (s.mode, s.armed, s.landed_state) == ("HOLD", False, mavlink.MAV_LANDED_STATE_ON_GROUND)
    assert s.reached == {0, 1, 2, 3, 4, 5}
    assert [jump.name for jump in s.jumps] == ["take_off", "enter_linear", "touch_down"]
    assert len(s.mission) == 6
    assert s.energy.total == pytest.approx(5513.0, abs=1.0)
    assert math.hypot(s.p[0], s.p[1]) < 0.2
