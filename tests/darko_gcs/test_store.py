"""Folding messages into the snapshot."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from darko_gcs.snapshot import EMPTY
from darko_gcs.store import KEPT_LINES, KEPT_TRACK, KEPT_V, note, reduce, reduce_event
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.events import CommandDone, MissionFailed, VehicleLost, VehicleReturned
from protocol.tlog import read_tlog
from tests.support.paths import DATA

VEHICLE, OTHER = Codec(1, 1), Codec(7, 1)


def told(message, codec=VEHICLE):
    """A message as it arrives."""
    return Codec(255, 190).decode(codec.encode(message))[0]


def heartbeat(armed=False, mode=4 << 16 | 3 << 24):
    base = 1 | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
    return mavlink.MAVLink_heartbeat_message(19, mavlink.MAV_AUTOPILOT_PX4, base, mode, 4, 3)


def hybrid(ms, v=1.0, law=1):
    return mavlink.MAVLink_darko_hybrid_state_message(ms, 2, v, math.nan, 50, 100, 0, law, 2, 1)


def position(ms, x, y=0.0):
    return mavlink.MAVLink_local_position_ned_message(ms, x, y, -3, 0, 0, 0)


def fold(messages, s=EMPTY):
    for message in messages:
        s = reduce(s, told(message), 1.0)
    return s


def test_a_heartbeat_names_the_vehicle_its_mode_and_arming():
    s = fold([heartbeat(armed=True)])
    assert (s.source, s.mode, s.armed, s.heartbeat_at) == ((1, 1), "HOLD", True, 1.0)


def test_a_second_vehicle_is_not_mixed_in():
    s = fold([heartbeat(), position(10, 1.0)])
    after = reduce(s, told(position(20, 99.0), OTHER), 2.0)
    assert after.p == s.p
    assert reduce(s, told(heartbeat(armed=True), OTHER), 2.0).armed is False


def test_v_is_kept_by_the_vehicles_time_and_bounded():
    s = fold([hybrid(100 * n, v=float(n)) for n in range(KEPT_V + 50)])
    assert len(s.v_history) == KEPT_V
    assert s.v_history[-1] == pytest.approx(((KEPT_V + 49) / 10, KEPT_V + 49))
    assert fold([hybrid(1)], s) is not s


def test_the_time_of_a_law_begins_when_it_changes():
    s = fold([hybrid(1000, law=2), hybrid(2000, law=1), hybrid(5000, law=1)])
    assert s.law == "hover linear"
    assert s.law_since == 2.0


def test_a_restart_of_the_vehicle_clears_what_belonged_to_the_old_flight():
    s = fold([heartbeat(), hybrid(60_000), position(60_000, 5.0)])
    s = fold([position(500, 0.0)], s)
    assert s.v_history == ()
    assert s.track == ((0.0, 0.0),)
    assert "restarted" in s.messages[-1].text


def test_a_track_is_thinned_not_cut():
    s = fold([position(n, 0.2 * n) for n in range(1, 2 * KEPT_TRACK)])
    assert len(s.track) <= KEPT_TRACK
    assert s.track[0][0] < 1.0
    assert s.track[-1][0] == pytest.approx(0.2 * (2 * KEPT_TRACK - 1), rel=1e-6)


def test_a_long_status_text_is_joined():
    chunks = [mavlink.MAVLink_statustext_message(4, text, 9, n) for n, text in enumerate((b"a" * 50, b"end"))]
    assert fold(chunks).messages[-1].text == "a" * 50 + "end"


def test_jumps_are_counted_once_however_often_they_arrive():
    jump = mavlink.MAVLink_darko_jump_message(1_000_000, 3, 42.0, 2, 1, 1, b"enter_linear")
    s = fold([jump, jump])
    assert [j.name for j in s.jumps] == ["enter_linear"]


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
