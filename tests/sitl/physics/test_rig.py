import math

import pytest

from sitl.errors import SitlError
from sitl.physics.journal import Journal
from sitl.physics.rig import Failure, read_failure
from sitl.sensors.instruments import GARBAGE, HEALTHY, OFF, STUCK
from tests.support.foreign_autopilots import link_of


def test_failures_are_written_with_unit_way_start_and_duration():
    assert read_failure("gnss:off@30+10") == Failure("gnss", OFF, 30.0, 40.0)
    assert read_failure("left-motor:stuck@0") == Failure("left-motor", STUCK, 0.0, math.inf)
    assert read_failure("gyroscope:garbage", now=7.0) == Failure("gyroscope", GARBAGE, 7.0, math.inf)
    assert read_failure("motion-capture:healthy+1", now=7.0).way == HEALTHY


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "there is no unit ''"),
        ("flux:off@1", "there is gyroscope, accelerometer"),
        ("gnss:melted@1", "gnss cannot be 'melted'; it can be healthy, off"),
        ("left-motor:delayed@1", "left-motor cannot be 'delayed'"),
        ("gnss:off", "does not say when: gnss:off@20"),
        ("gnss:off@soon", "'soon' is not a finite number"),
        ("gnss:off@-1", "-1 is negative"),
        ("gnss:off@1+x", "'x' is not a finite number"),
    ],
)
def test_what_is_no_failure_is_refused_in_one_line(text, words):
    with pytest.raises(SitlError) as error:
        read_failure(text)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_a_person_orders_failures_wind_and_the_start():
    link, told = link_of("ardupilot", "--start", "0,0,9,0")
    rig = link.rig
    assert rig.order("wind 4@90") == "wind 4@90"
    assert rig.vehicle.wind == pytest.approx((0.0, 4.0, 0.0))  # from the east it blows west
    rig.order("fail pitot:off+0.1")
    rig.fly(100)
    rig.fly(1)
    assert told == ["pitot off at 0.0 s", "pitot healthy at 0.2 s"]
    assert rig.order("reset") == "the vehicle is put back to its start"
    assert rig.vehicle.truth.body.position.z == 9.0
    for words in ("", "fly", "wind", "wind x", "wind 4@", "fail", "fail gnss:melted", "reset now"):
        if words != "wind 4@":
            with pytest.raises(SitlError):
                rig.order(words)


def test_a_crash_is_said_once_for_each_start():
    link, told = link_of("ardupilot", "--start", "0,0,9,0")
    for _ in range(2):
        for _ in range(4):
            link.rig.fly(250)
        link.rig.order("reset")
    assert link.journal.counts == {"crashes": 2}
    assert "crashed into the ground at" in told[0]


def test_events_are_said_at_powers_of_ten():
    told = []
    journal = Journal(told.append)
    for _ in range(250):
        journal.note("bad packets", "a bad packet")
    assert told == ["a bad packet", "a bad packet (10 bad packets by now)", "a bad packet (100 bad packets by now)"]
    journal.tell("restarts", "it began anew")
    journal.tell("restarts", "it began anew")
    assert told[3:] == ["it began anew"] * 2
    assert journal.summary() == "250 bad packets, 2 restarts"
