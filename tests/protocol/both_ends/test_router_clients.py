"""A camera and ground stations made of pymavlink reach each other through the vehicle."""

import pytest
from pymavlink.dialects.v20 import common

from tests.support.links.routing_net import CAMERA, COMPANION, MAVPROXY, QGC, REQUEST, Net


@pytest.fixture
def net():
    return Net(("qgc", QGC), ("mavproxy", MAVPROXY), ("camera", CAMERA), ("companion", COMPANION))


class Pymavlink:
    """Unmodified pymavlink at a port of its own."""

    def __init__(self, net, port, ids):
        self.net, self.port = net, port
        self.mav = common.MAVLink(None, *ids)

    def send(self, message):
        data = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return self.net.deliver(self.port, data)

    def hears(self, copies):
        data = b"".join(sent for key, sent in copies if key == self.port)
        return self.mav.parse_buffer(data) or []


def test_a_camera_and_two_ground_stations_find_and_answer_each_other():
    net = Net()
    camera, qgc = Pymavlink(net, "camera", CAMERA), Pymavlink(net, "qgc", QGC)
    script = Pymavlink(net, "script", (245, 190))
    for station in (qgc, script):
        station.send(common.MAVLink_heartbeat_message(common.MAV_TYPE_GCS, 8, 0, 0, 4, 3))
    beat = camera.send(common.MAVLink_heartbeat_message(common.MAV_TYPE_CAMERA, 8, 0, 0, 4, 3))
    for station in (qgc, script):
        (heartbeat,) = station.hears(beat)
        assert (heartbeat.get_srcSystem(), heartbeat.get_srcComponent()) == CAMERA

    wanted = common.MAVLINK_MSG_ID_CAMERA_INFORMATION
    asked = qgc.send(common.MAVLink_command_long_message(*CAMERA, REQUEST, 0, wanted, 0, 0, 0, 0, 0, 0))
    (request,) = camera.hears(asked)
    assert (request.command, request.param1, request.get_srcSystem()) == (REQUEST, wanted, 255)
    assert net.answers == script.hears(asked) == []

    answered = camera.send(common.MAVLink_command_ack_message(REQUEST, 0, 0, 0, *QGC))
    assert [m.get_type() for m in qgc.hears(answered)] == ["COMMAND_ACK"]
    assert script.hears(answered) == []
    told = camera.send(
        common.MAVLink_camera_information_message(
            7, list(b"ENAC".ljust(32, b"\0")), list(b"Eye".ljust(32, b"\0")), 1, 8.0, 6.0, 4.5, 640, 480, 0, 2, 0, b""
        )
    )
    for station in (qgc, script):
        (information,) = station.hears(told)
        assert bytes(information.vendor_name).rstrip(b"\0") == b"ENAC"
        assert (information.resolution_h, information.get_srcComponent()) == (640, 100)
    assert net.end.routing.withheld == {}
