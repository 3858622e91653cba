"""The real vehicle with a key: what it obeys, what it keeps between runs, and what its command line refuses."""

import os
import stat

import pytest

from protocol.dialect import mavlink
from protocol.keyring import CONFIRM_WITHIN, KeyRecord
from protocol.signing import NO_KEY, is_signed, verify
from sitl.__main__ import main
from sitl.errors import SitlError
from sitl.memory import MemoryFaultError
from sitl.wire.keys import KeyFile, is_loopback, read_key_option
from tests.support.signed_ground import FAR, KEY, LOCAL, OTHER, SignedGround, T


def test_with_a_key_from_the_command_line_only_the_signed_order_is_obeyed(tmp_path):
    ground = SignedGround(tmp_path, given={None: KEY})
    assert not ground.arm()
    ground.key = OTHER
    assert not ground.arm()
    ground.key = KEY
    assert ground.arm()
    assert verify(ground.last_frame, KEY)


def test_a_parameter_a_mission_and_a_mode_that_are_not_signed_change_nothing(tmp_path):
    ground = SignedGround(tmp_path, given={None: KEY})
    before = (ground.node.craft.bindings.value("SIM_WIND_SPD"), ground.node.craft.autopilot.mode)
    ground.send(mavlink.MAVLink_param_set_message(1, 1, b"SIM_WIND_SPD", 4.0, 9))
    ground.send(mavlink.MAVLink_mission_count_message(1, 1, 1, 0))
    ground.send(mavlink.MAVLink_set_mode_message(1, 1, 6 << 16))
    assert (ground.node.craft.bindings.value("SIM_WIND_SPD"), ground.node.craft.autopilot.mode) == before
    assert ground.last("PARAM_VALUE") is None
    assert ground.last("MISSION_REQUEST_INT") is None


def test_refusals_are_told_in_numbers_and_a_flood_of_them_once(tmp_path):
    ground = SignedGround(tmp_path, given={None: KEY})
    for _ in range(500):
        ground.arm()
    assert ground.texts() == "Refused so far: 1 unsigned"
    ground.now += 31.0
    ground.collect()
    assert ground.texts().endswith("Refused so far: 500 unsigned")


def test_a_key_from_a_ground_station_is_confirmed_kept_and_in_force_after_a_restart(tmp_path):
    ground = SignedGround(tmp_path)
    ground.set_up(KEY)
    assert "waits" in ground.texts()
    assert not (tmp_path / "signing.json").exists()
    ground.key = KEY
    ground.heartbeat()
    assert "confirmed" in ground.texts()
    again = SignedGround(tmp_path, clock=T + 20 * 10**5)
    again.time = T + 20 * 10**5
    assert not again.arm()
    again.key = KEY
    assert again.arm()


def test_a_key_nobody_confirms_leaves_the_vehicle_open(tmp_path):
    ground = SignedGround(tmp_path)
    ground.set_up(KEY)
    ground.now += CONFIRM_WITHIN
    ground.heartbeat()
    assert "not confirmed" in ground.texts()
    assert ground.arm()
    assert not is_signed(ground.last_frame)


def test_a_first_key_from_another_machine_is_refused_and_said_so_once(tmp_path):
    ground = SignedGround(tmp_path, peer=FAR)
    for _ in range(20):
        ground.set_up(KEY)
    assert ground.texts().count("loopback only") == 1
    ground.key = KEY
    ground.heartbeat()
    ground.key = None
    assert ground.arm()


def test_frames_of_the_last_run_are_refused_in_the_next_even_if_the_clock_went_back(tmp_path):
    ground = SignedGround(tmp_path, given={None: KEY})
    ground.key = KEY
    ground.arm()
    recorded = list(ground.raw)
    again = SignedGround(tmp_path, given={None: KEY}, clock=T - 10**12)  # killed, and started with another clock
    for data in recorded:
        again.deliver(data)
    assert not again.is_armed
    assert again.node._endpoint.statistics[LOCAL].refused == len(recorded)


def test_keys_of_the_command_line_are_not_kept_but_the_time_is(tmp_path):
    ground = SignedGround(tmp_path, given={None: KEY})
    ground.advance(0.1)
    record = KeyFile(tmp_path).load()
    assert dict(record.keys) == {}
    assert record.timestamp > T
    assert KEY.hex() not in (tmp_path / "signing.json").read_text()


def test_ending_signing_is_kept_too(tmp_path):
    KeyFile(tmp_path).save(KeyRecord({None: KEY}, T - 1))
    ground = SignedGround(tmp_path)
    ground.key = KEY
    ground.set_up(NO_KEY)
    assert dict(KeyFile(tmp_path).load().keys) == {}
    ground.key = None
    assert ground.arm()


def test_the_flight_goes_on_when_the_key_cannot_be_kept(tmp_path):
    ground = SignedGround(tmp_path)
    ground.set_up(KEY)
    (tmp_path / "signing.json").mkdir()  # what no file can replace
    ground.key = KEY
    ground.heartbeat()
    assert "not kept" in ground.texts()
    assert ground.arm()


# The file


def test_the_file_is_its_owner_s_alone_and_says_what_was_kept(tmp_path):
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
def test_a_damaged_file_is_said_by_name_and_never_taken_for_no_key(tmp_path, content):
    (tmp_path / "signing.json").write_text(content)
    with pytest.raises(MemoryFaultError, match=r"signing\.json.*delete the file") as caught:
        KeyFile(tmp_path).load()
    assert "\n" not in str(caught.value)


def test_a_crash_while_the_file_is_written_leaves_the_old_one(tmp_path, monkeypatch):
    file = KeyFile(tmp_path)
    file.save(KeyRecord({None: KEY}, T))

    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(MemoryFaultError, match="No space left"):
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


@pytest.mark.parametrize(("peer", "expected"), [(LOCAL, True), (FAR, False), ("ground", False), (None, False)])
def test_loopback_is_known_by_its_address(peer, expected):
    assert is_loopback(peer) is expected
