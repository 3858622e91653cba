"""The ground station beside strangers: what it shows is its vehicle's, and what it keeps is bounded."""

import io
import random
from dataclasses import fields

import pytest

from darko_gcs.app import GroundStation
from darko_gcs.snapshot import EMPTY
from darko_gcs.station import MOST_OTHERS, Station
from darko_gcs.store import KEPT_LINES
from darko_gcs.widgets.map import MapPanel
from darko_gcs.widgets.numbers import DecisionPanel, FlightPanel
from darko_gcs.widgets.panels import ActuatorPanel, AttitudePanel, HybridPanel, MessagePanel
from darko_gcs.widgets.status import StatusBar
from protocol.codec import MOST_SOURCES, Codec
from protocol.dialect import mavlink
from protocol.events import MissionDownloaded, MissionUploaded, ParametersComplete
from protocol.plans import load
from protocol.tlog import TlogReader, TlogWriter
from tests.darko_gcs.screens import FakeFeed, screen_text, until
from tests.support.flood import VEHICLE, Flood, framed, random_payload
from tests.support.ground import PEER, Ground
from tests.support.paths import DATA

STEP = 0.02  # [s]
SECONDS, PER_STEP = 8.0, 20
LINK = {"received", "rate", "loss", "messages"}  # of the snapshot: they count everybody's frames, or tell of others


class Flown:
    """A station beside a real vehicle in the air, and whoever else sends to it."""

    def __init__(self, folder, flood=None):
        self.vehicle, self.flood = Ground(folder, airborne=True, gusts=0.5).node, None
        self.log = io.BytesIO()
        self.station = Station(TlogWriter(self.log))
        self.now, self.events = 1.0, []
        self.run(0.1)  # the first vehicle that is heard is ours
        self.flood = flood
        self.run(1.0)
        self.station.upload(load(DATA / "square.plan").items, self.now)
        self.run(1.0)
        self.station.download(self.now)
        self.station.fetch_parameters(self.now)
        self.run(SECONDS - 2.0)

    def run(self, seconds):
        for _ in range(round(seconds / STEP)):
            self.vehicle.advance(10)
            self.now += STEP
            hostile = [self.flood.datagram() for _ in range(PER_STEP)] if self.flood else []
            for data in [*hostile, *(data for _, data in self.vehicle.datagrams(self.now))]:
                self.station.receive(data, self.now, round(self.now * 1e6))
            self.station.tick(self.now)
            for data in self.station.outgoing(self.now, round(self.now * 1e6)):
                self.vehicle.receive(data, PEER, self.now)
        self.events += self.station.events()


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    """The same flight twice, the second one with the station under the flood."""
    quiet = Flown(tmp_path_factory.mktemp("quiet"))
    return quiet, Flown(tmp_path_factory.mktemp("flooded"), Flood(7, upwards=False))


def test_what_is_shown_is_bit_for_bit_what_is_shown_without_the_flood(flights):
    quiet, flooded = (flown.station.snapshot for flown in flights)
    assert flights[1].flood.counts.total() > SECONDS / STEP * PER_STEP
    for name in {field.name for field in fields(quiet)} - LINK:
        assert repr(getattr(flooded, name)) == repr(getattr(quiet, name)), name  # NaN's name is equal to itself


def test_what_is_said_is_the_same_but_for_one_line_about_the_stranger(flights):
    quiet, flooded = ([line.text for line in flown.station.snapshot.messages] for flown in flights)
    others = [text for text in flooded if text not in quiet]
    assert others == ["Another vehicle, 7/1, is on the link: it is not shown"]
    assert [text for text in flooded if text in quiet] == quiet


def test_transfers_go_through_beneath_the_flood(flights):
    _, flooded = flights
    assert {MissionUploaded, MissionDownloaded, ParametersComplete} <= {type(event) for event in flooded.events}
    assert flooded.station.snapshot.mission == load(DATA / "square.plan").items


def test_the_recording_holds_no_garbage(flights):
    quiet, flooded = flights
    for flown in flights:
        flown.station._recorder.flush()
    reader, alone = TlogReader(flooded.log.getvalue()), TlogReader(quiet.log.getvalue())
    assert not reader.damage
    assert reader.known.all()
    assert (reader.systems == 1).sum() == (alone.systems == 1).sum()
    assert set(reader.systems.tolist()) == {1, 7, 255}


def test_strangers_in_many_names_fill_no_table():
    station, alive = Station(), mavlink.MAVLink_heartbeat_message(19, 12, 0x81, 0, 4, 3)
    station.receive(Codec(1, 1).encode(alive), 0.0, 0)
    for number in range(2000):
        name = (2 + number % 250, 1 + number // 250)
        said = mavlink.MAVLink_statustext_message(0, b"%d" % number, number % 7, number % 3)
        for message in (alive, said):
            station.receive(Codec(*name).encode(message), 0.001 * number, 0)
    assert station.snapshot.source == station.endpoint.vehicle == VEHICLE
    assert len(station.endpoint.codec.statistics.sources) <= MOST_SOURCES
    assert len(station.snapshot.messages) == 1 + MOST_OTHERS
    assert len(station.events()) == 1


def test_a_stranger_takes_no_silent_vehicles_place():
    station, alive = Station(), mavlink.MAVLink_heartbeat_message(19, 12, 0x81, 0, 4, 3)
    station.receive(Codec(1, 1).encode(alive), 0.0, 0)
    station.tick(5.0)
    assert station.snapshot.lost
    assert not station.receive(Codec(7, 1).encode(alive), 5.1, 0)  # answers do not go there either
    assert station.snapshot.lost
    assert station.receive(Codec(1, 1).encode(alive), 6.0, 0)
    assert (station.snapshot.lost, station.endpoint.vehicle) == (False, VEHICLE)


def test_the_vehicle_that_is_asked_for_is_waited_for_whoever_speaks_first():
    station, alive = Station(vehicle=1), mavlink.MAVLink_heartbeat_message(19, 12, 0x81, 0, 4, 3)
    assert not station.receive(Codec(7, 1).encode(alive), 0.0, 0)
    assert station.snapshot.source is station.endpoint.vehicle is None
    assert station.snapshot.messages[-1].text == "Another vehicle, 7/1, is on the link: it is not shown"
    assert station.receive(Codec(1, 1).encode(alive), 1.0, 0)
    assert station.snapshot.source == station.endpoint.vehicle == VEHICLE


def test_a_vehicle_that_says_much_fills_no_log_of_lines():
    station, codec = Station(), Codec(1, 1)
    station.receive(codec.encode(mavlink.MAVLink_heartbeat_message(19, 12, 0x81, 0, 4, 3)), 0.0, 0)
    for number in range(3000):
        text = mavlink.MAVLink_statustext_message(6, b"x" * 50, number % 3, number % 256)
        station.receive(codec.encode(text), 0.0, 0)
    assert len(station.snapshot.messages) == KEPT_LINES
    assert max(len(line.text) for line in station.snapshot.messages) <= 256 * 50


PANELS = (HybridPanel, ActuatorPanel, AttitudePanel, MapPanel, FlightPanel, DecisionPanel, MessagePanel)


def nonsense(seed, count):
    """Frames in the vehicle's name whose checksums are right and whose numbers may be anything."""
    draw = random.Random(seed)
    kinds = sorted(mavlink.mavlink_map)
    for number in range(count):
        known = mavlink.mavlink_map[draw.choice(kinds)]
        yield framed(known, random_payload(draw, known), number % 256, VEHICLE)


def test_well_formed_nonsense_in_the_vehicles_name_is_drawn_without_complaint():
    station = Station()
    panels = [StatusBar(), *(panel("", id="p") for panel in PANELS)]
    for number, data in enumerate(nonsense(5, 6000)):
        station.receive(data, 0.02 * number, 0)
        if number % 10 == 0:
            station.tick(0.02 * number)
            for panel in panels:
                panel.draw(station.snapshot, 60, 20)
    assert station.snapshot.source == VEHICLE


async def test_the_screens_live_through_nonsense_and_come_back_to_the_flight(flights):
    station, feed = Station(), FakeFeed(EMPTY)
    app = GroundStation(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        for number, data in enumerate(nonsense(6, 1500)):
            station.receive(data, 0.02 * number, 0)
            if number % 50 == 0:
                feed.snapshot, feed.now = station.snapshot, 0.02 * number
                app.pull()
                await pilot.pause()
        feed.snapshot, feed.now = flights[1].station.snapshot, flights[1].now
        await until(pilot, lambda: " 1/1 " in screen_text(app) and "HOVER LINEAR" in screen_text(app))
