"""Either side of the link dies and starts again: what the ground station knows, shows and requests again."""

import random

import pytest

from darko_gcs.station.keyring_setup import SigningTimeFile
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.events import (
    MissionDownloaded,
    MissionFailed,
    MissionUploaded,
    ParametersComplete,
    VehicleLost,
    VehicleRestarted,
)
from protocol.names import Mode
from protocol.plans import load
from protocol.tlog import TlogReader
from tests.support.gcs.linked_station import STEP, LinkedStation
from tests.support.gcs.signed_link import SignedLink
from tests.support.paths import DATA
from tests.support.vehicle.signed_station import KEY, T

SQUARE = load(DATA / "square.plan").items
SHORT = SQUARE[:3]


@pytest.fixture
def link(tmp_path):
    linked = LinkedStation(tmp_path)
    linked.start_sync()
    linked.run(2.0)
    linked.station.plans.upload(SQUARE, linked.now)
    assert linked.run(2.0, until=lambda: linked.events_of(MissionUploaded))
    return linked


def restart_station(link):
    link.start_station()
    link.start_sync()


@pytest.mark.long
def test_a_vehicle_that_dies_and_starts_again_is_lost_found_and_synced_again(link):
    link.start_vehicle(up=3.0)
    link.station.fetch_parameters(link.now)
    link.run(6.0)
    before = link.snapshot
    link.stop_vehicle()
    link.run(4.0)
    assert link.snapshot.link.lost
    link.start_vehicle()
    link.run(3.0)
    after = link.snapshot
    assert not after.link.lost
    assert "Vehicle lost: silent for 3 s" in link.lines
    assert link.lines.count("The vehicle restarted") == 2
    assert after.link.boot < before.link.boot
    assert after.plans.mission == SQUARE
    assert len(link.events_of(ParametersComplete)) == 2
    assert after.parameters.values == before.parameters.values
    assert len(after.parameters.values) == after.parameters.total
    assert after.position.home is not None
    assert max(point[0] for point in after.hybrid.v_history) < 3.2
    assert len(after.position.track) == 1
    assert after.status.armed is False


@pytest.mark.long
def test_a_plan_from_another_ground_station_is_shown(link):
    other = Station()
    deliver = link.vehicle.datagrams

    def datagrams(now):  # those for the other station go to it, and its answers back
        for peer, data in deliver(now):
            if peer == "other":
                other.receive(data, now, 0)
            else:
                yield peer, data
        other.tick(now)
        for data in other.outgoing(now, 0):
            link.vehicle.receive(data, "other", now)

    link.vehicle.datagrams = datagrams
    link.run(3.0)
    other.plans.upload(SHORT, link.now)
    assert link.run(4.0, until=lambda: link.snapshot.plans.mission == SHORT)
    downloads = len(link.events_of(MissionDownloaded))
    link.run(5.0)
    assert len(link.events_of(MissionDownloaded)) <= downloads + 2  # fence and rally points, then no more


@pytest.mark.long
def test_our_own_plans_are_not_fetched_back(link):
    link.run(3.0)
    downloads = len(link.events_of(MissionDownloaded))
    link.station.plans.upload(SHORT, link.now)
    link.run(5.0)
    link.station.plans.clear(mavlink.MAV_MISSION_TYPE_MISSION, link.now)
    link.run(5.0)
    assert len(link.events_of(MissionDownloaded)) == downloads


def test_a_restart_too_quick_for_a_loss_is_noticed_by_the_time_since_boot(link):
    link.station.fetch_parameters(link.now)
    link.run(2.0)
    link.start_vehicle()
    link.run(1.0)
    assert len(link.events_of(VehicleRestarted)) == 1
    assert link.events_of(VehicleLost) == []
    assert link.run(3.0, until=lambda: len(link.events_of(ParametersComplete)) == 2)
    assert link.snapshot.plans.mission == SQUARE


def test_parameters_that_the_operator_never_looked_at_are_not_fetched(link):
    link.run(2.0)
    link.start_vehicle()
    link.run(3.0)
    assert link.events_of(ParametersComplete) == []
    assert link.snapshot.parameters.values == {}


def test_both_lives_of_the_vehicle_are_in_one_log_without_damage(link):
    link.start_vehicle()
    link.run(3.0)
    reader = TlogReader(link.recording())
    boots = reader.columns("ATTITUDE")["time_boot_ms"].astype(int)
    assert not reader.damage
    assert not len(reader.backward)
    assert (boots[1:] < boots[:-1]).sum() == 1


def test_an_upload_to_a_vehicle_that_restarts_fails_and_can_be_repeated(link):
    link.station.plans.upload(SHORT, link.now)
    link.run(STEP)  # under way
    link.start_vehicle()
    assert link.run(2.0, until=lambda: link.events_of(MissionFailed))
    assert "Mission upload failed: the vehicle restarted" in link.lines
    assert link.snapshot.plans.transfer is None
    assert link.run(3.0, until=lambda: link.snapshot.plans.mission == SQUARE)  # the vehicle has the old plan
    link.station.plans.upload(SHORT, link.now)
    assert link.run(2.0, until=lambda: link.snapshot.plans.mission == SHORT)


def test_a_second_upload_that_is_refused_is_not_taken_for_the_first(link):
    link.station.plans.upload(SHORT, link.now)
    link.station.plans.upload(SQUARE, link.now)
    assert link.run(2.0, until=lambda: len(link.events_of(MissionUploaded)) == 2)
    assert link.snapshot.plans.mission == SHORT


def test_a_command_under_way_is_given_up_when_the_vehicle_restarts(link):
    link.stop_vehicle()
    link.station.arm(link.now)
    link.run(0.1)
    link.start_vehicle()
    link.run(1.5)
    assert "arm/disarm: the vehicle restarted" in link.lines
    assert link.snapshot.status.armed is False


def fly_the_square(link):
    link.station.arm(link.now)
    link.run(0.5)
    link.station.plans.start_mission(link.now)
    assert link.run(20.0, until=lambda: link.snapshot.mission.current == 2)


@pytest.mark.long
def test_a_ground_station_that_starts_again_shows_the_mission_in_progress(link):
    fly_the_square(link)
    restart_station(link)
    assert link.run(
        3.0, until=lambda: link.snapshot.plans.mission == SQUARE and link.snapshot.position.home is not None
    )
    s = link.snapshot
    assert (s.status.mode, s.status.armed) == (Mode.MISSION.name, True)
    active = mavlink.MISSION_STATE_ACTIVE
    assert (s.mission.current, s.mission.total, s.mission.state) == (2, len(SQUARE), active)
    assert link.run(20.0, until=lambda: 2 in link.snapshot.mission.reached)


def test_the_log_of_a_killed_ground_station_is_read_up_to_its_last_whole_record(link):
    link.run(1.0)
    whole = link.recording()
    ends = [*TlogReader(whole).offsets.tolist(), len(whole)]
    for cut in random.Random(3).sample(range(len(whole) // 2, len(whole)), 40):
        reader = TlogReader(whole[:cut])
        assert len(reader) == sum(end <= cut for end in ends[1:])
        assert {piece.what for piece in reader.damage} <= {"record cut short by the end of the file", "zeros"}


def test_an_upload_whose_ground_station_dies_leaves_the_old_plan_and_the_next_one_works(link):
    link.station.plans.upload(SHORT, link.now)
    link.run(STEP)
    restart_station(link)
    assert link.run(4.0, until=lambda: link.snapshot.plans.mission == SQUARE)
    link.station.plans.upload(SHORT, link.now)
    assert link.run(4.0, until=lambda: link.snapshot.plans.mission == SHORT)


HOUR = 3600 * 10**5  # [10 us]


def is_obeyed(link):
    """True if a command reaches the vehicle and its answer the station."""
    link.station.hold(link.now)
    link.run(1.0)
    return any(line.startswith("mode HOLD: ") for line in link.lines)


@pytest.mark.long
@pytest.mark.parametrize("vehicle_clock", [T - HOUR, T + HOUR])
@pytest.mark.parametrize("station_clock", [T - HOUR, T + HOUR])
def test_with_keys_both_sides_accept_each_other_after_restarts_with_other_clocks(
    tmp_path, station_clock, vehicle_clock
):
    link = SignedLink(tmp_path, key=KEY, vehicle_key=KEY, time_file=SigningTimeFile(tmp_path / "time"))
    link.run(2.0)
    assert is_obeyed(link)
    link.start_station(clock=station_clock)
    link.run(2.5)
    assert is_obeyed(link)
    link.start_vehicle(clock=vehicle_clock)
    link.run(2.5)
    assert is_obeyed(link)
