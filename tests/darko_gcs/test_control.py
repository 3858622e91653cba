"""Who is in control, between our ground station, another one and the real vehicle node."""

import math

import pytest

from darko_gcs.widgets.status import StatusBar
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.events import CommandDone, ControlRequested
from tests.support.station_pair import Pair

REQUEST_CONTROL = mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL
NOT_IN_CONTROL = mavlink.MAV_RESULT_NOT_IN_CONTROL
OTHER = 245
LATE = 0.5  # CONTROL_STATUS has come by then [s]


class Other:
    """Another ground station on the vehicle of a pair."""

    def __init__(self, pair):
        self._pair, self._codec, self._heard = pair, Codec(OTHER, 190), Codec(OTHER, 190)

    def command(self, command, *params):
        """Send COMMAND_LONG; the MAV_RESULT."""
        padded = (*params, *(0.0,) * (7 - len(params)))
        message = mavlink.MAVLink_command_long_message(1, 1, command, 0, *padded)
        self._pair.vehicle.receive(self._codec.encode(message), "other", self._pair.now)
        told = []
        for peer, data in self._pair.vehicle.datagrams(self._pair.now):
            if peer == "other":
                told += self._heard.decode(data)
            else:
                self._pair.station.receive(data, self._pair.now, 0)
        return next(m.result for m in told if m.get_type() == "COMMAND_ACK" and m.command == command)


@pytest.fixture
def pair(tmp_path):
    made = Pair(tmp_path)
    made.run(2.5)
    return made


def shown(pair):
    return str(StatusBar().draw(pair.snapshot, 160, 1)[0])


def done(pair):
    return [e.result for e in pair.station.events() if isinstance(e, CommandDone)]


def test_control_is_taken_and_given_back(pair):
    other = Other(pair)
    pair.station.take_control(pair.now)
    pair.run(LATE)
    assert pair.snapshot.in_control == 255
    assert "in control" in shown(pair)
    assert other.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == NOT_IN_CONTROL
    pair.station.give_control_back(pair.now)
    pair.run(LATE)
    assert pair.snapshot.in_control == 0
    assert "control" not in shown(pair).lower()
    assert other.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert done(pair) == [mavlink.MAV_RESULT_ACCEPTED] * 2


def test_another_s_request_is_shown_and_granted_by_sharing(pair):
    other = Other(pair)
    pair.station.take_control(pair.now)
    pair.run(LATE)
    assert other.command(REQUEST_CONTROL, 1) == mavlink.MAV_RESULT_FAILED
    assert f"{OTHER} ASKS FOR CONTROL" in shown(pair)
    pair.station.share_control(pair.now)
    pair.run(LATE)
    assert pair.snapshot.takeover
    assert other.command(REQUEST_CONTROL, 1) == mavlink.MAV_RESULT_ACCEPTED
    pair.run(LATE)
    assert f"{OTHER} IN CONTROL" in shown(pair)
    pair.station.arm(pair.now)
    pair.run(LATE)
    assert done(pair)[-1] == NOT_IN_CONTROL


def test_an_order_that_is_none_of_a_ground_station_is_refused(pair):
    vehicle = Codec(1, 1)
    for command, asker, result in (
        (REQUEST_CONTROL, OTHER, mavlink.MAV_RESULT_ACCEPTED),
        (REQUEST_CONTROL, math.nan, mavlink.MAV_RESULT_DENIED),
        (REQUEST_CONTROL, 300.0, mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_NAV_LAND, 0.0, mavlink.MAV_RESULT_UNSUPPORTED),
    ):
        order = mavlink.MAVLink_command_long_message(255, 190, command, 0, 1, 0, 10, asker, 0, 0, 0)
        pair.station.receive(vehicle.encode(order), pair.now, 0)
        pair.station.tick(pair.now)
        sent = [m for data in pair.station.outgoing(pair.now, 0) for m in Codec(1, 1).decode(data)]
        assert [(m.command, m.result) for m in sent if m.get_type() == "COMMAND_ACK"] == [(command, result)]
    assert [e.system for e in pair.station.events() if isinstance(e, ControlRequested)] == [OTHER]
    assert f"Ground station {OTHER} asks for control" in pair.snapshot.messages[-1].text
