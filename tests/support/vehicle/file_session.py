"""A vehicle that records its flights, and a ground endpoint that downloads files, on a perfect link."""

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.engines.file_transfer import FtpPacket
from protocol.events import FileFailed, FileReceived
from protocol.names import FORCE_ARM_DISARM
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.node import Node
from sitl.tools.persistence import StateFolder
from tests.support.vehicle.fake_station import PEER, STEP, make_aircraft

WALL = 1_790_000_000.0  # 2026-09-21 14:13:20 UTC


class FileSession:
    """Both ends, on a virtual clock; the vehicle hovers ``up`` metres above the ground, or stands on it."""

    def __init__(self, folder, *, up=3.0):
        self.recorder = FlightRecorder(folder / "logs", lambda: WALL)
        self.node = Node(make_aircraft(up=up), StateFolder(folder / "state"), [PEER], recorder=self.recorder)
        self.ground, self.now, self.events, self.heard = GroundEndpoint(), 0.0, [], []
        self.exchange()

    def exchange(self):
        for _, data in self.node.datagrams(self.now):
            self.heard += self.ground.receive_datagram(data, self.now)
        self.ground.handle_timer(self.now)
        for data in self.ground.datagrams_to_send():
            self.node.receive(data, PEER, self.now)
        self.events += self.ground.events()

    def fly(self, seconds):
        for _ in range(round(seconds / STEP)):
            self.node.advance(10)
            self.now += STEP
            self.exchange()

    def wait_for(self, *kinds):
        for _ in range(2000):
            found = next((event for event in self.events if isinstance(event, kinds)), None)
            if found is not None:
                self.events.clear()
                return found
            self.now += 0.01
            self.exchange()
        raise AssertionError(kinds)

    def message(self, number):
        """A message by REQUEST_MESSAGE."""
        self.ground.command(mavlink.MAV_CMD_REQUEST_MESSAGE, float(number), now=self.now)
        self.fly(2 * STEP)
        return next(m for m in reversed(self.heard) if m.get_msgId() == number)

    def answer(self, packet):
        """The answer to one request of MAVLink FTP."""
        self.ground.send(packet.to_message(1, 1))
        self.exchange()
        self.exchange()
        return FtpPacket.of(next(m for m in reversed(self.heard) if m.get_type() == "FILE_TRANSFER_PROTOCOL"))

    def entries(self, path):
        """Names in a folder with their sizes, None for folders."""
        name = path.encode()
        found: dict[str, int | None] = {}
        while True:
            listed = self.answer(
                FtpPacket(
                    seq=len(found) + 1, session=0, opcode=mavlink.MAV_FTP_OPCODE_LISTDIRECTORY, size=len(name),
                    offset=len(found), data=name,
                )
            )  # fmt: skip
            if listed.opcode != mavlink.MAV_FTP_OPCODE_ACK:
                return found
            for entry in filter(None, listed.content.decode().split("\0")):
                label, _, size = entry[1:].partition("\t")
                found[label] = int(size) if entry[0] == "F" else None

    def read(self, path):
        self.ground.read_file(path, self.now)
        return self.wait_for(FileReceived, FileFailed)

    def arm(self):
        self.ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, now=self.now)

    def disarm(self):
        self.ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, float(FORCE_ARM_DISARM), now=self.now)
        self.exchange()
        self.exchange()
        self.fly(1.1)

    def texts(self):
        return "".join(m.text for m in self.heard if m.get_type() == "STATUSTEXT")
