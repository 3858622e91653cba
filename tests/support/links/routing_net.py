"""A vehicle and several peers, each at a port of its own."""

from collections.abc import Hashable

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.wire.codec import Codec
from protocol.wire.signing import Signature, sign_frame
from tests.support.links.link import ARM, table

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))


T = 36_000_000_000_000  # some day in 2026 [10 us since 2015]


QGC, MAVPROXY, CAMERA, COMPANION, ELSEWHERE = (255, 190), (255, 230), (1, 100), (1, 191), (7, 3)


ALIVE = {
    QGC: mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3),
    MAVPROXY: mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3),
    CAMERA: mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_CAMERA, 8, 0, 0, 4, 3),
    COMPANION: mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_ONBOARD_CONTROLLER, 8, 0, 0, 4, 3),
}


REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE


def long(target, command=REQUEST, *params):
    system, component = target
    values = [*params, *[0.0] * (7 - len(params))]
    return mavlink.MAVLink_command_long_message(system, component, command, 0, *values)


class Net:
    """A vehicle and its peers, each at a port with its own name."""

    def __init__(self, *ports, system=1, **options):
        self.now, self.timestamp = 10.0, T
        self.end = VehicleEndpoint(
            system=system, commands={ARM}, parameters=table(), validate=lambda _items: None, **{"peers": ()} | options
        )
        self.codecs = {}
        for port, ids in ports:
            self.say(port, ids)

    def frame(self, ids, message):
        return self.codecs.setdefault(ids, Codec(*ids)).encode(message)

    def signed(self, ids, message, key=KEY):
        self.timestamp += 1
        return sign_frame(self.frame(ids, message), key, Signature(0, self.timestamp))

    def say(self, port, ids, message=None):
        """Send one message as ``ids``; returns the forwarded copies as (port, bytes)."""
        return self.deliver(port, self.frame(ids, message or ALIVE.get(ids, ALIVE[QGC])))

    def deliver(self, port, data):
        self.end.receive_datagram(data, port, self.now)
        self.answers: list[tuple[Hashable, bytes]] = []
        copies: list[tuple[Hashable, bytes]] = []
        for key, sent in self.end.datagrams_to_send():
            own = Codec(9, 9).decode(sent)
            is_own = own and (own[0].get_srcSystem(), own[0].get_srcComponent()) == (1, 1)
            (self.answers if is_own else copies).append((key, sent))
        self.end.events()
        return copies

    def reaches(self, port, ids, message):
        """The ports a message is forwarded to."""
        return sorted(key for key, _ in self.say(port, ids, message))

    @property
    def withheld(self):
        return dict(self.end.routing.withheld)
