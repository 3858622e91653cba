"""Several vehicles on one link: each has a station of its own, and only one of them speaks for the operator's side."""

import io

import pytest

from darko_gcs.station.fleet import MAX_VEHICLES, Fleet
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.tlog import TlogWriter
from protocol.wire.codec import Codec
from tests.support.logs import bare

HEARTBEAT = mavlink.MAVLink_heartbeat_message(19, mavlink.MAV_AUTOPILOT_PX4, 0, 0, 4, 3)


class Ground:
    """A fleet's stations; what they send is decoded as the vehicles would."""

    def __init__(self):
        self.log = io.BytesIO()
        self.lead = Station(TlogWriter(self.log))
        self.fleet = Fleet(self.lead)
        self.codec, self.now, self.sequence = Codec(1, 1), 1.0, {}

    def hear(self, system, message=HEARTBEAT):
        sequence = self.sequence[system] = (self.sequence.get(system, -1) + 1) % 256
        return self.lead.receive(bare(message, system=system, sequence=sequence), self.now, round(self.now * 1e6))

    def sent(self):
        self.lead.tick(self.now)
        return [m for data in self.lead.outgoing(self.now, round(self.now * 1e6)) for m in self.codec.decode(data)]


@pytest.fixture
def ground():
    made = Ground()
    for system in (3, 1, 7):
        made.hear(system)
    return made


def test_every_vehicle_that_is_heard_has_a_station_and_the_first_is_active(ground):
    assert list(ground.fleet.stations) == [1, 3, 7]
    assert ground.fleet.active is ground.lead
    assert ground.lead.snapshot.identity.source == (3, 1)
    assert "Vehicle 1 is on the link, too" in " ".join(line.text for line in ground.lead.snapshot.log.lines)


def test_each_vehicle_s_snapshot_knows_that_there_are_others(ground):
    assert {station.snapshot.session.vehicles for station in ground.fleet.every} == {3}
    assert Ground().lead.snapshot.session.vehicles == 1


def test_a_message_changes_the_snapshot_of_its_sender_alone(ground):
    ground.hear(7, mavlink.MAVLink_statustext_message(4, b"Wind is strong"))
    told = {n: [line.text for line in to.snapshot.log.lines] for n, to in ground.fleet.stations.items()}
    assert [n for n, texts in told.items() if "Wind is strong" in texts] == [7]


def test_a_request_goes_to_its_vehicle_and_its_answer_back_to_its_station(ground):
    ground.sent()
    ground.fleet.stations[7].arm(ground.now)
    orders = [m for m in ground.sent() if m.get_type() == "COMMAND_LONG" and m.command == 400]
    assert [order.target_system for order in orders] == [7]
    denied = mavlink.MAVLink_command_ack_message(400, mavlink.MAV_RESULT_DENIED, 0, 0, 255, 190)
    ground.hear(3, denied)
    ground.hear(7, denied)
    told = {n: " ".join(line.text for line in to.snapshot.log.lines) for n, to in ground.fleet.stations.items()}
    assert [n for n, text in told.items() if "denied" in text] == [7]


def test_one_heartbeat_a_second_and_one_sequence_however_many_vehicles(ground):
    beats = 0
    for _ in range(50):
        ground.now += 0.1
        for system in (3, 1, 7):
            ground.hear(system)
        beats += sum(m.get_type() == "HEARTBEAT" for m in ground.sent())
    assert 5 <= beats <= 6
    assert ground.codec.statistics.sources[255, 190].lost == 0


def test_a_vehicle_that_falls_silent_is_lost_alone(ground):
    for _ in range(50):
        ground.now += 0.1
        ground.hear(3)
        ground.hear(7)
        ground.sent()
    assert [n for n, to in ground.fleet.stations.items() if to.snapshot.link.lost] == [1]


def test_the_recording_has_the_frames_of_all_once(ground):
    ground.lead._recorder.flush()
    recorded = ground.log.getvalue()
    assert [recorded.count(bare(HEARTBEAT, system=n)) for n in (1, 3, 7)] == [1, 1, 1]


def test_the_next_vehicle_is_chosen_round_and_round(ground):
    chosen = []
    for step in (1, 1, 1, -1):
        ground.fleet.choose_next(step)
        chosen.append(ground.fleet.active.endpoint.vehicle[0])
    assert chosen == [7, 1, 3, 1]
    ground.fleet.choose(99)
    assert ground.fleet.active.endpoint.vehicle[0] == 1


def test_a_crowd_of_invented_vehicles_ends_somewhere(ground):
    for system in range(1, 250):
        ground.hear(system)
    assert len(ground.fleet.stations) == MAX_VEHICLES


def test_another_ground_station_is_no_vehicle(ground):
    ground.hear(254, mavlink.MAVLink_heartbeat_message(6, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3))
    assert 254 not in ground.fleet.stations
