"""Standard messages folded into the snapshot."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from darko_gcs.state.reduce import LATE_MESSAGES, MAX_TRACK_POINTS, RESTART_MESSAGES, reduce, restart_messages
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.dialect import mavlink
from protocol.tlog import read_tlog
from protocol.wire.codec import Codec
from tests.support.gcs.home import UNKNOWN_PLACE, home_position, snapshot_after
from tests.support.gcs.messages import OTHER_VEHICLE, arrived, decision, heartbeat, position, vtol_state
from tests.support.links.flood import framed
from tests.support.paths import DATA
from tests.support.vehicle.darko_messages import hybrid_state


def after(messages, s=EMPTY_SNAPSHOT):
    for message in messages:
        s = reduce(s, arrived(message), 1.0)
    return s


def test_a_heartbeat_gives_vehicle_mode_and_arming():
    s = after([heartbeat(armed=True)])
    assert (s.identity.source, s.status.mode, s.status.armed, s.link.heartbeat_at) == ((1, 1), "HOLD", True, 1.0)


def test_an_unknown_mode_is_shown_by_its_number():
    assert after([heartbeat(mode=99 << 16)]).status.mode == f"MODE {99 << 16}"


def test_only_critical_and_emergency_states_are_critical():
    critical = [state for state in range(3, 7) if after([heartbeat(state=state)]).status.critical]
    assert critical == [mavlink.MAV_STATE_CRITICAL, mavlink.MAV_STATE_EMERGENCY]


def test_a_second_vehicle_is_not_mixed_in():
    s = after([heartbeat(), position(10, 1.0)])
    assert reduce(s, arrived(position(20, 99.0), OTHER_VEHICLE), 2.0).position.p == s.position.p
    assert reduce(s, arrived(heartbeat(armed=True), OTHER_VEHICLE), 2.0).status.armed is False


def test_a_restart_of_the_vehicle_clears_what_belongs_to_the_old_flight():
    s = after([heartbeat(), hybrid_state(60_000), decision(), position(60_000, 5.0)])
    s = after([position(500 + 50 * n, 0.0) for n in range(RESTART_MESSAGES)], s)
    assert s.hybrid.v_history == ()
    assert s.guidance.decision is None
    assert s.position.track == ((0.0, 0.0),)
    assert s.identity.source == (1, 1)
    assert "restarted" in s.log.lines[-1].text


def test_a_late_message_is_no_restart_and_not_shown():
    s = after([heartbeat(), position(60_000, 5.0)])
    for late in range(10):
        s = after([position(1000 + late, 9.0), position(60_000 + late, 5.0)], s)
    assert (s.link.restarts, s.position.p[0], s.link.boot) == (0, 5.0, 60.009)


def test_a_group_of_late_messages_is_no_restart_but_a_step_back_that_stays_is():
    s = after([heartbeat(), position(600_000, 5.0)])
    s = after([position(598_000 + 10 * n, 9.0) for n in range(LATE_MESSAGES - 1)], s)
    assert (s.link.restarts, s.position.p[0], s.link.boot) == (0, 5.0, 600.0)
    s = after([position(600_100, 6.0)], s)
    assert (s.link.restarts, s.position.p[0], s.link.late_messages) == (0, 6.0, 0)
    s = after([position(590_000 + 10 * n, 9.0) for n in range(LATE_MESSAGES)], s)
    assert (s.link.restarts, s.position.p[0]) == (1, 9.0)


@pytest.mark.parametrize(
    ("boot", "newest", "needed"), [(569.9, 600.0, 3), (570.1, 600.0, 60), (4.9, 10.0, 3), (5.1, 10.0, 60)]
)
def test_how_far_a_step_back_goes_tells_how_soon_it_is_a_restart(boot, newest, needed):
    assert restart_messages(boot, newest) == needed


def test_a_long_track_is_thinned_not_cut():
    s = after([position(n, 0.2 * n) for n in range(1, 2 * MAX_TRACK_POINTS)])
    assert len(s.position.track) <= MAX_TRACK_POINTS
    assert s.position.track[0][0] < 1.0
    assert s.position.track[-1][0] == pytest.approx(0.2 * (2 * MAX_TRACK_POINTS - 1), rel=1e-6)


def test_a_home_without_local_coordinates_is_at_the_local_origin():
    s = snapshot_after(position(1000, 8.0), home_position(0.0, 0.0, 0.0, local=UNKNOWN_PLACE))
    assert s.position.home is not None
    assert s.position.from_home == (8.0, 0.0, -3.0)


def test_a_vehicle_without_a_display_offset_is_still_shown_from_its_quaternion():
    s = after([
        mavlink.MAVLink_attitude_quaternion_message(
            time_boot_ms=10, q1=0.5, q2=0.5, q3=0.5, q4=0.5, rollspeed=0, pitchspeed=0, yawspeed=0
        ),
        mavlink.MAVLink_attitude_message(
            time_boot_ms=20, roll=0.0, pitch=0.1, yaw=0.2, rollspeed=0, pitchspeed=0, yawspeed=0
        ),
    ])  # fmt: skip
    assert s.attitude.q == (0.5, 0.5, 0.5, 0.5)


def test_a_transition_switches_the_view_once_and_at_its_end():
    s, seen = EMPTY_SNAPSHOT, []
    for name in ("MC", "TRANSITION_TO_FW", "FW", "TRANSITION_TO_MC", "MC"):
        s = after([vtol_state(getattr(mavlink, f"MAV_VTOL_STATE_{name}"))], s)
        seen.append(s.status.is_forward)
    assert seen == [False, False, True, True, False]


def test_parameters_of_an_autopilot_that_casts_are_read_as_floats():
    value = mavlink.MAVLink_param_value_message(
        param_id=b"RTL_ALT", param_value=1500.0, param_type=mavlink.MAV_PARAM_TYPE_INT32, param_count=900, param_index=3
    )
    s = after([heartbeat(autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA), value])
    assert s.parameters.values == {"RTL_ALT": 1500.0}


@settings(deadline=None, max_examples=150)
@given(st.sampled_from(sorted(mavlink.mavlink_map)), st.binary(min_size=0, max_size=280))
def test_any_bits_in_any_message_of_the_dialect_are_folded_without_an_error(number, payload):
    kind = mavlink.mavlink_map[number]
    size = kind.unpacker.size
    s = after([heartbeat()])
    for decoded in Codec(255, 190).decode(framed(kind, payload[:size].ljust(size, b"\0"), 0, (1, 1))):
        reduce(s, decoded, 1.0)


def test_a_recorded_flight_ends_in_its_known_state():
    reader, s = read_tlog(DATA / "square-flight.tlog"), EMPTY_SNAPSHOT
    for row, (time, _) in enumerate(reader.records()):
        message = reader.decode(row)
        if message is not None:
            s = reduce(s, message, time / 1e6)
    assert (s.status.mode, s.status.armed, s.status.landed_state) == ("HOLD", False, mavlink.MAV_LANDED_STATE_ON_GROUND)
    assert s.mission.reached == {0, 1, 2, 3, 4, 5}
    assert [jump.name for jump in s.hybrid.jumps] == ["take_off", "enter_linear", "touch_down"]
    assert len(s.plans.mission) == 6
    assert s.battery.energy.total == pytest.approx(5513.0, abs=1.0)
    assert math.hypot(s.position.p[0], s.position.p[1]) < 0.2


def test_a_snapshot_tells_how_long_messages_have_been_silent():
    s = EMPTY_SNAPSHOT
    assert s.link.silence(9.0, ["LOCAL_POSITION_NED"]) is None
    s = reduce(reduce(s, arrived(heartbeat()), 1.0), arrived(position(1000, 1.0)), 2.0)
    assert s.link.silence(9.0, ["VFR_HUD", "LOCAL_POSITION_NED"]) == 7.0
    assert reduce(s, arrived(position(1100, math.nan)), 5.0).link.silence(9.0, ["LOCAL_POSITION_NED"]) == 7.0


def test_the_end_of_a_mission_is_told_once():
    def state(number):
        return mavlink.MAVLink_mission_current_message(3, 4, number)

    active, done = state(mavlink.MISSION_STATE_ACTIVE), state(mavlink.MISSION_STATE_COMPLETE)
    assert [line.text for line in after([heartbeat(), active, done, done]).log.lines] == ["Mission done"]
    assert after([heartbeat(), done]).log.lines == ()


def home_at(x, y, z):
    numbers = (0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0])
    return mavlink.MAVLink_home_position_message(435647709, 14811528, 165000, x, y, z, numbers[3], *numbers[:3])


def test_a_home_that_was_moved_before_is_told_once_with_what_heights_are_from():
    lines = after([heartbeat(), home_at(-3.24, 4.27, -15.03), home_at(-3.24, 4.27, -15.03)]).log.lines
    (line,) = [line.text for line in lines]
    assert line.startswith("Home is -3.2 m north, 4.3 m east, 15.0 m up of the vehicle's origin")
    assert "heights are from there" in line
    assert after([heartbeat(), home_at(0.0, 0.3, 0.0)]).log.lines == ()
    moved_now = after([heartbeat(), home_at(0.0, 0.0, 0.0), home_at(9.0, 0.0, 0.0)])
    assert moved_now.log.lines == ()  # the vehicle itself tells of a move
