"""Recognition of ground stations and of the companion computer, and the time since each was heard."""

import pytest

from protocol.dialect import mavlink
from protocol.engines.heartbeat import Presence
from protocol.wire.message import Peer

STATION, COMPANION = mavlink.MAV_TYPE_GCS, mavlink.MAV_TYPE_ONBOARD_CONTROLLER


def heard(*heartbeats):
    """The presence at a vehicle of system 1 that heard (type, system) once a second from 10 s on."""
    presence = Presence(1)
    for second, (kind, system) in enumerate(heartbeats):
        presence.hear(mavlink.MAVLink_heartbeat_message(kind, 8, 0, 0, 4, 3), 10.0 + second, Peer(system, 190))
    return presence


def test_nobody_is_there_at_first():
    assert heard().ground(99.0) is None
    assert heard().companion(99.0) is None


def test_a_station_is_known_by_its_type_whatever_its_system():
    presence = heard((STATION, 255), (STATION, 1), (STATION, 40))
    assert [presence.ground(13.0, system) for system in (255, 1, 40)] == [3.0, 2.0, 1.0]
    assert presence.ground(13.0, 7) is None
    assert presence.ground(13.0) == 1.0  # the one heard last
    assert presence.companion(13.0) is None


@pytest.mark.parametrize(("kind", "system", "silent"), [(COMPANION, 1, 3.0), (COMPANION, 2, None), (STATION, 1, None)])
def test_only_the_vehicles_own_onboard_controller_is_the_companion(kind, system, silent):
    assert heard((kind, system)).companion(13.0) == silent


def test_other_components_count_for_nothing():
    presence = heard((mavlink.MAV_TYPE_CAMERA, 1), (mavlink.MAV_TYPE_QUADROTOR, 255))
    assert presence.ground(13.0) is None
    assert presence.companion(13.0) is None
