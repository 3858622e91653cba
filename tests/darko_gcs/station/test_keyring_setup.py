"""The signing time over restarts of the ground station."""

import pytest

from darko_gcs.station.keyring_setup import SigningTimeFile, open_keyring
from darko_gcs.station.station import Station
from protocol.errors import FileError
from protocol.wire.signing import KeyRecord, Keyring
from tests.support.vehicle.signed_station import KEY, T

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
    lines = [line.text for line in station.snapshot.messages]
    assert len(lines) == 1
    assert lines[0].startswith("Signing time not saved: ")
    assert "taken" in lines[0]
