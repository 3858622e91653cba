"""The cameras' view of the vehicle: its true state, asked for over the link."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from protocol.wire.signing import Keyring
from sitl.mavlink.telemetry.navigation import attitude_on_wire, axes_on_wire
from sitl.model.quaternions import from_euler
from sitl.motion_capture.motive_process import VehicleWatch

Q = from_euler(0.2, -1.4, 0.7)
KEY = bytes(range(32))


def truth(**changed):
    fields = {
        "time_usec": 2_500_000, "position": [1.0, -2.0, -3.0], "velocity": [0.1, -0.2, -0.3],
        "q": list(attitude_on_wire(Q)), "rates": list(axes_on_wire((0.4, 0.5, 0.6))), "wind": [0.0] * 3,
    }  # fmt: skip
    return mavlink.MAVLink_darko_truth_message(**(fields | changed))


def heard(watch, *messages, codec=None, now=1.0):
    codec = codec or Codec(1, 1)
    return [motion for message in messages for motion in watch.receive(codec.encode(message), now)]


def test_the_true_state_comes_into_the_vehicle_s_frames():
    motion = heard(VehicleWatch(Keyring()), truth())[0]
    assert motion.time == 2.5
    assert motion.position == pytest.approx((1.0, 2.0, 3.0))
    assert motion.velocity == pytest.approx((0.1, 0.2, 0.3))
    assert motion.rates == pytest.approx((0.4, 0.5, 0.6))
    assert abs(np.dot(motion.attitude.as_quat(), (Q.x, Q.y, Q.z, Q.w))) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    "changed",
    [
        {"position": [math.nan, 0, 0]},
        {"q": [0.0] * 4},
        {"rates": [0, math.inf, 0]},
        {"velocity": [0, 0, -1e38]},
        {"time_usec": 2**64 - 1},
    ],
)
def test_a_state_that_can_be_of_no_vehicle_is_none(changed):
    assert heard(VehicleWatch(Keyring()), truth(**changed)) == []


def test_another_system_is_not_seen_and_with_a_key_only_signed_states_are():
    assert heard(VehicleWatch(Keyring()), truth(), codec=Codec(2, 1)) == []
    signed = VehicleWatch(Keyring({None: KEY}))
    assert heard(signed, truth()) == []
    assert len(heard(signed, truth(), codec=Codec(1, 1, Keyring({None: KEY}, timestamp=10).link(None)))) == 1


def test_it_asks_each_second_until_states_come_and_again_when_they_stop():
    watch = VehicleWatch(Keyring())
    assert [len(watch.requests(now)) for now in (0.0, 0.5, 1.0)] == [1, 0, 1]
    heard(watch, truth(), now=1.5)
    assert [len(watch.requests(now)) for now in (2.0, 2.4, 2.5)] == [0, 0, 1]
    assert watch.is_seen(3.0)
    assert not watch.is_seen(4.0)


def test_its_clock_goes_on_between_states_but_not_beyond_the_next():
    watch = VehicleWatch(Keyring())
    heard(watch, truth(), now=1.0)
    assert [watch.time(now) for now in (1.0, 1.004, 2.0)] == [2.5, pytest.approx(2.504), pytest.approx(2.51)]


def test_it_keeps_why_the_vehicle_refuses():
    watch = VehicleWatch(Keyring())
    ack = mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_RESULT_DENIED)
    assert heard(watch, ack) == []
    assert watch.refusal == "denied"
