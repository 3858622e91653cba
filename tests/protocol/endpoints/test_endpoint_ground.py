"""The ground station's endpoint as its owner uses it."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.errors import LocalProtocolError
from protocol.events import CommandDone, ControlRequested, CurrentItemSet, VehicleFound, VehicleLost, VehicleReturned
from protocol.wire.codec import Codec
from tests.support.links.link import ARM, Link, frame, plan
from tests.support.links.lossy_pipe import LossyPipe
from tests.support.links.vehicle_endpoint import ATTITUDE, endpoint

ACCEPTED, DENIED = 0, 2


def test_requests_before_a_vehicle_is_found_raise():
    ground = GroundEndpoint()
    assert ground.vehicle is None
    with pytest.raises(LocalProtocolError, match="no vehicle"):
        ground.command(ARM, 1.0, now=0.0)
    with pytest.raises(LocalProtocolError, match="no vehicle"):
        ground.upload_mission(plan(1), now=0.0)


def test_the_ground_station_sends_a_heartbeat_every_second():
    ground, beats = GroundEndpoint(), 0
    assert ground.next_deadline() == -math.inf
    for now in (0.0, 0.5, 1.0, 2.0):
        ground.handle_timer(now)
        for data in ground.datagrams_to_send():
            (message,) = Codec(1, 1).decode(data)
            assert message.type == mavlink.MAV_TYPE_GCS
            beats += 1
    assert beats == 3


def test_loss_of_the_vehicle_ends_commands_and_its_return_is_reported():
    link = Link()
    link.wait_for(VehicleFound)
    whole, link.down = link.down, LossyPipe(0, drop=1.0)
    request = link.ground.command(999, now=link.now, timeout=2.0)
    assert link.wait_for(CommandDone, limit=20.0) == CommandDone(request, 999, None, "vehicle lost")
    assert not link.ground.is_present
    link.down = whole
    assert isinstance(link.wait_for(VehicleReturned), VehicleReturned)
    assert [type(e) for e in link.events[:2]] == [VehicleFound, VehicleLost]


def test_a_command_that_cannot_be_encoded_leaves_nothing_behind():
    link = Link()
    link.wait_for(VehicleFound)
    for command, value in ((70_000, 0.0), (ARM, 1e40)):
        with pytest.raises(LocalProtocolError):
            link.ground.command(command, value, now=link.now)
    assert not link.ground.is_busy


def test_answers_of_other_systems_are_ignored():
    link = Link()
    link.wait_for(VehicleFound)
    link.ground.command(ARM, 1.0, now=link.now)
    forged = mavlink.MAVLink_command_ack_message(ARM, DENIED, 0, 0, 255, 190)
    link.ground.receive_datagram(frame(forged, 9, 1), link.now)
    assert link.ground.events() == []
    assert link.wait_for(CommandDone).result == ACCEPTED


def test_the_current_item_is_set_and_confirmed_through_the_link():
    link = Link(items=plan(4))
    link.wait_for(VehicleFound)
    link.ground.set_current_mission_item(2, link.now)
    assert link.wait_for(CurrentItemSet) == CurrentItemSet(2)
    assert link.vehicle.seq == 2


def test_a_requested_message_arrives():
    link = Link()
    link.wait_for(VehicleFound)
    link.ground.command(512, ATTITUDE, now=link.now)
    link.wait_for(CommandDone)
    assert link.run(lambda: any(m.get_type() == "ATTITUDE" for m in link.messages))


def test_command_int_carries_wire_integers():
    link, vehicle = Link(), endpoint()
    link.wait_for(VehicleFound)
    link.ground.command_int(ARM, 3, 1.0, 0.0, 0.0, 0.0, 435648000, 14811000, 20.0, now=link.now)
    (data,) = link.ground.datagrams_to_send()
    vehicle.receive_datagram(data, "ground", 0.0)
    assert vehicle.events()[0].params[4:] == (43.5648, 1.4811, 20.0)


def test_a_set_point_is_sent_once():
    ground = GroundEndpoint()
    ground.send(mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11))
    assert len(ground.datagrams_to_send()) == 1
    assert ground.datagrams_to_send() == []


@pytest.mark.parametrize(("asker", "is_known"), [(0, False), (1, True), (255, True), (256, False)])
def test_only_the_number_of_a_system_can_ask_for_control(asker, is_known):
    ground, vehicle = GroundEndpoint(), Codec(1, 1)
    ground.receive_datagram(vehicle.encode(mavlink.MAVLink_heartbeat_message(19, 12, 0, 0, 4, 3)), 0.0)
    ground.datagrams_to_send(), ground.events()
    values = (1.0, 0.0, 10.0, float(asker), 0.0, 0.0, 0.0)
    command = mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL
    ground.receive_datagram(vehicle.encode(mavlink.MAVLink_command_long_message(255, 190, command, 0, *values)), 0.1)
    ground.handle_timer(0.1)
    assert [e.system for e in ground.events() if isinstance(e, ControlRequested)] == [asker] * is_known
    answers = [m for data in ground.datagrams_to_send() for m in vehicle.decode(data)]
    expected = mavlink.MAV_RESULT_ACCEPTED if is_known else mavlink.MAV_RESULT_DENIED
    assert [m.result for m in answers if m.get_type() == "COMMAND_ACK"] == [expected]
