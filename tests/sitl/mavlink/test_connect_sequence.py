"""QGroundControl's connect sequence, message by message, as its public sources describe it.

The order is that of InitialConnectStateMachine: AUTOPILOT_VERSION, standard modes one by one, component metadata and
the files it names, the parameter list, mission, fence and rally points; beside it the managers of cameras and gimbals
ask every component that has a heartbeat. Whatever it waits for is answered, and well before it gives up.
"""

import json
import lzma
from urllib.parse import urlparse

import pytest

from protocol.dialect import mavlink
from protocol.engines.file_transfer import FtpPacket, crc32
from protocol.plans import load
from protocol.plans.plan import MissionItem
from tests.support.paths import DATA
from tests.support.vehicle.fake_station import HOME, Bench, FakeStation

ACCEPTED, UNSUPPORTED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_UNSUPPORTED
REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE
PATIENCE = 0.5  # [s] QGroundControl waits 1 s at the least, then repeats
SQUARE = load(DATA / "square.plan").items
FENCE = (
    MissionItem(
        command=mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION,
        frame=0,
        params=(200.0, 0, 0, 0),
        x=435648000,
        y=14811000,
        z=0.0,
    ),
)
RALLY = (
    MissionItem(command=mavlink.MAV_CMD_NAV_RALLY_POINT, frame=3, params=(0, 0, 0, 0), x=435648100, y=14811100, z=8.0),
)


class QGroundControl(FakeStation):
    """Asks one thing after the other; silence is a failure."""

    asked = 0  # file requests

    def wait(self, kind, condition=lambda _: True):
        """The first message of a kind that is right, heard since the last question."""
        end = self.bench.now + PATIENCE
        while True:
            found = next((m for m in self.heard if m.get_type() == kind and condition(m)), None)
            if found is not None:
                return found
            assert self.bench.now < end, f"no {kind}"
            self.bench.advance(0.02)

    def ask(self, message):
        self.heard.clear()
        self.send(message)

    def command(self, command, *params):
        """The result of a COMMAND_LONG, unused parameters 0 as QGroundControl leaves them."""
        seven = (*params, *(0.0,) * (7 - len(params)))
        self.ask(mavlink.MAVLink_command_long_message(1, 1, command, 0, *seven))
        return self.wait("COMMAND_ACK", lambda m: m.command == command).result

    def request(self, number, *params):
        """A message by REQUEST_MESSAGE; None when it is refused."""
        if self.command(REQUEST, number, *params) != ACCEPTED:
            return None
        return self.wait(mavlink.mavlink_map[number].msgname)

    def ftp(self, opcode, **fields):
        """The answer to one file request."""
        self.asked += 1
        packet = FtpPacket(seq=self.asked, opcode=opcode, **{"session": 0, **fields})
        self.ask(packet.to_message(1, 1))
        return FtpPacket.of(self.wait("FILE_TRANSFER_PROTOCOL"))

    def download(self, uri):
        """A file as FTPManager reads it: open, burst until the end, reset the sessions."""
        path = urlparse(uri).path.encode()
        opened = self.ftp(mavlink.MAV_FTP_OPCODE_OPENFILERO, size=len(path), data=path)
        assert opened.opcode == mavlink.MAV_FTP_OPCODE_ACK
        size, content = int.from_bytes(opened.content, "little"), {}
        self.ftp(mavlink.MAV_FTP_OPCODE_BURSTREADFILE, session=opened.session, size=239)
        end = self.bench.now + 10.0
        while sum(map(len, content.values())) < size:
            assert self.bench.now < end, "the burst ends early"
            self.bench.advance(0.02)
            for packet in (FtpPacket.of(m) for m in self.heard if m.get_type() == "FILE_TRANSFER_PROTOCOL"):
                if packet.opcode == mavlink.MAV_FTP_OPCODE_ACK:
                    content[packet.offset] = packet.content
        assert self.ftp(mavlink.MAV_FTP_OPCODE_RESETSESSION).opcode == mavlink.MAV_FTP_OPCODE_ACK
        return b"".join(content[offset] for offset in sorted(content))

    def plan(self, kind):
        """A plan as PlanManager loads it."""
        self.ask(mavlink.MAVLink_mission_request_list_message(1, 1, kind))
        count = self.wait("MISSION_COUNT", lambda m: m.mission_type == kind).count
        items = []
        for seq in range(count):
            self.ask(mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind))
            items.append(self.wait("MISSION_ITEM_INT", lambda m, seq=seq: (m.seq, m.mission_type) == (seq, kind)))
        self.send(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_ACCEPTED, kind))
        return items


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A vehicle that another ground station has given plans to."""
    bench = Bench(tmp_path_factory.mktemp("state"))
    station = bench.station()
    for kind, items in enumerate((SQUARE, FENCE, RALLY)):
        assert station.upload(items, kind) == mavlink.MAV_MISSION_ACCEPTED
    return bench


@pytest.fixture
def client(prepared):
    client = QGroundControl(prepared, 254, "qgc")
    client.beat()
    prepared.advance(1.1)
    client.found = client.last("HEARTBEAT")
    return client


def test_the_heartbeat_identifies_the_vehicle(client):
    assert (client.found.autopilot, client.found.type) == (mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_VTOL_DUOROTOR)


def test_the_whole_sequence_is_answered_step_by_step(client):
    version = client.request(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    assert version.capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_FTP

    modes = [client.request(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, 1)]
    while modes[-1].mode_index < modes[-1].number_modes:
        modes.append(client.request(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, modes[-1].mode_index + 1))
    assert [m.mode_index for m in modes] == list(range(1, modes[0].number_modes + 1))
    assert client.found.custom_mode in {m.custom_mode for m in modes}

    metadata = client.request(mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA)
    general = client.download(metadata.uri)
    assert crc32(general) == metadata.file_crc
    described = set()
    for entry in json.loads(lzma.decompress(general))["metadataTypes"]:
        content = client.download(entry["uri"])
        assert crc32(content) == entry["fileCrc"]
        described |= {p["name"] for p in json.loads(lzma.decompress(content))["parameters"]}

    client.ask(mavlink.MAVLink_param_request_list_message(1, 0))
    count = client.wait("PARAM_VALUE").param_count
    client.bench.advance(5.0)
    values = {m.param_index: m.param_id for m in client.heard if m.get_type() == "PARAM_VALUE"}
    assert sorted(values) == list(range(count))
    assert set(values.values()) == described

    for kind, sent in enumerate((SQUARE, FENCE, RALLY)):
        items = client.plan(kind)
        assert [(m.command, m.x, m.y) for m in items] == [(i.command, i.x, i.y) for i in sent]


def test_a_parameter_missed_in_the_list_is_read_by_its_number(client):
    client.ask(mavlink.MAVLink_param_request_read_message(1, 1, b"", 0))
    assert client.wait("PARAM_VALUE").param_index == 0


def test_the_check_of_a_cached_parameter_list_is_refused_at_once(client):
    """For PX4, QGroundControl reads this one first if it has kept the parameters of an earlier connection."""
    client.ask(mavlink.MAVLink_param_request_read_message(1, 1, b"_HASH_CHECK", -1))
    assert client.wait("PARAM_ERROR").error == mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST


# What older versions ask for, and what the managers beside the sequence do


def test_older_versions_get_their_version_messages(client):
    for command, kind in (
        (mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, "AUTOPILOT_VERSION"),
        (mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION, "PROTOCOL_VERSION"),
    ):
        assert client.command(command, 1) == ACCEPTED
        client.wait(kind)
    assert client.request(mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION).max_version == 200


@pytest.mark.parametrize(
    ("command", "first"),
    [
        (REQUEST, mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION),
        (REQUEST, mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION),
        (REQUEST, 395),  # COMPONENT_INFORMATION, before there was COMPONENT_METADATA
    ],
)
def test_what_the_vehicle_does_not_have_is_refused_at_once(client, command, first):
    assert client.command(command, first) == UNSUPPORTED


def test_the_home_position_and_the_clock_are_answered(client):
    home = client.request(mavlink.MAVLINK_MSG_ID_HOME_POSITION)
    assert home.latitude == pytest.approx(HOME.lat_deg * 1e7, abs=1)
    client.ask(mavlink.MAVLink_timesync_message(0, 12345))
    assert client.wait("TIMESYNC").ts1 == 12345
    client.ask(mavlink.MAVLink_ping_message(1, 2, 0, 0))
    assert client.wait("PING").seq == 2


def test_the_list_of_logs_is_answered_also_without_logs(client):
    client.ask(mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert client.wait("LOG_ENTRY").num_logs == 0
