"""Either side of the link dies and comes back: what the ground station knows, says and asks again."""

import io
import random

import pytest

from darko_gcs.acquaintance import Acquaintance
from darko_gcs.signing import TimeFile, open_keyring
from darko_gcs.station import Station
from protocol.errors import FileError
from protocol.events import (
    MissionDownloaded,
    MissionFailed,
    MissionUploaded,
    ParametersComplete,
    VehicleLost,
    VehicleRestarted,
)
from protocol.keyring import KeyRecord, Keyring
from protocol.modes import Mode
from protocol.plans import load
from protocol.tlog import TlogReader, TlogWriter
from tests.support.ground import PEER, Ground
from tests.support.paths import DATA
from tests.support.signed_ground import KEY, SignedGround, T

STEP = 0.02  # [s]
SQUARE = load(DATA / "square.plan").items
SHORT = SQUARE[:3]


class World:
    """One link, and on each end something that can die at any moment and be started again."""

    def __init__(self, folder):
        self.folder, self.now, self.events = folder, 1.0, []
        self.vehicle = self.station = None
        self.start_vehicle()
        self.start_station()

    def start_vehicle(self, *, airborne=False):
        self.vehicle = Ground(self.folder, airborne=airborne).node

    def kill_vehicle(self):
        self.vehicle = None

    def start_station(self):
        self.log = io.BytesIO()
        self.station = Station(TlogWriter(self.log))
        self.acquaintance = Acquaintance(self.station)

    def run(self, seconds, until=lambda: False):
        """Let time pass; true if it ended early because something held."""
        for _ in range(round(seconds / STEP)):
            self.now += STEP
            usec = round(self.now * 1e6)
            if self.vehicle is not None:
                self.vehicle.advance(10)
                for _, data in self.vehicle.datagrams(self.now):
                    self.station.receive(data, self.now, usec)
            self.station.tick(self.now)
            events = self.station.events()
            self.acquaintance.follow(events, self.now)
            self.events += events
            for data in self.station.outgoing(self.now, usec):
                if self.vehicle is not None:
                    self.vehicle.receive(data, PEER, self.now)
            if until():
                return True
        return False

    def heard(self, kind):
        return [event for event in self.events if isinstance(event, kind)]

    @property
    def shown(self):
        return self.station.snapshot

    @property
    def said(self):
        return [line.text for line in self.shown.messages]


@pytest.fixture
def world(tmp_path):
    made = World(tmp_path)
    made.run(2.0)
    made.station.upload(SQUARE, made.now)
    assert made.run(2.0, until=lambda: made.heard(MissionUploaded))
    return made


def test_a_vehicle_that_dies_and_starts_anew_is_lost_found_and_asked_again(world):
    world.start_vehicle(airborne=True)
    world.station.fetch_parameters(world.now)
    world.run(6.0)
    before = world.shown
    world.kill_vehicle()
    world.run(4.0)
    assert world.shown.lost
    world.start_vehicle()
    world.run(3.0)
    after = world.shown
    assert not after.lost
    assert "Vehicle lost: silent for 3 s" in world.said
    assert world.said.count("The vehicle restarted") == 2
    assert after.boot < before.boot
    assert after.mission == SQUARE
    assert len(world.heard(ParametersComplete)) == 2
    assert after.parameters == before.parameters
    assert len(after.parameters) == after.parameter_count
    assert after.home is not None
    assert max(point[0] for point in after.v_history) < 3.2
    assert len(after.track) == 1
    assert after.armed is False


def test_a_plan_that_another_ground_station_sends_is_shown(world):
    other = Station()
    deliver = world.vehicle.datagrams

    def datagrams(now):  # those of the other one go to it, and what it has to say comes back
        for peer, data in deliver(now):
            if peer == "other":
                other.receive(data, now, 0)
            else:
                yield peer, data
        other.tick(now)
        for data in other.outgoing(now, 0):
            world.vehicle.receive(data, "other", now)

    world.vehicle.datagrams = datagrams
    world.run(3.0)
    other.upload(SHORT, world.now)
    assert world.run(4.0, until=lambda: world.shown.mission == SHORT)
    asked = len(world.heard(MissionDownloaded))
    world.run(5.0)
    assert len(world.heard(MissionDownloaded)) <= asked + 2  # its fence and rally points, and then no more


def test_own_plans_are_not_fetched_back(world):
    world.run(3.0)
    asked = len(world.heard(MissionDownloaded))
    world.station.upload(SHORT, world.now)
    world.run(5.0)
    world.station.clear_plan(0, world.now)
    world.run(5.0)
    assert len(world.heard(MissionDownloaded)) == asked


def test_a_restart_too_quick_for_a_loss_is_noticed_by_the_time_since_boot(world):
    world.station.fetch_parameters(world.now)
    world.run(2.0)
    world.start_vehicle()
    world.run(1.0)
    assert len(world.heard(VehicleRestarted)) == 1
    assert world.heard(VehicleLost) == []
    assert world.run(3.0, until=lambda: len(world.heard(ParametersComplete)) == 2)
    assert world.shown.mission == SQUARE


def test_parameters_that_nobody_looked_at_are_not_asked_for(world):
    world.run(2.0)
    world.start_vehicle()
    world.run(3.0)
    assert world.heard(ParametersComplete) == []
    assert world.shown.parameters == {}


def test_the_recording_of_both_lives_is_one_log_without_damage(world):
    world.start_vehicle()
    world.run(3.0)
    world.station._recorder.flush()
    reader = TlogReader(world.log.getvalue())
    boots = reader.columns("ATTITUDE")["time_boot_ms"].astype(int)
    assert not reader.damage
    assert not len(reader.backward)
    assert (boots[1:] < boots[:-1]).sum() == 1


def test_an_upload_whose_vehicle_starts_anew_ends_in_words_and_can_be_repeated(world):
    world.station.upload(SHORT, world.now)
    world.run(STEP)  # under way
    world.start_vehicle()
    assert world.run(2.0, until=lambda: world.heard(MissionFailed))
    assert "Mission upload failed: the vehicle restarted" in world.said
    assert world.shown.transfer is None
    assert world.run(3.0, until=lambda: world.shown.mission == SQUARE)  # it kept the old plan, and says so
    world.station.upload(SHORT, world.now)
    assert world.run(2.0, until=lambda: world.shown.mission == SHORT)


def test_a_second_upload_that_is_refused_is_not_taken_for_the_first(world):
    world.station.upload(SHORT, world.now)
    world.station.upload(SQUARE, world.now)
    assert world.run(2.0, until=lambda: len(world.heard(MissionUploaded)) == 2)
    assert world.shown.mission == SHORT


def test_a_command_under_way_is_given_up_when_the_vehicle_starts_anew(world):
    vehicle, world.vehicle = world.vehicle, None
    world.station.arm(world.now)
    world.run(0.1)
    del vehicle
    world.start_vehicle()
    world.run(1.5)
    assert "component arm disarm: the vehicle restarted" in world.said
    assert world.shown.armed is False


def fly_the_square(world):
    world.station.arm(world.now)
    world.run(0.5)
    world.station.start_mission(world.now)
    assert world.run(20.0, until=lambda: world.shown.mission_current == 2)


def test_a_ground_station_that_starts_anew_shows_the_mission_under_way(world):
    fly_the_square(world)
    world.start_station()
    assert world.run(3.0, until=lambda: world.shown.mission == SQUARE and world.shown.home is not None)
    assert (world.shown.mode, world.shown.armed) == (Mode.MISSION.name, True)
    assert (world.shown.mission_current, world.shown.mission_count, world.shown.mission_state) == (2, len(SQUARE), 3)
    assert world.run(20.0, until=lambda: 2 in world.shown.reached)


def test_what_a_killed_ground_station_recorded_is_read_up_to_its_last_whole_record(world):
    world.run(1.0)
    world.station._recorder.flush()
    whole = world.log.getvalue()
    ends = [*TlogReader(whole).offsets.tolist(), len(whole)]
    for cut in random.Random(3).sample(range(len(whole) // 2, len(whole)), 40):
        reader = TlogReader(whole[:cut])
        assert len(reader) == sum(end <= cut for end in ends[1:])
        assert {piece.what for piece in reader.damage} <= {"record cut short by the end of the file", "zeros"}


def test_an_upload_whose_ground_station_dies_leaves_the_old_plan_and_the_next_one_works(world):
    world.station.upload(SHORT, world.now)
    world.run(STEP)
    world.start_station()
    assert world.run(4.0, until=lambda: world.shown.mission == SQUARE)
    world.station.upload(SHORT, world.now)
    assert world.run(4.0, until=lambda: world.shown.mission == SHORT)


class SignedPair:
    """A station and a vehicle with one key, each with its own wall clock when it starts."""

    def __init__(self, folder):
        self.folder, self.now, self.file = folder, 1.0, TimeFile(folder / "time")

    def start_vehicle(self, clock):
        self.vehicle = SignedGround(self.folder, given={None: KEY}, clock=clock).node

    def start_station(self, clock):
        started = max(clock, self.file.load())
        keep = lambda record: self.file.save(record.timestamp)  # noqa: E731
        self.station = Station(keyring=Keyring({None: KEY}, timestamp=started, now=self.now, floor=started, keep=keep))

    def run(self, seconds):
        for _ in range(round(seconds / STEP)):
            self.now += STEP
            self.vehicle.advance(10)
            for _, data in self.vehicle.datagrams(self.now):
                self.station.receive(data, self.now, 0)
            self.station.tick(self.now)
            for data in self.station.outgoing(self.now, 0):
                self.vehicle.receive(data, PEER, self.now)

    def is_obeyed(self):
        """Whether an order of the station reaches the vehicle, and its answer the station."""
        self.station.hold(self.now)
        self.run(1.0)
        return any(line.text.startswith("do set mode: ") for line in self.station.snapshot.messages)


HOUR = 3600 * 10**5


@pytest.mark.parametrize("vehicle_clock", [T - HOUR, T + HOUR])
@pytest.mark.parametrize("station_clock", [T - HOUR, T + HOUR])
def test_signed_both_sides_understand_each_other_after_restarts_whatever_their_clocks_do(
    tmp_path, station_clock, vehicle_clock
):
    pair = SignedPair(tmp_path)
    pair.start_vehicle(T)
    pair.start_station(T)
    pair.run(2.0)
    assert pair.is_obeyed()
    pair.start_station(station_clock)
    pair.run(2.5)
    assert pair.is_obeyed()
    pair.start_vehicle(vehicle_clock)
    pair.run(2.5)
    assert pair.is_obeyed()


def test_signing_time_never_goes_back_over_a_start_with_a_clock_that_did(tmp_path):
    file = TimeFile(tmp_path / "gcs" / "signing-time")
    key = KEY.hex()
    last = open_keyring(key, kept=file.path).next_timestamp()
    file.save(last + 1000 * HOUR)
    assert open_keyring(key, kept=file.path).next_timestamp() > last + 1000 * HOUR
    file.save(last)  # another ground station, behind this one
    assert file.load() >= last + 1000 * HOUR


@pytest.mark.parametrize("content", ["", "soon", "-1", str(1 << 48)])
def test_a_kept_time_that_is_none_is_refused_by_name(tmp_path, content):
    (tmp_path / "time").write_text(content)
    with pytest.raises(FileError, match=r"time: no signing time \(delete the file"):
        TimeFile(tmp_path / "time").load()


def test_a_signing_time_that_cannot_be_kept_is_said_once_and_the_link_goes_on(tmp_path):
    (tmp_path / "taken").write_text("")

    def keep(record: KeyRecord) -> None:
        TimeFile(tmp_path / "taken" / "time").save(record.timestamp)

    station = Station(keyring=Keyring({None: KEY}, timestamp=T, now=0.0, keep=keep))
    for second in range(60):
        station.tick(float(second))
    said = [line.text for line in station.snapshot.messages]
    assert len(said) == 1
    assert said[0].startswith("Signing time not kept: ")
    assert "taken" in said[0]
