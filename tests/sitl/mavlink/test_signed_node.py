"""The vehicle with a signing key: what it obeys, what it stores, and what its command line refuses."""

import os
import stat

import pytest

from protocol.dialect import mavlink
from protocol.wire.signing import CONFIRMATION_TIMEOUT, NO_KEY, KeyRecord, is_signed, verify
from sitl.__main__ import main
from sitl.errors import SitlError
from sitl.mavlink.signing_keys import KeyFile, read_key_option
from sitl.tools.persistence import StateFolderError
from tests.support.vehicle.signed_station import FAR, KEY, LOCAL, OTHER, SignedStation, T


def test_with_a_key_from_the_command_line_only_signed_commands_are_obeyed(tmp_path):
    station = SignedStation(tmp_path, given={None: KEY})
    assert not station.arm()
    station.key = OTHER
    assert not station.arm()
    station.key = KEY
    assert station.arm()
    assert verify(station.last_frame, KEY)


def test_an_unsigned_parameter_mission_or_mode_changes_nothing(tmp_path):
    station = SignedStation(tmp_path, given={None: KEY})
    before = (station.node.aircraft.configuration.value("SIM_WIND_SPD"), station.node.aircraft.autopilot.mode)
    station.send(mavlink.MAVLink_param_set_message(1, 1, b"SIM_WIND_SPD", 4.0, 9))
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 1, 0))
    station.send(mavlink.MAVLink_set_mode_message(1, 1, 6 << 16))
    assert (station.node.aircraft.configuration.value("SIM_WIND_SPD"), station.node.aircraft.autopilot.mode) == before
    assert station.last("PARAM_VALUE") is None
    assert station.last("MISSION_REQUEST_INT") is None


def test_refusals_are_counted_and_a_flood_of_them_is_reported_once(tmp_path):
    station = SignedStation(tmp_path, given={None: KEY})
    for _ in range(500):
        station.arm()
    assert station.texts() == "Messages refused so far: 1 unsigned"
    station.wait(31.0)
    assert station.texts().endswith("Messages refused so far: 500 unsigned")


def test_a_key_from_a_ground_station_is_confirmed_stored_and_in_force_after_a_restart(tmp_path):
    station = SignedStation(tmp_path)
    station.set_up(KEY)
    assert "waiting" in station.texts()
    assert not (tmp_path / "signing.json").exists()
    station.key = KEY
    station.beat()
    assert "confirmed" in station.texts()
    again = SignedStation(tmp_path, clock=T + 20 * 10**5)
    again.time = T + 20 * 10**5
    assert not again.arm()
    again.key = KEY
    assert again.arm()


def test_an_unconfirmed_key_leaves_the_vehicle_open(tmp_path):
    station = SignedStation(tmp_path)
    station.set_up(KEY)
    station.wait(CONFIRMATION_TIMEOUT)
    station.beat()
    assert "not confirmed" in station.texts()
    assert station.arm()
    assert not is_signed(station.last_frame)


def test_a_first_key_from_another_machine_is_refused_with_one_text(tmp_path):
    station = SignedStation(tmp_path, peer=FAR)
    for _ in range(20):
        station.set_up(KEY)
    assert station.texts().count("loopback only") == 1
    station.key = KEY
    station.beat()
    station.key = None
    assert station.arm()


def test_frames_of_the_last_run_are_refused_in_the_next_even_if_the_clock_went_back(tmp_path):
    station = SignedStation(tmp_path, given={None: KEY})
    station.key = KEY
    station.arm()
    recorded = list(station.raw)
    again = SignedStation(tmp_path, given={None: KEY}, clock=T - 10**12)  # killed, and started with another clock
    for data in recorded:
        again.send_datagram(data)
    assert not again.is_armed
    assert again.node.endpoint.statistics[LOCAL].refused == len(recorded)


def test_keys_of_the_command_line_are_not_stored_but_the_time_is(tmp_path):
    station = SignedStation(tmp_path, given={None: KEY})
    station.advance(0.1)
    record = KeyFile(tmp_path).load()
    assert dict(record.keys) == {}
    assert record.timestamp > T
    assert KEY.hex() not in (tmp_path / "signing.json").read_text()


def test_the_end_of_signing_is_stored_too(tmp_path):
    KeyFile(tmp_path).save(KeyRecord({None: KEY}, T - 1))
    station = SignedStation(tmp_path)
    station.key = KEY
    station.set_up(NO_KEY)
    assert dict(KeyFile(tmp_path).load().keys) == {}
    station.key = None
    assert station.arm()


def test_the_flight_goes_on_when_the_key_cannot_be_stored(tmp_path):
    station = SignedStation(tmp_path)
    station.set_up(KEY)
    (tmp_path / "signing.json").mkdir()  # what no file can replace
    station.key = KEY
    station.beat()
    assert "not saved" in station.texts()
    assert station.arm()


# The file


def test_the_file_is_private_to_its_owner_and_holds_keys_and_time(tmp_path):
    file, old = KeyFile(tmp_path), os.umask(0)
    (tmp_path / ".signing.json.new").write_text("left over by a crash, readable by all")
    try:
        file.save(KeyRecord({None: KEY, LOCAL: OTHER}, T))
    finally:
        os.umask(old)
    assert stat.S_IMODE(file.path.stat().st_mode) == 0o600
    assert file.load() == KeyRecord({None: KEY, LOCAL: OTHER}, T)
    assert [path.name for path in tmp_path.iterdir()] == ["signing.json"]


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{nonsense",
        "[]",
        '{"keys": {}}',
        '{"keys": {"*": "zz"}, "time": 0}',
        '{"keys": {"*": "00"}, "time": 0}',
        '{"keys": {"*": 5}, "time": 0}',
        '{"keys": {"nowhere": "' + KEY.hex() + '"}, "time": 0}',
        '{"keys": {"*": "' + NO_KEY.hex() + '"}, "time": 0}',
        '{"keys": {}, "time": -1}',
        '{"keys": {}, "time": "x"}',
        '{"keys": {}, "time": 281474976710656}',
    ],
)
def test_a_damaged_file_is_named_and_never_mistaken_for_no_key(tmp_path, content):
    (tmp_path / "signing.json").write_text(content)
    with pytest.raises(StateFolderError, match=r"signing\.json.*delete the file") as caught:
        KeyFile(tmp_path).load()
    assert "\n" not in str(caught.value)


def test_a_crash_while_the_file_is_written_leaves_the_old_one(tmp_path, monkeypatch):
    file = KeyFile(tmp_path)
    file.save(KeyRecord({None: KEY}, T))

    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(StateFolderError, match="No space left"):
        file.save(KeyRecord({None: OTHER}, T + 1))
    assert file.load() == KeyRecord({None: KEY}, T)


# The command line


def test_a_key_may_be_for_one_port(tmp_path):
    (tmp_path / "key").write_text(KEY.hex())
    assert read_key_option(KEY.hex()) == (None, KEY)
    assert read_key_option(f"14540={tmp_path / 'key'}") == (("127.0.0.1", 14540), KEY)


@pytest.mark.parametrize("text", ["", "abc", "14540=abc", "99999=" + KEY.hex(), "0" * 64])
def test_a_bad_key_is_one_line_and_exit_code_2(tmp_path, capsys, text):
    with pytest.raises(SitlError, match="signing key"):
        read_key_option(text)
    code = main(["run", "--port", "0", "--state-dir", str(tmp_path), "--signing-key", text])
    error = capsys.readouterr().err
    assert (code, error.count("\n")) == (2, 1)
    assert "signing key" in error
    assert KEY.hex() not in error
