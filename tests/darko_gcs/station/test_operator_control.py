"""Control of the vehicle by one ground station: ours, another one, and the real vehicle node."""

import math

import pytest

from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from protocol.events import CommandDone, ControlRequested
from protocol.wire.codec import Codec
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.messages import command_long
from tests.support.gcs.screens import panel_text

REQUEST_CONTROL = mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
NOT_IN_CONTROL = mavlink.MAV_RESULT_NOT_IN_CONTROL
OTHER = 245  # system id of another ground station
STATUS_TIME = 0.5  # within which CONTROL_STATUS has arrived [s]


class OtherStation:
    """Another ground station on the vehicle of a link."""

    def __init__(self, link):
        self._link, self._codec, self._decoder = link, Codec(OTHER, 190), Codec(OTHER, 190)

    def command(self, command, *params):
        """Send COMMAND_LONG; returns the MAV_RESULT."""
        self._link.vehicle.receive(self._codec.encode(command_long(command, *params)), "other", self._link.now)
        heard = []
        for peer, data in self._link.vehicle.datagrams(self._link.now):
            if peer == "other":
                heard += self._decoder.decode(data)
            else:
                self._link.receive(data)
        return next(m.result for m in heard if m.get_type() == "COMMAND_ACK" and m.command == command)


@pytest.fixture
def link(tmp_path):
    linked = LinkedStation(tmp_path)
    linked.run(2.5)
    return linked


def shown(link):
    return panel_text(StatusBar(), link.snapshot, width=160, height=1)


def results(link):
    return [event.result for event in link.events_of(CommandDone)]


def test_control_is_taken_and_given_back(link):
    other = OtherStation(link)
    link.station.take_control(link.now)
    link.run(STATUS_TIME)
    assert link.snapshot.operator.in_control == 255
    assert "in control" in shown(link)
    assert other.command(ARM, 1) == NOT_IN_CONTROL
    link.station.give_control_back(link.now)
    link.run(STATUS_TIME)
    assert link.snapshot.operator.in_control == 0
    assert "control" not in shown(link).lower()
    assert other.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert results(link) == [mavlink.MAV_RESULT_ACCEPTED] * 2


def test_another_stations_request_is_shown_and_granted_by_sharing(link):
    other = OtherStation(link)
    link.station.take_control(link.now)
    link.run(STATUS_TIME)
    assert other.command(REQUEST_CONTROL, 1) == mavlink.MAV_RESULT_FAILED
    assert f"{OTHER} ASKS FOR CONTROL" in shown(link)
    link.station.share_control(link.now)
    link.run(STATUS_TIME)
    assert link.snapshot.operator.takeover_allowed
    assert other.command(REQUEST_CONTROL, 1) == mavlink.MAV_RESULT_ACCEPTED
    link.run(STATUS_TIME)
    assert f"{OTHER} IN CONTROL" in shown(link)
    link.station.arm(link.now)
    link.run(STATUS_TIME)
    assert results(link)[-1] == NOT_IN_CONTROL


def test_a_ground_station_answers_only_valid_requests_for_control(link):
    vehicle = Codec(1, 1)
    for command, asker, result in (
        (REQUEST_CONTROL, OTHER, mavlink.MAV_RESULT_ACCEPTED),
        (REQUEST_CONTROL, math.nan, mavlink.MAV_RESULT_DENIED),
        (REQUEST_CONTROL, 300.0, mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_NAV_LAND, 0.0, mavlink.MAV_RESULT_UNSUPPORTED),
    ):
        link.receive(vehicle.encode(command_long(command, 1, 0, 10, asker, target=(255, 190))))
        link.station.tick(link.now)
        sent = [m for data in link.station.outgoing(link.now, 0) for m in Codec(1, 1).decode(data)]
        assert [(m.command, m.result) for m in sent if m.get_type() == "COMMAND_ACK"] == [(command, result)]
    assert [e.system for e in link.station.events() if isinstance(e, ControlRequested)] == [OTHER]
    assert f"Ground station {OTHER} asks for control" in link.lines[-1]
