"""The ground station beside hostile senders: it shows its own vehicle, and its memory is bounded."""

import random

import pytest

from darko_gcs.state.message_log import MAX_LINES
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.station.station import MAX_OTHER_VEHICLES, Station
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.map_panel import MapPanel
from darko_gcs.tui.widgets.flight_panel import DecisionPanel, FlightPanel
from darko_gcs.tui.widgets.hybrid_panel import ActuatorPanel, AttitudePanel, HybridPanel
from darko_gcs.tui.widgets.panel import MessagePanel
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from protocol.events import MissionDownloaded, MissionUploaded, ParametersComplete
from protocol.plans import load
from protocol.tlog import TlogReader
from protocol.wire.codec import MAX_COUNTED_SOURCES, Codec
from sitl.vehicle.parameters import WorldSettings
from tests.support.gcs.linked_station import STEP, LinkedStation
from tests.support.gcs.messages import heartbeat, text
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import values_of
from tests.support.links.flood import VEHICLE, Flood, framed, random_payload
from tests.support.paths import DATA

SECONDS, PER_STEP = 8.0, 20
# Fields of the snapshot that count the frames of all senders, or report other vehicles.
LINK_FIELDS = {"link.received", "link.rate", "link.loss", "log.lines"}
SQUARE = load(DATA / "square.plan").items


class FloodedLink(LinkedStation):
    """A station on a real vehicle in the air, and a hostile sender on the same link."""

    flood = None

    def arriving(self):
        hostile = [self.flood.datagram() for _ in range(PER_STEP)] if self.flood else []
        return [*hostile, *super().arriving()]


def fly(folder, flood=None):
    """A link after 8 s with an upload, a download and a fetch of the parameters."""
    link = FloodedLink(folder, up=3.0, world_settings=WorldSettings(gusts=0.5))
    link.run(0.1)  # our vehicle is the first that is heard
    link.flood = flood
    link.run(1.0)
    link.station.plans.upload(SQUARE, link.now)
    link.run(1.0)
    link.station.plans.download(link.now)
    link.station.fetch_parameters(link.now)
    link.run(SECONDS - 2.0)
    return link


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    """The same flight twice, the second time under the flood."""
    quiet = fly(tmp_path_factory.mktemp("quiet"))
    return quiet, fly(tmp_path_factory.mktemp("flooded"), Flood(7, upwards=False))


@pytest.mark.long
def test_the_flood_changes_no_bit_of_the_snapshot(flights):
    quiet, flooded = (link.snapshot for link in flights)
    assert flights[1].flood.counts.total() > SECONDS / STEP * PER_STEP
    flooded = values_of(flooded)
    for name, value in values_of(quiet).items():
        assert name in LINK_FIELDS or repr(flooded[name]) == repr(value), name  # "nan" is equal to itself


@pytest.mark.long
def test_the_flood_adds_one_line_about_the_other_vehicle_to_the_log(flights):
    quiet, flooded = (link.lines for link in flights)
    added = [line for line in flooded if line not in quiet]
    assert added == ["Another vehicle, 7/1, is on the link: it is not shown"]
    assert [line for line in flooded if line in quiet] == quiet


@pytest.mark.long
def test_transfers_succeed_under_the_flood(flights):
    _, flooded = flights
    assert {MissionUploaded, MissionDownloaded, ParametersComplete} <= {type(event) for event in flooded.events}
    assert flooded.snapshot.plans.mission == SQUARE


@pytest.mark.long
def test_the_recording_holds_no_garbage(flights):
    quiet, flooded = (TlogReader(link.recording()) for link in flights)
    assert not flooded.damage
    assert flooded.known.all()
    assert (flooded.systems == 1).sum() == (quiet.systems == 1).sum()
    assert set(flooded.systems.tolist()) == {1, 7, 255}


def test_thousands_of_other_vehicles_fill_no_table():
    station, alive = Station(), heartbeat(armed=True)
    station.receive(Codec(1, 1).encode(alive), 0.0, 0)
    for number in range(2000):
        codec = Codec(2 + number % 250, 1 + number // 250)
        words = text(b"%d" % number, severity=0, number=number % 7, chunk=number % 3)
        for message in (alive, words):
            station.receive(codec.encode(message), 0.001 * number, 0)
    assert station.snapshot.identity.source == station.endpoint.vehicle == VEHICLE
    assert len(station.endpoint.codec.statistics.sources) <= MAX_COUNTED_SOURCES
    assert len(station.snapshot.log.lines) == 1 + MAX_OTHER_VEHICLES
    assert len(station.events()) == 1


def test_another_vehicle_does_not_replace_a_silent_one():
    station, alive = Station(), heartbeat(armed=True)
    station.receive(Codec(1, 1).encode(alive), 0.0, 0)
    station.tick(5.0)
    assert station.snapshot.link.lost
    assert not station.receive(Codec(7, 1).encode(alive), 5.1, 0)  # no answers go there either
    assert station.snapshot.link.lost
    assert station.receive(Codec(1, 1).encode(alive), 6.0, 0)
    assert (station.snapshot.link.lost, station.endpoint.vehicle) == (False, VEHICLE)


def test_a_vehicle_that_is_asked_for_is_waited_for():
    station, alive = Station(vehicle=1), heartbeat(armed=True)
    assert not station.receive(Codec(7, 1).encode(alive), 0.0, 0)
    assert station.snapshot.identity.source is station.endpoint.vehicle is None
    assert station.snapshot.log.lines[-1].text == "Another vehicle, 7/1, is on the link: it is not shown"
    assert station.receive(Codec(1, 1).encode(alive), 1.0, 0)
    assert station.snapshot.identity.source == station.endpoint.vehicle == VEHICLE


def test_a_vehicle_that_sends_many_texts_fills_no_log():
    station, codec = Station(), Codec(1, 1)
    station.receive(codec.encode(heartbeat(armed=True)), 0.0, 0)
    for number in range(3000):
        words = text(b"x" * 50, severity=6, number=number % 3, chunk=number % 256)
        station.receive(codec.encode(words), 0.0, 0)
    assert len(station.snapshot.log.lines) == MAX_LINES
    assert max(len(line.text) for line in station.snapshot.log.lines) <= 256 * 50


PANELS = (HybridPanel, ActuatorPanel, AttitudePanel, MapPanel, FlightPanel, DecisionPanel, MessagePanel)


def nonsense(seed, count):
    """Frames with the vehicle's ids and right checksums whose numbers may be anything."""
    draw = random.Random(seed)
    kinds = sorted(mavlink.mavlink_map)
    for number in range(count):
        known = mavlink.mavlink_map[draw.choice(kinds)]
        yield framed(known, random_payload(draw, known), number % 256, VEHICLE)


@pytest.mark.long
def test_well_formed_nonsense_from_the_vehicle_is_drawn_without_an_error():
    station = Station()
    panels = [StatusBar(), *(panel("", id="p") for panel in PANELS)]
    for number, data in enumerate(nonsense(5, 6000)):
        station.receive(data, 0.02 * number, 0)
        if number % 10 == 0:
            station.tick(0.02 * number)
            for panel in panels:
                panel.draw(station.snapshot, 60, 20)
    assert station.snapshot.identity.source == VEHICLE


@pytest.mark.long
async def test_the_screens_survive_nonsense_and_show_the_next_flight(flights):
    station, feed = Station(), FakeFeed(EMPTY_SNAPSHOT)
    app = GroundStationApp(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        for number, data in enumerate(nonsense(6, 1500)):
            station.receive(data, 0.02 * number, 0)
            if number % 50 == 0:
                feed.snapshot, feed.now = station.snapshot, 0.02 * number
                app.pull()
                await pilot.pause()
        feed.snapshot, feed.now = flights[1].snapshot, flights[1].now
        await until(pilot, lambda: " vehicle 1 " in screen_text(app) and "HOVER LINEAR" in screen_text(app))
