import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.defaults import HOME
from tests.support.foreign_autopilots import BetaflightClient, flown_by_betaflight, link_of

ORIGIN = (HOME.lat_deg, HOME.lon_deg, HOME.alt)
PEER = ("127.0.0.1", 41000)
STILL = struct.pack("<Hxx16f", 1, 1000.0, 1500.0, 1500.0, *[0.0] * 13)


@pytest.mark.long
def test_a_minute_of_hover_through_lost_and_repeated_packets_silence_and_a_restart():
    link, told = link_of(
        "betaflight", "--outputs", "betaflight-tailsitter", "--start", "0,0,5,0", "--wind", "1@300", "--gusts", "0.3"
    )
    client = BetaflightClient(ORIGIN)
    assert flown_by_betaflight(link, client, 12.0) < 0.8
    now = 12.0
    for _ in range(20):
        link.step(now)  # a state that is lost
        assert link.wants(now) == 0
        now += 0.011
        ((again, to),) = link.poll(now)
        assert to == ("127.0.0.1", 9003)
        outputs = client.take(again)
        link.receive(outputs, PEER, now)
        link.receive(outputs, PEER, now)  # and an answer that comes twice
        flown_by_betaflight(link, client, 0.4, now=now)
    assert dict(link.journal.counts) == {"repeated states": 20, "repeated outputs": 20}
    link.step(100.0)
    waiting = link.rig.vehicle.periods
    for later in range(100, 110):  # it has died: the state is offered, the vehicle waits
        link.poll(later + 0.5)
        assert link.wants(later + 0.5) == 0
    assert link.rig.vehicle.periods == waiting
    second = BetaflightClient(ORIGIN)
    assert flown_by_betaflight(link, second, 40.0, now=111.0) < 0.8
    assert link.rig.vehicle.crash is None
    assert link.journal.counts["restarts"] == link.journal.counts["silences"] == 1
    assert [line for line in told if "answers" in line] == [
        "Betaflight at 127.0.0.1 answers",
        "Betaflight answers again: the vehicle is put back to its start",
    ]


def test_standing_it_tells_betaflights_own_frames():
    link, _ = link_of("betaflight", "--start", "0,0,0,90")
    ((state, to),) = link.step(0.0)
    numbers = struct.unpack("<18d", state)
    assert to == ("127.0.0.1", 9003)
    assert numbers[0] == 0.002
    assert numbers[4:7] == pytest.approx((-9.81, 0.0, 0.0), abs=0.8)  # it turns all signs about: +1 g along the nose
    w, x, y, z = numbers[7:11]
    assert 2.0 * (x * z - w * y) == pytest.approx(-1.0, abs=1e-3)  # how far down the nose is, body FRD to NED
    assert numbers[14:17] == pytest.approx((HOME.lon_deg, HOME.lat_deg, HOME.alt + 0.108), abs=1e-3)
    assert numbers[17] == pytest.approx(99540, abs=60)


def test_by_its_wing_mixer_one_output_turns_both_motors():
    link, _ = link_of("betaflight")
    link.step(0.0)
    link.receive(struct.pack("<Hxx16f", 1, 1500.0, 2000.0, 1000.0, *[0.0] * 13), PEER, 0.0)
    link.step(0.0)
    command = link.rig.vehicle.command
    assert command.left_motor == command.right_motor == pytest.approx(0.5 * link.rig.vehicle.airframe.omega_max)
    assert command.left_elevon == -command.right_elevon > 0.0


def test_before_it_answers_pairs_of_states_are_offered_and_nothing_moves():
    link, told = link_of("betaflight")
    ((first, _),) = link.step(0.0)
    assert link.poll(0.009) == []
    assert link.wakes() == pytest.approx(0.01)
    ((again, _),) = link.poll(0.011)
    assert link.wakes() == pytest.approx(3.011)  # a state while it boots may hang it
    assert again[8:] == first[8:]
    assert struct.unpack("<2d", first[:8] + again[:8]) == pytest.approx((0.002, 0.012))  # or its clock would stop
    assert link.wants(60.0) == 0
    assert link.rig.vehicle.periods == 1
    assert told == []


@pytest.mark.parametrize("data", [b"", STILL[:-1], STILL + b"\0", bytes(16)])
def test_a_packet_of_another_length_is_counted_and_said_once(data):
    link, told = link_of("betaflight")
    link.step(0.0)
    link.receive(data, PEER, 0.0)
    link.receive(data, PEER, 0.0)
    assert link.wants(0.0) == 0
    assert link.journal.counts == {"bad packets": 2}
    assert told == [f"a packet of {len(data)} bytes, Betaflight's outputs have 68: ignored"]


def test_outputs_from_elsewhere_and_those_that_are_no_numbers_are_not_flown():
    link, _ = link_of("betaflight")
    link.step(0.0)
    link.receive(STILL, ("10.0.0.1", 9), 0.0)
    assert link.wants(0.0) == 0
    link.receive(struct.pack("<Hxx16f", 1, *[math.nan] * 16), PEER, 0.0)
    assert link.wants(0.0) == 1
    assert link.journal.counts == {"foreign packets": 1, "bad outputs": 1}


@given(st.binary(max_size=80) | st.binary(min_size=68, max_size=68))
def test_no_bytes_raise_an_error_or_leave_the_finite_numbers(data):
    link = _LINK[0] if _LINK else _LINK.append(link_of("betaflight")[0]) or _LINK[0]
    link.receive(data, PEER, 0.0)
    ((state, _),) = link.step(0.0)
    assert all(math.isfinite(x) for x in struct.unpack("<18d", state))


_LINK = []
