import json
import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.physics.ardupilot import DEAD_TIME, ArduPilotLink, read_frame
from tests.support.foreign_autopilots import ArduPilotClient, flown_by_ardupilot, link_of

PEER, OTHER = ("127.0.0.1", 40000), ("127.0.0.1", 40001)


def frame(number, *, magic=18458, rate=500, pulses=(1500, 1500, 1000, 1000)):
    count = 16 if magic == 18458 else 32
    return struct.pack(f"<HHI{count}H", magic, rate, number, *pulses, *[0] * (count - len(pulses)))


def answer(link, data, peer=PEER, now=0.0):
    """The answer to a frame, and how far it was flown for it."""
    at_once = link.receive(data, peer, now)
    periods = link.wants(now)
    ((line, to),) = at_once or link.step(now)
    assert to == peer
    return json.loads(line), periods


@pytest.mark.long
@pytest.mark.parametrize("outputs", [16, 32])
def test_both_forms_of_frames_hold_the_hover(outputs):
    link, _ = link_of("ardupilot", "--start", "0,0,5,0")
    flown_by_ardupilot(link, client := ArduPilotClient(outputs=outputs), 3.0)
    assert math.dist(client.position, (0.0, 0.0, -5.0)) < 0.5
    assert link.rig.vehicle.crash is None


@pytest.mark.long
def test_a_minute_of_hover_through_repeated_lost_and_bad_frames_silence_and_a_restart():
    link, told = link_of("ardupilot", "--start", "0,0,5,0", "--wind", "1@300", "--gusts", "0.3")
    first = ArduPilotClient()
    assert flown_by_ardupilot(link, first, 10.0) < 0.8
    for _ in range(20):  # an answer was lost: the same frame again, answered with the same line
        before = link.rig.vehicle.periods
        ((again, _),) = link.receive(struct.pack("<HHI16H", 18458, 500, first.number - 1, *[0] * 16), PEER, 10.0)
        assert json.loads(again)["timestamp"] == first.time
        assert link.rig.vehicle.periods == before
        first.number += 3  # frames that never arrived
        link.receive(b"nonsense", PEER, 10.0)
        flown_by_ardupilot(link, first, 0.1)
    assert flown_by_ardupilot(link, first, 10.0, now=5000.0) < 0.8  # after a long silence
    second = ArduPilotClient(rate=400)
    assert flown_by_ardupilot(link, second, 38.0, now=5100.0, peer=OTHER) < 0.8
    assert second.time == pytest.approx(38.0, abs=0.003)
    assert dict(link.journal.counts) == {"repeated frames": 20, "lost frames": 60, "bad packets": 20, "restarts": 1}
    assert link.rig.vehicle.crash is None
    assert sum("put back to its start" in line for line in told) == 1


def test_at_its_start_it_stands_on_its_tail():
    state, _ = answer(link_of("ardupilot")[0], frame(0))
    assert state["imu"]["accel_body"] == pytest.approx((9.81, 0.0, 0.0), abs=0.6)
    assert state["quaternion"] == pytest.approx((math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0), abs=1e-3)
    assert state["position"] == pytest.approx((0.0, 0.0, -0.108), abs=0.01)
    assert state["battery"]["voltage"] > 11.0


def test_the_line_is_what_ardupilots_reader_of_text_can_read():
    link, _ = link_of("ardupilot")
    link.receive(frame(0), PEER, 0.0)
    ((line, _),) = link.step(0.0)
    assert line.startswith(b"\n{")
    assert line.endswith(b"}\n")
    assert line.count(b"\n") == 2
    assert b" " not in line
    assert line.index(b'"velocity"') < line.index(b'"velocity_wind"')
    for key in (b'"timestamp":', b'"gyro":[', b'"accel_body":[', b'"position":[', b'"quaternion":[', b'"airspeed":'):
        assert line.count(key) == 1


@pytest.mark.parametrize(("rate", "periods"), [(500, [1] * 8), (250, [2] * 8), (400, [1, 1, 1, 2] * 2), (50, [10] * 8)])
def test_a_frame_flies_as_far_as_its_rate_says(rate, periods):
    link, _ = link_of("ardupilot")
    assert [answer(link, frame(number, rate=rate))[1] for number in range(8)] == periods


@pytest.mark.parametrize("rate", [0, 1200])
def test_a_rate_that_the_plant_has_not_flies_one_period(rate):
    link, told = link_of("ardupilot")
    assert [answer(link, frame(number, rate=rate))[1] for number in range(3)] == [1, 1, 1]
    assert sum("SIM_RATE_HZ" in line for line in told) == 1


def test_the_slowest_rate_flies_less_than_a_tenth_of_a_second():
    assert answer(link_of("ardupilot")[0], frame(0, rate=1))[1] == 49


def test_a_restart_puts_the_vehicle_back_and_its_time_to_zero_or_keeps_it():
    for words, north in ((("--on-restart", "reset"), 0.0), (("--on-restart", "keep"), 3.0)):
        link, told = link_of("ardupilot", *words)
        for number in range(5):
            answer(link, frame(number))
        body = link.rig.vehicle.truth.body
        link.rig.vehicle.place(body._replace(position=body.position._replace(x=3.0)))
        state, _ = answer(link, frame(0), OTHER)
        assert state["position"][0] == pytest.approx(north, abs=0.01)
        assert state["timestamp"] == 0.002
        assert "ArduPilot began anew (frame 0 after 4)" in " ".join(told)


def test_a_frame_that_comes_late_is_ignored_and_one_that_falls_far_is_a_restart():
    link, _ = link_of("ardupilot")
    answer(link, frame(1000))
    assert link.receive(frame(998), PEER, 0.0) == []
    assert link.wants(0.0) == 0
    answer(link, frame(7))
    assert link.journal.counts == {"late frames": 1, "restarts": 1}


def test_a_second_autopilot_is_ignored_until_the_first_is_silent():
    link, told = link_of("ardupilot")
    answer(link, frame(10), PEER, 1.0)
    assert link.receive(frame(11), OTHER, 2.0) == []
    assert link.wants(2.0) == 0
    answer(link, frame(11), OTHER, 4.0)
    assert link.journal.counts == {"foreign frames": 1}
    assert "a second autopilot at 127.0.0.1:40001" in " ".join(told)


def test_an_autopilot_that_dies_is_told_once_and_a_pause_of_ours_is_no_death():
    link, told = link_of("ardupilot")
    assert link.poll(100.0) == []  # nobody was there
    link.receive(frame(0), PEER, 100.0)
    link.poll(101.0 + DEAD_TIME)  # paused: it waits for our answer
    link.step(102.0 + DEAD_TIME)
    link.poll(101.0 + 2 * DEAD_TIME)
    assert link.journal.counts == {}
    for _ in range(3):
        assert link.poll(103.0 + 2 * DEAD_TIME) == []
    assert link.journal.counts == {"silences": 1}
    assert "no frames for 12 s: the vehicle waits at 0.0 s" in told[-1]
    answer(link, frame(1), PEER, 104.0 + 2 * DEAD_TIME)
    link.poll(105.0 + 3 * DEAD_TIME)
    assert link.journal.counts == {"silences": 2}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "a packet of 0 bytes"),
        (b"\x1a", "a packet of 1 bytes"),
        (frame(0)[:-1], "of magic 18458 it has 40"),
        (frame(0) + b"\0", "of magic 18458 it has 40"),
        (frame(0, magic=29569)[:40], "of magic 29569 it has 72"),
        (b"\1\0" + frame(0)[2:], "magic 1, which is neither 18458 nor 29569"),
    ],
)
def test_a_bad_packet_is_counted_and_said_in_one_line(data, words):
    link, told = link_of("ardupilot")
    for _ in range(3):
        assert link.receive(data, PEER, 0.0) == []
    assert link.wants(0.0) == 0
    assert link.journal.counts == {"bad packets": 3}
    assert len(told) == 1
    assert words in told[0]
    assert "\n" not in told[0]


@given(st.binary(max_size=100) | st.binary(min_size=38, max_size=38).map(lambda rest: b"\x1a\x48" + rest))
def test_any_bytes_are_a_frame_or_a_reason(data):
    read = read_frame(data)
    assert isinstance(read, str) or len(read.pulses) == 16


def test_whatever_the_pulses_the_plant_stays_finite():
    link: ArduPilotLink = link_of("ardupilot", "--start", "0,0,20,0")[0]
    for number in range(200):
        pulses = [(number * 7919 * (k + 1)) % 65536 for k in range(4)]
        state, _ = answer(link, frame(number, rate=50, pulses=pulses))
        assert all(math.isfinite(x) and abs(x) < 1e3 for x in (*state["position"], *state["imu"]["gyro"]))


def test_a_failed_motor_falls():
    link, told = link_of("ardupilot", "--start", "0,0,5,0", "--fail", "left-motor:off@0.1+0.2")
    answer(link, frame(0, rate=20, pulses=(1500, 1500, 1600, 1600)))
    answer(link, frame(1, rate=20, pulses=(1500, 1500, 1600, 1600)))
    answer(link, frame(2, rate=20, pulses=(1500, 1500, 1600, 1600)))
    answer(link, frame(3, rate=20, pulses=(1500, 1500, 1600, 1600)))
    assert link.rig.vehicle.truth.actuators.left_motor < 1.0
    for number in range(4, 9):
        answer(link, frame(number, rate=20, pulses=(1500, 1500, 1600, 1600)))
    assert link.rig.vehicle.truth.actuators.left_motor > 500.0
    assert [line for line in told if "left-motor" in line] == ["left-motor off at 0.1 s", "left-motor healthy at 0.3 s"]
