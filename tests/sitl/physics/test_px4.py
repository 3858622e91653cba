import math
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from sitl.defaults import HOME
from sitl.mavlink.telemetry.sensor_messages import standard_atmosphere
from tests.support.foreign_autopilots import HoverPilot, Px4Client, flown_by_px4, link_of

ORIGIN = (HOME.lat_deg, HOME.lon_deg, HOME.alt)


def connected(*words, place=(0.0, 0.0, -5.0)):
    link, told = link_of("px4", *words)
    client = Px4Client(ORIGIN, HoverPilot(place))
    link.opened(0.0)
    link.receive(client.greeting(), None, 0.0)
    return link, client, told


def kinds(client):
    return Counter(message.get_type() for message in client.seen)


def newest(client, kind):
    return [message for message in client.seen if message.get_type() == kind][-1]


@pytest.mark.long
def test_a_minute_of_hover_through_repeated_outputs_silence_and_a_new_connection():
    link, client, told = connected("--start", "0,0,5,0", "--wind", "1@300", "--gusts", "0.3")
    assert flown_by_px4(link, client, 10.0) < 0.8
    for _ in range(10):
        link.receive(client.outputs(client.time_usec, [0.5, 0.5, *[0.0] * 14]), None, 10.0)
        assert flown_by_px4(link, client, 0.4, now=link.rig.vehicle.time) < 0.8
    assert flown_by_px4(link, client, 10.0, now=5000.0) < 0.8  # after a long silence
    link.closed(5010.0)
    assert link.wants(5011.0) == 0
    link.opened(5012.0)
    second = Px4Client(ORIGIN)
    link.receive(second.greeting(), None, 5012.0)
    assert flown_by_px4(link, second, 36.0, now=5012.0) < 0.8
    assert link.rig.vehicle.crash is None
    assert link.journal.counts["restarts"] == 1
    assert link.journal.counts["closed connections"] == 1
    assert link.journal.counts["repeated outputs"] == 10
    assert sum("in lockstep" in line for line in told) == 2


@pytest.mark.long
def test_by_motion_capture_it_hovers_under_the_net():
    link, client, _ = connected("--start", "0,0,3,0", "--arena", "voliere", place=(0.0, 0.0, -3.0))
    assert flown_by_px4(link, client, 20.0) < 0.3
    assert kinds(client)["HIL_GPS"] == 0
    assert kinds(client)["ODOMETRY"] > 3500


def test_standing_it_tells_each_sensor_in_its_units_at_its_rate():
    link, client, _ = connected("--nav", "both")
    client._armed_after = math.inf
    flown_by_px4(link, client, 1.0)
    sensor, fix, pose = (newest(client, kind) for kind in ("HIL_SENSOR", "HIL_GPS", "ODOMETRY"))
    assert (sensor.xacc, sensor.yacc) == pytest.approx((0.0, 0.0), abs=0.6)
    assert sensor.zacc == pytest.approx(-9.81, abs=0.6)  # the hover frame: level on the tail
    assert math.hypot(sensor.xmag, sensor.ymag, sensor.zmag) == pytest.approx(0.46, abs=0.05)
    assert sensor.zmag > 0.3
    assert sensor.abs_pressure == pytest.approx(995.4, abs=0.3)
    assert sensor.pressure_alt == pytest.approx(150.0, abs=3.0)
    assert sensor.diff_pressure == 0.0
    assert (fix.lat, fix.lon) == pytest.approx((435648000, 14811000), abs=100)
    assert fix.alt == pytest.approx(150108, abs=3000)
    assert (fix.cog, fix.fix_type) == (65535, 3)
    assert pose.estimator_type == mavlink.MAV_ESTIMATOR_TYPE_VISION
    assert pose.q == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=0.03)
    assert math.isnan(pose.vx)
    assert kinds(client)["HIL_SENSOR"] == pytest.approx(250, abs=2)
    assert kinds(client)["HIL_STATE_QUATERNION"] == pytest.approx(125, abs=3)
    bits = Counter(bit for m in client.seen if m.get_type() == "HIL_SENSOR" for bit in _bits(m.fields_updated))
    assert bits[0] == bits[5] == pytest.approx(250, abs=2)
    assert bits[6] == bits[9] == bits[10] == bits[12] == pytest.approx(50, abs=2)
    assert bits[11] == bits[12]


def _bits(number):
    return [bit for bit in range(32) if number >> bit & 1]


def test_before_it_answers_it_gets_its_sensors_by_the_clock():
    link, _, _ = connected()
    assert link.wants(0.0) == 2
    link.step(0.0)
    assert link.wants(0.003) == 0
    assert link.wakes() == pytest.approx(0.004)
    assert link.wants(0.0041) == 2


def test_in_lockstep_one_step_follows_each_answer_and_a_silence_one_step():
    link, client, told = connected()
    ((data, _),) = link.step(0.0)
    link.receive(client.take(data), None, 0.0)
    assert link.wants(0.0) == 2
    ((data, _),) = link.step(0.0)
    assert link.wants(0.9) == 0
    assert link.wants(1.1) == 2  # whoever lost a message goes on
    ((data, _),) = link.step(1.1)
    assert "no outputs for 1 s" in told[-1]
    assert link.wants(1.2) == 0
    link.receive(client.take(data), None, 1.2)
    assert link.wants(1.2) == 2


def test_without_lockstep_it_goes_by_the_clock():
    link, client, _ = connected()
    link.step(0.0)
    link.receive(client.outputs(4000, [0.0] * 16, mode=1, flags=0), None, 0.0)
    assert link.wants(0.001) == 0
    assert link.wants(0.005) == 2


def test_outputs_count_only_while_it_is_armed():
    link, client, _ = connected("--start", "0,0,9,0")
    for time_usec, mode, turns in ((1, 1, False), (2, 129, True), (3, 1, False)):
        link.receive(client.outputs(time_usec, [0.5, 0.5, *[0.0] * 14], mode), None, 0.0)
        link.step(0.0)
        assert link.rig.vehicle.armed == turns


def test_time_that_runs_backwards_and_outputs_that_are_no_numbers_are_counted_and_flown_on():
    link, client, told = connected("--start", "0,0,9,0")
    link.receive(client.outputs(9000, [0.5, 0.5, *[0.0] * 14]), None, 0.0)
    link.receive(client.outputs(4000, [0.5, 0.5, *[0.0] * 14]), None, 0.0)
    link.receive(client.outputs(9001, [math.nan] * 16), None, 0.0)
    assert link.wants(0.0) == 2
    link.step(0.0)
    assert link.rig.vehicle.truth.actuators.left_motor > 100.0  # the commands before
    assert link.journal.counts == {"backward times": 1, "bad outputs": 1}
    assert "PX4's time runs backwards" in " ".join(told)


def test_bytes_that_are_no_frames_are_counted_and_the_next_frame_is_heard():
    link, client, told = connected()
    link.receive(b"GET / HTTP/1.0\r\n\r\n", None, 0.0)
    damaged = bytearray(client.outputs(4000, [0.0] * 16))
    damaged[20] ^= 0xFF
    link.receive(bytes(damaged), None, 0.0)
    whole = client.outputs(5000, [0.0] * 16)
    link.receive(whole[:10], None, 0.0)
    link.receive(whole[10:], None, 0.0)
    assert link.journal.counts == {"bad packets": 2}
    assert "in lockstep" in told[-1]


@given(st.lists(st.binary(max_size=60), max_size=8))
def test_no_bytes_raise_an_error(chunks):
    link = _LINK[0] if _LINK else _LINK.append(connected()[0]) or _LINK[0]
    for chunk in chunks:
        assert link.receive(chunk, None, 0.0) == []


_LINK = []


def test_a_truth_that_is_not_asked_for_is_not_sent():
    link, _ = link_of("px4")
    client = Px4Client(ORIGIN)
    link.opened(0.0)
    flown_by_px4(link, client, 0.1)
    assert kinds(client)["HIL_STATE_QUATERNION"] == 0


@pytest.mark.parametrize(("altitude", "pressure", "temperature"), [(0, 1013.25, 15.0), (1000, 898.75, 8.5)])
def test_the_atmosphere_is_the_standard_one(altitude, pressure, temperature):
    assert standard_atmosphere(altitude) == pytest.approx((pressure, temperature), abs=0.05)
