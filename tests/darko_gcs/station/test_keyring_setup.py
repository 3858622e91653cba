"""Signing at the ground station: its keyring, the link's state, and our key for a vehicle that has none."""

import pytest

from darko_gcs.state.values import SigningState
from darko_gcs.station.keyring_setup import SigningTimeFile, open_keyring
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.wire.signing import KeyRecord, Keyring, is_secret, is_signed
from tests.support.gcs.messages import command_long
from tests.support.gcs.signed_link import SignedLink
from tests.support.vehicle.fake_station import FakeStation
from tests.support.vehicle.signed_station import KEY, OTHER, T

HOUR = 3600 * 10**5  # [10 us]


def test_the_signing_time_never_goes_back_even_if_the_clock_does(tmp_path):
    file = SigningTimeFile(tmp_path / "gcs" / "signing-time")
    key = KEY.hex()
    last = open_keyring(key, time_file=file.path).next_timestamp()
    file.save(last + 1000 * HOUR)
    assert open_keyring(key, time_file=file.path).next_timestamp() > last + 1000 * HOUR
    file.save(last)  # another ground station, behind this one
    assert file.load() >= last + 1000 * HOUR


@pytest.mark.parametrize("content", ["", "soon", "-1", str(1 << 48)])
def test_a_file_without_a_signing_time_is_refused_by_name(tmp_path, content):
    (tmp_path / "time").write_text(content)
    with pytest.raises(FileError, match=r"time: no signing time \(delete the file"):
        SigningTimeFile(tmp_path / "time").load()


def test_a_signing_time_that_cannot_be_saved_is_reported_once_and_the_link_goes_on(tmp_path):
    (tmp_path / "taken").write_text("")

    def keep(record: KeyRecord) -> None:
        SigningTimeFile(tmp_path / "taken" / "time").save(record.timestamp)

    station = Station(keyring=Keyring({None: KEY}, timestamp=T, now=0.0, keep=keep))
    for second in range(60):
        station.tick(float(second))
    lines = [line.text for line in station.snapshot.log.lines]
    assert len(lines) == 1
    assert lines[0].startswith("Signing time not saved: ")
    assert "taken" in lines[0]


def test_with_one_key_on_both_sides_the_link_is_signed_and_commands_are_obeyed(tmp_path):
    link = SignedLink(tmp_path, key=KEY, vehicle_key=KEY)
    link.run(1.5)
    link.station.arm(link.now)
    link.run(0.2)
    assert link.state is SigningState.SIGNED
    assert link.is_armed
    assert all(map(is_signed, link.sent))


def test_a_vehicle_whose_clock_is_an_hour_behind_catches_up(tmp_path):
    link = SignedLink(tmp_path, key=KEY, vehicle_key=KEY, clock=T + HOUR)
    link.run(2.5)
    assert link.state is SigningState.SIGNED
    assert link.snapshot.identity.source == (1, 1)


def test_frames_signed_before_the_ground_station_started_are_refused(tmp_path):
    before = SignedLink(tmp_path, key=KEY, vehicle_key=KEY)
    before.run(1.0)
    recorded = [data for _, data in before.vehicle.datagrams(before.now + 5.0)]
    later = T + 10**6
    station = Station(keyring=Keyring({None: KEY}, timestamp=later, now=0.0, floor=later))
    assert recorded
    for data in recorded:
        station.receive(data, 0.1, 0)
    assert station.snapshot.identity.source is None


@pytest.mark.parametrize(
    ("key", "vehicle_key", "private", "expected"),
    [
        (None, None, True, SigningState.PRIVATE),
        (None, None, False, SigningState.OPEN),
        (None, KEY, True, SigningState.NO_KEY),
        (KEY, None, True, SigningState.UNSIGNED_VEHICLE),
    ],
)
def test_the_state_of_signing_is_known(tmp_path, key, vehicle_key, private, expected):
    link = SignedLink(tmp_path, key=key, vehicle_key=vehicle_key, private=private)
    link.run(1.5)
    assert link.state is expected


def test_frames_of_a_vehicle_with_another_key_are_refused_and_counted(tmp_path):
    link = SignedLink(tmp_path, key=KEY, vehicle_key=OTHER)
    link.run(1.5)
    assert link.snapshot.identity.source is None
    assert link.snapshot.link.refused > 50


def test_a_vehicle_without_a_key_is_given_ours_and_obeys_only_us_from_then_on(tmp_path):
    link = SignedLink(tmp_path, key=KEY, give_key=True)
    link.run(4.0)
    assert "sent to 1/1" in link.text
    assert link.state is SigningState.SIGNED
    assert link.snapshot.identity.source == (1, 1)
    stranger = FakeStation.with_vehicle(tmp_path / "other")
    stranger.bench.node = link.vehicle
    stranger.send(command_long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1))
    assert not link.is_armed
    link.station.arm(link.now)
    link.run(0.2)
    assert link.is_armed


def test_a_key_is_given_only_on_request(tmp_path):
    link = SignedLink(tmp_path, key=KEY)
    link.run(3.0)
    assert not any(map(is_secret, link.sent))


def test_a_key_is_not_sent_over_a_link_that_others_can_read(tmp_path):
    link = SignedLink(tmp_path, key=KEY, give_key=True, private=False)
    link.run(3.0)
    assert not any(map(is_secret, link.sent))
    assert link.text.count("key NOT sent") == 1


def test_no_recording_holds_a_key(tmp_path):
    link = SignedLink(tmp_path, key=KEY, give_key=True)
    link.run(4.0)
    assert any(is_secret(data) and KEY in data for data in link.sent)
    assert KEY not in link.recording()
    link.receive(next(data for data in link.sent if is_secret(data)))
    assert KEY not in link.recording()
