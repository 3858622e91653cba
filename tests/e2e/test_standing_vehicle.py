"""Unmodified pymavlink beside a real vehicle that stands: who it says it is, and a camera that it connects us with."""

import socket
import time
from contextlib import ExitStack, closing

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import common

from tests.e2e.support import free_ports, vehicle

TIMEOUT = 60.0  # [s]
GROUND, CAMERA = (255, 190), (1, 100)
REQUEST, INFORMATION = common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_CAMERA_INFORMATION


AVAILABLE_MODES = 435


@pytest.fixture(scope="module")
def port(tmp_path_factory):
    """Of a vehicle with a type of its own; another client's session hears the usual one's."""
    with vehicle(free_ports(1)[0], tmp_path_factory.mktemp("standing"), "--autopilot", "generic") as own:
        yield own


class Client:
    """A client on a socket connected to the vehicle."""

    def __init__(self, port, ids):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(TIMEOUT)
        self._socket.connect(("127.0.0.1", port))
        self.mav = common.MAVLink(self, *ids)
        self.mav.robust_parsing = True

    def write(self, data):
        self._socket.send(data)

    def wait(self, kind, source):
        """The next message of a kind from a (system, component)."""
        end = time.monotonic() + TIMEOUT
        while time.monotonic() < end:
            for message in self.mav.parse_buffer(self._socket.recv(65535)) or []:
                if (message.get_type(), message.get_srcSystem(), message.get_srcComponent()) == (kind, *source):
                    return message
        raise AssertionError(f"no {kind} from {source}")

    def close(self):
        self._socket.close()


@pytest.mark.long
def test_the_vehicle_reports_the_autopilot_type_of_the_command_line_and_its_mode_names(port):
    ground = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", dialect="all")
    try:
        ground.mav.heartbeat_send(common.MAV_TYPE_GCS, common.MAV_AUTOPILOT_INVALID, 0, 0, 4)
        assert ground.wait_heartbeat(timeout=TIMEOUT).autopilot == common.MAV_AUTOPILOT_GENERIC
        ground.mav.command_long_send(1, 1, REQUEST, 0, AVAILABLE_MODES, 0, 0, 0, 0, 0, 0)
        first = ground.recv_match(type="AVAILABLE_MODES", blocking=True, timeout=TIMEOUT)
        rest = [
            ground.recv_match(type="AVAILABLE_MODES", blocking=True, timeout=TIMEOUT)
            for _ in range(first.number_modes - 1)
        ]
    finally:
        ground.close()
    assert "Law: forward line of sight" in [m.mode_name for m in [first, *rest]]


@pytest.mark.long
def test_a_station_finds_a_camera_through_the_vehicle_and_gets_its_answer(port):
    with ExitStack() as stack:
        ground = stack.enter_context(closing(Client(port, GROUND)))
        camera = stack.enter_context(closing(Client(port, CAMERA)))
        ground.mav.heartbeat_send(common.MAV_TYPE_GCS, common.MAV_AUTOPILOT_INVALID, 0, 0, 4)
        ground.wait("HEARTBEAT", (1, 1))
        camera.mav.heartbeat_send(common.MAV_TYPE_CAMERA, common.MAV_AUTOPILOT_INVALID, 0, 0, 4)
        assert ground.wait("HEARTBEAT", CAMERA).type == common.MAV_TYPE_CAMERA
        ground.mav.command_long_send(*CAMERA, REQUEST, 0, INFORMATION, 0, 0, 0, 0, 0, 0)
        asked = camera.wait("COMMAND_LONG", GROUND)
        camera.mav.command_ack_send(asked.command, common.MAV_RESULT_ACCEPTED, 0, 0, *GROUND)
        vendor, model = (list(name.ljust(32, b"\0")) for name in (b"ENAC", b"Eye"))
        camera.mav.camera_information_send(7, vendor, model, 1, 8.0, 6.0, 4.5, 640, 480, 0, 2, 0, b"")
        acknowledged = ground.wait("COMMAND_ACK", CAMERA)
        assert (acknowledged.command, acknowledged.result) == (REQUEST, common.MAV_RESULT_ACCEPTED)
        assert ground.wait("CAMERA_INFORMATION", CAMERA).resolution_v == 480
