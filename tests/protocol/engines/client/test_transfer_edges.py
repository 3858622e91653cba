"""Clients at the edges of their protocols: what fits the wire, which answers count, and when they give up."""

import pytest

from protocol.dialect import mavlink
from protocol.engines.base import Remote, RequestWindow, Retransmission
from protocol.engines.client.log_client import LogClient
from protocol.engines.client.mission_client import MissionClient
from protocol.engines.client.parameter_client import ParameterClient
from protocol.engines.heartbeat import VehicleMonitor
from protocol.engines.table_values import Parameter, encode_value
from protocol.errors import LocalProtocolError
from protocol.events import LogsListed, RemoteLog
from protocol.wire.codec import Codec
from tests.support.links.link import plan

VEHICLE = (1, 1)
REAL32 = mavlink.MAV_PARAM_TYPE_REAL32
BEAT = mavlink.MAVLink_heartbeat_message(19, 12, 81, 0, 4, 3)


def sent_by(message, system, component):
    (received,) = Codec(0, 0).decode(Codec(system, component).encode(message))
    return received


@pytest.mark.parametrize(
    ("number", "logs", "last"),
    [(2, 2, 1), (3, 2, 4), (0, 2, 2), (5, 2, 3), (0, 3, 1), (1, 2, 0)],
    ids=["beyond", "no entry", "before", "far beyond", "more logs than numbers", "more logs than numbers, beyond"],
)
def test_an_entry_that_contradicts_itself_is_no_entry(number, logs, last):
    client = LogClient()
    client.request_list(VEHICLE, 0.0)
    client.receive(mavlink.MAVLink_log_entry_message(number, logs, last, 0, 100), 0.1)
    fits = 0 <= last - logs + 1 <= number <= last
    assert bool(client._found) == fits
    for entry in (0, 1):
        client.receive(mavlink.MAVLink_log_entry_message(entry, 2, 1, 0, 100), 0.2)
    assert client.events() == [LogsListed((RemoteLog(0, 0, 100), RemoteLog(1, 0, 100)))]


def test_the_first_parameter_alone_is_the_answer_to_the_request_of_the_list():
    remote = Remote()
    client = ParameterClient(255, 190, remote)
    client.request_all(VEHICLE, 10.0)
    timeouts = []
    for index, now in ((0, 10.3), (1, 10.9), (2, 11.0)):
        value = encode_value(0.5, REAL32)
        client.receive(mavlink.MAVLink_param_value_message(b"P%d" % index, value, REAL32, 4, index), now)
        timeouts.append(remote.rtt.timeout)
    assert timeouts == [pytest.approx(0.3 + 4 * 0.15)] * 3


@pytest.mark.parametrize(
    ("wanted", "system", "component", "found"), [(7, 7, 1, True), (7, 1, 1, False), (1, 7, 1, False)]
)
def test_only_the_vehicle_with_the_system_asked_for_is_found(wanted, system, component, found):
    monitor = VehicleMonitor(system=wanted)
    monitor.receive(sent_by(BEAT, system, component), 0.0)
    assert monitor.is_present == found
    assert monitor.may_be((system, component)) == found


@pytest.mark.parametrize("name", ["", "P" * 17, "\u00c4", "\u00c4" * 16])
def test_a_name_that_does_not_fit_the_wire_is_no_parameter(name):
    with pytest.raises(LocalProtocolError, match="is not 1 to 16 ASCII characters"):
        ParameterClient(255, 190).set(VEHICLE, name, 1.0, 0.0)
    with pytest.raises(LocalProtocolError, match="is not 1 to 16 ASCII characters"):
        Parameter(name=name, type=REAL32, value=1.0)


@pytest.mark.parametrize("name", ["P", "P" * 16])
def test_a_name_has_up_to_16_characters(name):
    client = ParameterClient(255, 190)
    client.set(VEHICLE, name, 1.0, 0.0)
    assert [message.param_id for message in client.messages_to_send()] == [name]
    assert Parameter(name=name, type=REAL32, value=1.0).name == name


def test_the_current_item_has_16_bits():
    for seq in (-1, 0x10000):
        with pytest.raises(LocalProtocolError, match=f"mission item {seq} is not in 0..65535"):
            MissionClient(255, 190).set_current(VEHICLE, seq, 0.0)
    for seq in (0, 0xFFFF):
        client = MissionClient(255, 190)
        client.set_current(VEHICLE, seq, 0.0)
        assert [message.seq for message in client.messages_to_send()] == [seq]


def kept_alive(until):
    """A transfer that began at 0 with frames of the remote end all the time, and no progress."""
    remote = Remote()
    transfers = Retransmission(remote), RequestWindow(remote, range(3), 3, 0.0)
    transfers[0].start(0.0)
    remote.heard = until - 0.1
    return transfers


@pytest.mark.parametrize(("now", "over"), [(29.999, False), (30.0, True)])
def test_a_transfer_without_progress_ends_after_exactly_30_seconds(now, over):
    resend, window = kept_alive(now)
    assert window.is_over(now) == over
    assert resend.retry(now) != over


@pytest.mark.parametrize(("now", "over"), [(9.999, False), (10.0, True)])
def test_a_silent_remote_end_is_given_up_after_exactly_10_seconds(now, over):
    remote = Remote()
    remote.heard = 0.0
    window = RequestWindow(remote, range(3), 3, 0.0)
    assert window.is_over(now) == over


def test_a_mission_of_65535_items_can_be_changed_and_a_longer_one_cannot():
    items = plan(1) * 65535
    client = MissionClient(255, 190)
    client.write_items(VEHICLE, items, range(65534, 65535), 0.0)
    (message,) = client.messages_to_send()
    assert (message.start_index, message.end_index) == (65534, 65534)
    for wrong in (range(65534, 65536), range(3, 3), range(-1, 2)):
        with pytest.raises(LocalProtocolError, match="cannot be written"):
            MissionClient(255, 190).write_items(VEHICLE, items, wrong, 0.0)
    with pytest.raises(LocalProtocolError, match="of 65536 cannot be written"):
        MissionClient(255, 190).write_items(VEHICLE, (*items, items[0]), range(1), 0.0)


def test_only_the_items_to_be_changed_are_sent():
    client = MissionClient(255, 190)
    client.write_items(VEHICLE, plan(3), range(1, 2), 0.0)
    client.messages_to_send()
    for seq in (0, 1, 2):
        client.receive(mavlink.MAVLink_mission_request_int_message(255, 190, seq), 0.1)
    assert [message.seq for message in client.messages_to_send()] == [1]
