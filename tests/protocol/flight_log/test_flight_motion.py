"""The 3-D view of a page is given the log's own places, attitudes, thrusts and elevons."""

import json
from dataclasses import replace

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.flight_log.flight_motion import MAX_SAMPLES, flight_motion
from protocol.flight_log.flight_series import NOTHING, FlightEvent, Prism, Series, flight_series
from protocol.frames import flying_attitude, hover_attitude, quaternion_from_euler, rotate
from protocol.tlog import TlogReader, read_tlog
from tests.support.logs import bare
from tests.support.paths import DATA

NOSE, RIGHT = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
NOSE_UP = quaternion_from_euler(0.0, np.pi / 2, 0.0)
HOVER_TOLD = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def flown():
    return flight_series(read_tlog(DATA / "square-flight.tlog"), "square")


@pytest.fixture(scope="module")
def motion(flown):
    return flight_motion(flown, (), [("hover", "#123456")] * len(flown.position))


def rows(values, size):
    return np.array(values, float).reshape(-1, size)


def times(motion):
    return motion["start"] + motion["step"] * np.arange(len(motion["position"]) // 3)


def recorded(*messages):
    """A log of a vehicle's messages, 10 ms apart."""
    return TlogReader(b"".join((10**6 + k * 10**4).to_bytes(8, "big") + bare(m) for k, m in enumerate(messages)))


def beat(kind=mavlink.MAV_TYPE_VTOL_DUOROTOR, autopilot=mavlink.MAV_AUTOPILOT_PX4):
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 4, 3)


def told_attitude(*messages, **vehicle):
    return flight_series(recorded(beat(**vehicle), *messages), "x").attitude.fields["q"]


def test_places_are_the_logs_own_at_their_times(flown, motion):
    for axis, drawn in zip("xyz", rows(motion["position"], 3).T, strict=True):
        logged = np.interp(times(motion), flown.position.times, flown.position.fields[axis])
        assert drawn == pytest.approx(logged, abs=6e-4)
    assert times(motion)[[0, -1]] == pytest.approx(flown.position.times[[0, -1]])


def test_nose_and_right_wing_point_where_the_log_tells(flown, motion):
    drawn, told = rows(motion["attitude"], 4), read_tlog(DATA / "square-flight.tlog").columns("ATTITUDE_QUATERNION")
    assert np.linalg.norm(drawn, axis=1) == pytest.approx(np.ones(len(drawn)), abs=2e-3)
    for k in range(0, len(drawn), len(drawn) // 20):
        nearest = int(np.abs(flown.attitude.times - times(motion)[k]).argmin())
        q = [float(told[f"q{part}"][nearest]) for part in range(1, 5)]
        assert rotate(drawn[k], NOSE) == pytest.approx(rotate(q, NOSE), abs=0.05)
        assert rotate(drawn[k], RIGHT) == pytest.approx(rotate(q, RIGHT), abs=0.05)
        assert rotate(drawn[k], NOSE)[2] < -0.8  # up, while it hovers


def test_thrusts_and_elevons_are_the_logs_own_left_and_right_positive_nose_up(flown, motion):
    for name in ("thrust", "elevon"):
        logged = flown.actuators.fields[name]
        for side in (0, 1):
            expected = np.interp(times(motion), flown.actuators.times, logged[:, side])
            assert rows(motion[name], 2)[:, side] == pytest.approx(expected, abs=6e-4)


def test_a_tail_sitter_tells_the_hover_frame_and_others_the_nose():
    message = mavlink.MAVLink_attitude_quaternion_message(5, *HOVER_TOLD, 0.0, 0.0, 0.0)
    assert rotate(told_attitude(message)[0], NOSE) == pytest.approx((0.0, 0.0, -1.0))
    assert rotate(told_attitude(message, kind=mavlink.MAV_TYPE_FIXED_WING)[0], NOSE) == pytest.approx(NOSE)
    ardupilot = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    assert rotate(told_attitude(message, autopilot=ardupilot)[0], NOSE) == pytest.approx(NOSE)


def test_a_log_that_has_the_nose_shown_pitched_down_tells_the_nose():
    half = np.sqrt(0.5)
    message = mavlink.MAVLink_attitude_quaternion_message(5, *NOSE_UP, 0.0, 0.0, 0.0, [half, 0.0, -half, 0.0])
    assert rotate(told_attitude(message)[0], NOSE) == pytest.approx((0.0, 0.0, -1.0), abs=1e-6)


def test_without_quaternions_the_angles_are_taken():
    angles = mavlink.MAVLink_attitude_message(5, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
    assert told_attitude(angles)[0] == pytest.approx(flying_attitude(quaternion_from_euler(0.1, 0.2, 0.3)), abs=1e-6)
    assert told_attitude(angles, kind=mavlink.MAV_TYPE_QUADROTOR)[0] == pytest.approx(
        quaternion_from_euler(0.1, 0.2, 0.3), abs=1e-6
    )


def test_home_and_the_last_missions_items_have_their_places():
    lat, lon = 435_648_000, 14_811_000
    home = mavlink.MAVLink_home_position_message(lat, lon, 150_000, 3.0, 0.0, -1.0, [1, 0, 0, 0], 0, 0, 0)

    def item(seq, frame, x, y, z):
        return mavlink.MAVLink_mission_item_int_message(1, 1, seq, frame, 16, 0, 1, 0, 0, 0, 0, x, y, z, 0)

    relative, absolute = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, mavlink.MAV_FRAME_GLOBAL
    place = mavlink.MAVLink_local_position_ned_message(5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    old, plan = [item(k, relative, lat, lon, 9.0) for k in range(3)], [
        item(0, relative, lat + 1000, lon, 12.0), item(1, absolute, lat, lon, 170.0), item(2, relative, 0, 0, 5.0),
    ]  # fmt: skip
    flight = flight_series(recorded(beat(), place, home, *old, *plan), "x")
    assert flight.home == pytest.approx((3.0, 0.0, -1.0))
    (first, ahead), (second, above) = flight.waypoints
    assert (first, second) == (0, 1)
    assert ahead == pytest.approx((3.0 + 11.11, 0.0, -13.0), abs=0.01)
    assert above == pytest.approx((3.0, 0.0, -21.0))


def test_between_two_quaternions_of_opposite_sign_the_attitude_stays(flown):
    q = np.array([NOSE_UP, tuple(-x for x in NOSE_UP)])
    flight = replace(
        flown,
        position=Series(np.array([0.0, 1.0]), dict.fromkeys("xyz", np.zeros(2))),
        attitude=Series(np.array([0.0, 1.0]), {"q": q}),
    )
    for drawn in rows(flight_motion(flight, (), [("", "")] * 2)["attitude"], 4):
        assert rotate(drawn, NOSE) == pytest.approx((0.0, 0.0, -1.0), abs=1e-3)
    assert hover_attitude(NOSE_UP) == pytest.approx(HOVER_TOLD)


def test_what_was_not_recorded_is_none_and_a_long_flight_has_fewer_samples(flown):
    at = np.concatenate((np.arange(0.0, 10.0, 0.1), np.arange(30.0, 3000.0, 0.1)))
    flight = replace(
        flown, position=Series(at, dict.fromkeys("xyz", at)), attitude=NOTHING, actuators=NOTHING, air=NOTHING,
        truth=NOTHING, target=NOTHING, events=(FlightEvent(1.0, "jump", "a to b", "b"), FlightEvent(2.0, "text", "x")),
    )  # fmt: skip
    room = Prism("room", ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0)), 0.0, 2.0, hollow=True)
    colours = [("hover", "#111111")] * 50 + [("forward", "#222222")] * (len(at) - 50)
    motion = flight_motion(flight, [room], colours)
    assert len(motion["position"]) == 3 * (MAX_SAMPLES + 1)
    unknown = [k for k, place in enumerate(motion["position"][::3]) if place is None]
    assert times(motion)[unknown].min() > 9.0
    assert times(motion)[unknown].max() < 31.0
    assert set(motion["attitude"]) == {None}
    assert (motion["thrust"], motion["elevon"], motion["truth"]) == ([], [], [])
    assert motion["laws"] == [[0.0, "hover", "#111111"], [5.0, "forward", "#222222"]]
    assert motion["marks"] == [[1.0, "b", "a to b", "jump"]]
    assert motion["scenery"][0]["hollow"]
    assert json.loads(json.dumps(motion, allow_nan=False)) is not None
    assert flight_motion(replace(flight, position=NOTHING), (), []) is None


@pytest.mark.parametrize("odd", [np.nan, np.inf, -np.inf, 3.4e38])
def test_a_log_may_hold_any_numbers(odd):
    messages = [beat(), mavlink.MAVLink_home_position_message(0, 2**31 - 1, 0, odd, odd, odd, [odd] * 4, 0, 0, 0)]
    for k in range(3):
        messages += [
            mavlink.MAVLink_local_position_ned_message(100 * k, odd if k == 1 else 0.0, 0.0, odd, 0.0, 0.0, 0.0),
            mavlink.MAVLink_attitude_message(100 * k, odd, 0.0, odd, 0.0, 0.0, 0.0),
        ]
    quaternions = [
        mavlink.MAVLink_attitude_quaternion_message(100 * k, odd, 0.0, odd, 1.0, 0.0, 0.0, 0.0, [odd] * 4)
        for k in range(3)
    ]
    for log in (messages, [*messages, *quaternions]):
        flight = flight_series(recorded(*log), "x")
        motion = flight_motion(flight, (), [("", "")] * len(flight.position))
        assert json.loads(json.dumps(motion, allow_nan=False))["waypoints"] == []
