"""The truth is asked for while it is wanted, of a vehicle that may know it."""

import pytest

from darko_gcs.station.family_requests import TRUTH_SILENCE
from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from tests.support.gcs.linked_station import LinkedStation

INTERVAL = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL


@pytest.fixture
def link(tmp_path):
    link = LinkedStation(tmp_path)
    assert link.run(3.0, lambda: link.snapshot.hybrid.state is not None)
    return link


def intervals(link):
    """Intervals asked for so far [us]."""
    messages = [message for data in link.sent for message in Codec(1, 1).decode(data)]
    return [m.param2 for m in messages if m.get_type() == "COMMAND_LONG" and m.command == INTERVAL]


def test_it_comes_while_it_is_wanted_and_stops_after(link):
    link.run(2.0)
    assert link.snapshot.estimates.truth is None
    assert intervals(link) == []
    link.station.want_truth(link.now, wanted=True)
    link.run(3.0)
    first = link.snapshot.estimates.truth
    link.run(1.0)
    assert link.snapshot.estimates.truth.time == pytest.approx(first.time + 1.0, abs=0.15)
    link.station.want_truth(link.now, wanted=False)
    link.run(1.0)
    last = link.snapshot.estimates.truth
    link.run(TRUTH_SILENCE + 1.0)
    assert link.snapshot.estimates.truth is last
    assert intervals(link) == [100_000.0, -1.0]
    assert not [line for line in link.lines if "interval" in line.lower()]


def test_a_vehicle_that_restarts_is_asked_again(link):
    link.station.want_truth(link.now, wanted=True)
    link.run(2.0)
    link.start_vehicle(up=3.0)
    link.run(TRUTH_SILENCE + 3.0)
    assert intervals(link) == [100_000.0] * 2
    assert link.snapshot.estimates.truth is not None
