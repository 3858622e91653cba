"""A flying vehicle between a camera and two ground stations: all reach each other, and the flight stays the same."""

import pytest

from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from tests.support.vehicle.fake_station import STEP
from tests.support.vehicle.hovering_node import hovering

GROUND, OTHER, CAMERA = (255, 190), (245, 190), (1, 100)
PORTS = {"ground": GROUND, "other": OTHER, "camera": CAMERA}
SECONDS = 3.0
REQUEST, INFORMATION = mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION


class Station:
    """Whoever is at one port: says what it is told to, and keeps what it hears of others than the vehicle."""

    def __init__(self, ids):
        self.ids, self.codec, self.heard = ids, Codec(*ids), []

    def hear(self, data):
        for message in self.codec.decode(data):
            source = (message.get_srcSystem(), message.get_srcComponent())
            if source != (1, 1):
                self.heard.append((*source, message.get_type()))


def said(step):
    """Messages of the camera and the stations in one step, as (port, message)."""
    if step % 50 == 0:
        kinds = {"ground": mavlink.MAV_TYPE_GCS, "other": mavlink.MAV_TYPE_GCS, "camera": mavlink.MAV_TYPE_CAMERA}
        yield from ((port, mavlink.MAVLink_heartbeat_message(kind, 8, 0, 0, 4, 3)) for port, kind in kinds.items())
    if step == 60:
        yield "other", mavlink.MAVLink_command_long_message(*CAMERA, REQUEST, 0, INFORMATION, 0, 0, 0, 0, 0, 0)
    if step == 62:
        yield "camera", mavlink.MAVLink_command_ack_message(REQUEST, 0, 0, 0, *OTHER)
        yield "camera", mavlink.MAVLink_camera_settings_message(0, mavlink.CAMERA_MODE_IMAGE)


def fly(folder, *, ports):
    node, stations, now = hovering(folder), {port: Station(PORTS[port]) for port in ports}, 0.0
    for step in range(round(SECONDS / STEP)):
        for port, message in said(step):
            if port in stations:
                node.receive(stations[port].codec.encode(message), port, now)
        node.advance(10)
        now += STEP
        for port, data in node.datagrams(now):
            if port in stations:
                stations[port].hear(data)
    return node, stations


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    alone = fly(tmp_path_factory.mktemp("alone"), ports=["ground"])
    return alone, fly(tmp_path_factory.mktemp("among"), ports=list(PORTS))


def test_stations_and_camera_hear_what_is_for_them_and_no_more(flights):
    _, (_, stations) = flights
    beat = "HEARTBEAT"
    for port, station in stations.items():
        assert {heard[:2] for heard in station.heard if heard[2] == beat} == set(PORTS.values()) - {PORTS[port]}
    extra = {port: [heard for heard in s.heard if heard[2] != beat] for port, s in stations.items()}
    assert extra["camera"] == [(*OTHER, "COMMAND_LONG")]
    assert extra["other"] == [(*CAMERA, "COMMAND_ACK"), (*CAMERA, "CAMERA_SETTINGS")]
    assert extra["ground"] == [(*CAMERA, "CAMERA_SETTINGS")]


def test_forwarded_messages_change_no_bit_of_the_flight(flights):
    (alone, _), (among, _) = flights
    assert among.aircraft.vehicle.flight == alone.aircraft.vehicle.flight
    assert among.aircraft.autopilot.mode == alone.aircraft.autopilot.mode


def test_forwarding_leaves_no_gap_in_the_telemetry(flights):
    _, (_, stations) = flights
    assert all(station.codec.statistics.sources[1, 1].lost == 0 for station in stations.values())
