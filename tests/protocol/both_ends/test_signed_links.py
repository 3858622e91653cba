"""Both ends with a key, and unmodified pymavlink."""

from pymavlink.dialects.v20 import common

from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.wire.signing import Keyring, KeyState
from tests.support.links.link import ARM, Link, frame
from tests.support.links.signed_frames import (
    KEY,
    LOCAL,
    OTHER,
    T,
    heartbeat,
    obeys,
    open_vehicle,
    signed,
    states,
    vehicle,
)


def test_a_ground_station_with_the_key_flies_over_a_bad_link():
    link = Link(5, drop=0.1, delay=0.05, duplicate=0.1, reorder=0.2)
    link.ground = GroundEndpoint(keyring=Keyring({None: KEY}, timestamp=T))
    link.vehicle.endpoint = vehicle(Keyring({None: KEY}, timestamp=T))
    assert link.run(lambda: link.ground.vehicle is not None)
    link.ground.request_parameters(link.now)
    assert link.run(lambda: not link.ground.is_busy)
    link.ground.command(ARM, 1.0, now=link.now)
    assert link.run(lambda: link.vehicle.armed)
    assert link.ground.codec.statistics.refused > 0  # duplicates and reordered frames


def test_a_ground_station_with_a_key_shows_an_unsigned_vehicle_but_ignores_it():
    ground = GroundEndpoint(keyring=Keyring({None: KEY}, timestamp=T))
    ground.receive_datagram(frame(heartbeat(19, 12), 1, 1), 0.0)
    assert ground.vehicle is None
    assert ground.unsigned_vehicle == (1, 1)
    ground.receive_datagram(signed(heartbeat(19, 12), system=1, component=1), 0.0)
    assert ground.vehicle == (1, 1)
    assert ground.unsigned_vehicle is None


class Pymavlink:
    """Unmodified pymavlink with a key, its own dialect and its own framing."""

    def __init__(self, key, timestamp, link=3):
        self.mav = common.MAVLink(None, 245, 190)
        self.mav.robust_parsing = True
        self.mav.signing.secret_key = key
        self.mav.signing.sign_outgoing = True
        self.mav.signing.timestamp = timestamp
        self.mav.signing.link_id = link

    def frame(self, message):
        data = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return data

    def hears(self, data):
        return [m.get_type() for m in self.mav.parse_buffer(data) or [] if m.get_type() != "BAD_DATA"]


def test_pymavlink_with_the_same_key_is_accepted_both_ways():
    peer, end = Pymavlink(KEY, T + 500), vehicle()
    command = common.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)
    assert all(obeys(end, peer.frame(command)) for _ in range(3))
    end.datagrams_to_send()
    end.status_text(6, "x")
    end.announce(heartbeat(19, 12), 0.0)
    heard = [kind for name, data in end.datagrams_to_send() if name == LOCAL for kind in peer.hears(data)]
    assert heard == ["STATUSTEXT", "HEARTBEAT"]
    assert peer.mav.signing.goodsig_count == 2
    assert peer.mav.signing.badsig_count == 0


def test_pymavlink_with_another_key_is_refused_both_ways():
    peer, end = Pymavlink(OTHER, T + 500), vehicle()
    assert not obeys(
        end, peer.frame(common.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11))
    )
    end.status_text(6, "x")
    assert [kind for _, data in end.datagrams_to_send() for kind in peer.hears(data)] == []
    assert peer.mav.signing.badsig_count == 1


def test_a_key_set_by_pymavlink_is_confirmed_by_its_next_frame():
    peer, end = Pymavlink(KEY, T + 500), open_vehicle()
    peer.mav.signing.sign_outgoing = False
    assert states(end, peer.frame(common.MAVLink_setup_signing_message(1, 1, list(KEY), T + 500))) == [KeyState.PENDING]
    peer.mav.signing.sign_outgoing = True
    assert states(end, peer.frame(common.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))) == [KeyState.ON]
    end.datagrams_to_send()
    end.status_text(6, "x")
    assert [kind for _, data in end.datagrams_to_send() for kind in peer.hears(data)] == ["STATUSTEXT"]


def test_pymavlink_catches_up_with_a_vehicle_whose_time_ran_ahead():
    """Its timestamps follow received ones only, not a clock."""
    peer, end = Pymavlink(KEY, T), vehicle(Keyring({None: KEY}, timestamp=T, floor=T + 10**6))
    command = common.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)
    assert not obeys(end, peer.frame(command))
    end.status_text(6, "x")
    for _, data in end.datagrams_to_send():
        assert peer.hears(data) == ["STATUSTEXT"]
    assert obeys(end, peer.frame(command))
