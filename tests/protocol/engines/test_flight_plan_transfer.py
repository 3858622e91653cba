"""Flight plan client and server over bad links: the table arrives, and stays the vehicle's."""

import pytest

from protocol.dialect import mavlink
from protocol.engines.client.flight_plan_client import MAX_OPEN_ENTRY_REQUESTS, FlightPlanClient
from protocol.engines.server.flight_plan_server import FlightPlanServer
from protocol.engines.table_values import EVENTS_KEPT, MAX_ENTRIES, changing_part
from protocol.events import FlightPlanFailed, FlightPlanReceived
from protocol.wire.codec import Codec
from protocol.wire.message import Peer
from tests.support.links.flight_plan_table import event, status, table, variable, waypoint
from tests.support.links.lossy_pipe import LossyPipe

GROUND = Peer(255, 190, "ground")
STATUS_PERIOD = 0.25  # [s]
BAD = {"drop": 0.3, "duplicate": 0.1, "reorder": 0.3, "delay": 0.05}


class PlanLink:
    """Both engines with a link that loses; the vehicle sends its status four times a second."""

    def __init__(self, seed=0, entries=None, **losses):
        self.server, self.client = FlightPlanServer(1, 1), FlightPlanClient()
        self.server.load(table() if entries is None else entries)
        self.up, self.down = LossyPipe(seed, **losses), LossyPipe(seed + 1000, **losses)
        self.vehicle, self.ground = Codec(1, 1), Codec(255, 190)
        self.now, self.events, self.held, self.happened = 0.0, [], {}, []
        self.requests = 0

    def publish(self, message):
        self.down.send(self.vehicle.encode(message), self.now)

    def run(self, seconds):
        for _ in range(round(seconds / STATUS_PERIOD)):
            told = status()
            self.server.mark(told)
            self.publish(told)
            end = self.now + STATUS_PERIOD
            while self.now < end:
                self._exchange()
                self.now = round(self.now + 0.01, 9)

    def _exchange(self):
        for data in self.up.receive(self.now):
            for message in self.vehicle.decode(data):
                self.server.receive(message, self.now, GROUND)
        for outgoing in self.server.messages_to_send():
            self.publish(outgoing.message)
        for data in self.down.receive(self.now):
            for message in self.ground.decode(data):
                self._hear(message)
        self.client.handle_timer(self.now)
        for message in self.client.messages_to_send():
            self.requests += 1
            self.up.send(self.ground.encode(message), self.now)
        self.events += self.client.events()

    def _hear(self, message):
        self.client.receive(message, self.now)
        if message.get_type() == "DARKO_PLAN_EVENT":
            self.happened.append(message.number)
        elif message.get_type() != "DARKO_PLAN_STATUS":
            self.held[message.entry] = message

    def is_as_on_vehicle(self):
        own = self.server._entries
        return self.held.keys() == own.keys() and all(
            changing_part(self.held[number]) == changing_part(own[number]) for number in own
        )


@pytest.mark.parametrize("seed", range(4))
def test_the_table_arrives_over_a_link_that_loses_30_percent(seed):
    link = PlanLink(seed, **BAD)
    link.run(20.0)
    assert link.events == [FlightPlanReceived(link.server.plan_id, 31)]
    assert link.is_as_on_vehicle()
    assert not link.client.is_busy


def test_on_a_good_link_every_entry_is_requested_once():
    link = PlanLink(delay=0.02)
    link.run(2.0)
    assert (link.requests, link.is_as_on_vehicle()) == (31, True)


def test_several_entries_are_requested_at_a_time():
    client, told = FlightPlanClient(), status()
    server = FlightPlanServer(1, 1)
    server.load(table(blocks=80))
    server.mark(told)
    client.receive(arrived(told), 0.0)
    assert len(client.messages_to_send()) == MAX_OPEN_ENTRY_REQUESTS
    assert client.is_busy


@pytest.mark.parametrize("seed", range(4))
def test_changes_whose_notice_is_lost_arrive_nevertheless(seed):
    link = PlanLink(seed, **BAD)
    link.run(15.0)
    for step in range(5):
        moved = link.server.update([waypoint(3, 0.1 * step + 0.1), variable(2, step + 2.0)])
        assert len(moved) == 2
        for entry in moved:
            link.publish(entry)
        link.run(0.5)
    link.run(15.0)
    assert link.is_as_on_vehicle()
    assert link.held[14].x == pytest.approx(0.5)


def test_what_did_not_change_is_not_sent_again():
    server = FlightPlanServer(1, 1)
    server.load(table())
    assert server.update([waypoint(1), variable(1)]) == []


@pytest.mark.parametrize("seed", range(4))
def test_events_that_were_lost_are_fetched(seed):
    link = PlanLink(seed, **BAD)
    link.run(10.0)
    for number in range(8):
        link.publish(link.server.tell(event(f"x > {number}")))
        link.run(0.25)
    link.run(10.0)
    assert set(link.happened) == set(range(1, 9))


def test_a_station_that_comes_late_gets_the_newest_events():
    link = PlanLink()
    for number in range(EVENTS_KEPT + 10):
        link.server.tell(event(str(number)))
    link.run(3.0)
    assert sorted(link.happened) == list(range(11, EVENTS_KEPT + 11))


def test_another_plan_is_downloaded_anew():
    link = PlanLink()
    link.run(1.0)
    first = link.server.plan_id
    link.server.load(table(blocks=2, waypoints=4))
    link.held.clear()
    link.run(1.0)
    assert link.server.plan_id != first
    assert link.events[-1] == FlightPlanReceived(link.server.plan_id, 10)
    assert link.is_as_on_vehicle()


def test_a_station_that_forgets_downloads_again():
    link = PlanLink()
    link.run(1.0)
    link.client.cancel("the vehicle restarted")
    link.held.clear()
    link.run(1.0)
    assert link.is_as_on_vehicle()
    link.client.request_again()
    link.held.clear()
    link.run(1.0)
    assert link.is_as_on_vehicle()


def test_a_vehicle_that_answers_nothing_is_given_up_and_left_in_peace():
    link = PlanLink()
    link.server.receive = lambda *_: None
    link.run(15.0)
    assert link.events == [FlightPlanFailed("31 entries missing")]
    sent = link.requests
    link.run(10.0)
    assert link.requests == sent


def arrived(message):
    (decoded,) = Codec(255, 190).decode(Codec(1, 1).encode(message))
    return decoded


def requested(number, part=mavlink.DARKO_PLAN_PART_ENTRY, to=(1, 1)):
    return mavlink.MAVLink_darko_plan_request_message(*to, number, part)


@pytest.mark.parametrize(
    "message",
    [requested(31), requested(65535), requested(0, part=7), requested(1, part=1), requested(0, to=(9, 1))],
    ids=["behind the end", "far away", "unknown part", "no such event", "another vehicle"],
)
def test_what_there_is_not_is_not_answered(message):
    server = FlightPlanServer(1, 1)
    server.load(table())
    server.receive(message, 0.0, GROUND)
    assert server.messages_to_send() == []


def test_without_a_plan_nothing_is_answered():
    server, told = FlightPlanServer(1, 1), status()
    server.receive(requested(0), 0.0, GROUND)
    server.mark(told)
    assert (server.messages_to_send(), told.plan_id, told.entries) == ([], 0, 0)


@pytest.mark.parametrize("count", [0, MAX_ENTRIES + 1, 65535])
def test_a_table_without_entries_or_with_too_many_is_not_requested(count):
    client, told = FlightPlanClient(), status()
    told.plan_id, told.entries = 5, count
    client.receive(arrived(told), 0.0)
    assert client.messages_to_send() == []


def test_entries_of_another_plan_or_place_count_for_nothing():
    client, told = FlightPlanClient(), status()
    told.plan_id, told.entries = 5, 1
    client.receive(arrived(told), 0.0)
    for plan_id, place in ((6, 0), (5, 1), (5, 65535)):
        entry = waypoint(1)
        entry.plan_id, entry.entry = plan_id, place
        client.receive(arrived(entry), 0.1)
    assert client.is_busy
    assert client.events() == []


def test_a_vehicle_keeps_the_newest_32_events():
    server = FlightPlanServer(1, 1)
    server.load(table())
    for number in range(40):
        server.tell(event(str(number)))
    assert EVENTS_KEPT == 32
    answered = []
    for number in range(1, 42):
        server.receive(requested(number, part=1), 0.0, GROUND)
        answered += [number] if server.messages_to_send() else []
    assert answered == list(range(9, 41))


def test_events_are_numbered_up_to_65535_and_then_from_1():
    server, happened = FlightPlanServer(1, 1), event()
    numbers = [server.tell(happened).number for _ in range(65537)]
    assert numbers[:2] + numbers[-3:] == [1, 2, 65535, 1, 2]
