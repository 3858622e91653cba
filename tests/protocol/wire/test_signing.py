"""MAVLink 2 signatures: keys, timestamps, the 13 bytes behind a signed frame, and which frames are accepted."""

import hashlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.wire.codec import Codec
from protocol.wire.signing import (
    LOOK_AHEAD,
    MAX_ACCEPTED_TIMESTAMP,
    MAX_NEW_STREAM_AGE,
    MAX_STREAMS,
    MAX_TIMESTAMP,
    NO_KEY,
    Keyring,
    KeyState,
    Signature,
    Verdict,
    is_secret,
    is_signed,
    load_key,
    sign_frame,
    signature_of,
    timestamp_at,
    verify,
)
from tests.support.links.link import ARM, frame
from tests.support.links.signed_frames import (
    KEY,
    LOCAL,
    OTHER,
    T,
    arm,
    heartbeat,
    obeys,
    open_vehicle,
    order,
    setup,
    signed,
    states,
    vehicle,
)
from tests.support.logs import bare


def test_a_signature_is_the_first_48_bits_of_the_digest_the_specification_names():
    data = signed(heartbeat(), timestamp=0x0102_0304_0506, link=7)
    assert data[2] == 1
    assert data[-13:-6] == bytes([7, 6, 5, 4, 3, 2, 1])
    assert data[-6:] == hashlib.sha256(KEY + data[:-6]).digest()[:6]
    assert signature_of(data) == (7, 0x0102_0304_0506)


@given(position=st.integers(0, 33), bit=st.integers(0, 7))
def test_a_changed_bit_of_a_signed_frame_fails_verification(position, bit):
    data = bytearray(signed(heartbeat()))
    data[position] ^= 1 << bit
    assert not verify(data, KEY)


def test_only_unsigned_version_2_frames_are_signed():
    with pytest.raises(LocalProtocolError):
        sign_frame(signed(heartbeat()), KEY, Signature(0, T))
    with pytest.raises(LocalProtocolError):
        sign_frame(b"\xfe" + frame(heartbeat())[1:], KEY, Signature(0, T))


def test_timestamps_count_from_2015():
    assert timestamp_at(1_420_070_400.0) == 0
    assert timestamp_at(1_420_070_401.5) == 150_000
    assert timestamp_at(0.0) == 0
    assert timestamp_at(1e12) == 0xFFFF_FFFF_FFFF


def test_a_frame_that_is_no_longer_than_a_signature_carries_none():
    assert is_signed(b"\xfd\x00\x01".ljust(14, b"\0"))
    assert not is_signed(b"\xfd\x00\x01".ljust(13, b"\0"))


def test_a_frame_with_a_key_is_secret():
    assert is_secret(frame(setup(KEY)))
    assert is_secret(signed(setup(KEY)))
    assert not is_secret(frame(arm()))


def test_messages_of_other_senders_are_never_signed():
    ours = Codec(1, 1, Keyring({None: KEY}, timestamp=T).link(None))
    (theirs,) = Codec(255, 190).decode(frame(arm(), 42))
    with pytest.raises(LocalProtocolError, match="forward it without signing"):
        ours.encode(theirs)
    assert ours.statistics.sent == 0


@pytest.mark.parametrize("content", [KEY.hex().encode(), b" " + KEY.hex().upper().encode() + b"\r\n", KEY])
def test_a_key_file_holds_digits_or_bytes(tmp_path, content):
    (tmp_path / "key").write_bytes(content)
    assert load_key(str(tmp_path / "key")) == KEY


def test_a_key_may_be_given_as_digits():
    assert load_key(KEY.hex()) == KEY


@pytest.mark.parametrize("content", [b"", b"abc", KEY.hex().encode()[:-1], KEY + b"x", b"0" * 64, NO_KEY, b"z" * 64])
def test_an_invalid_key_is_refused_in_one_line_without_quoting_it(tmp_path, content):
    (tmp_path / "key").write_bytes(content)
    with pytest.raises(FileError, match="signing key") as caught:
        load_key(str(tmp_path / "key"))
    assert "\n" not in str(caught.value)
    assert len(content) < 3 or content.decode("latin-1") not in str(caught.value)


@pytest.mark.parametrize("text", ["", "nowhere/key", "0" * 64, KEY.hex()[:-1], "\0", "."])
def test_a_missing_key_file_is_refused_in_one_line(text):
    with pytest.raises(FileError, match="signing key") as caught:
        load_key(text)
    assert "\n" not in str(caught.value)
    assert KEY.hex()[:-1] not in str(caught.value)


@pytest.mark.parametrize(("length", "shown"), [(43, "n" * 43), (44, "n" * 40 + "...")])
def test_a_long_name_of_a_key_file_is_shortened(length, shown):
    with pytest.raises(FileError, match=f"nor a readable file: {shown}: No such file"):
        load_key("n" * length)


@pytest.mark.parametrize("size", [1, 31, 33, 64])
def test_other_sizes_than_32_bytes_are_no_key(tmp_path, size):
    (tmp_path / "key").write_bytes(b"\xff" * size)
    with pytest.raises(FileError, match="neither 64 hexadecimal digits nor 32 bytes"):
        load_key(str(tmp_path / "key"))


@pytest.mark.parametrize(
    "message",
    [
        arm(),
        mavlink.MAVLink_command_int_message(1, 1, 0, ARM, 0, 0, 1, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_mission_count_message(1, 1, 1, 0),
        mavlink.MAVLink_mission_clear_all_message(1, 1),
        mavlink.MAVLink_mission_request_list_message(1, 1),
        mavlink.MAVLink_mission_set_current_message(1, 1, 0),
        mavlink.MAVLink_param_set_message(1, 1, b"K_1", 3.0, 9),
        mavlink.MAVLink_param_request_list_message(1, 1),
        mavlink.MAVLink_set_mode_message(1, 1, 0),
        mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11),
        mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0),
        mavlink.MAVLink_timesync_message(0, 1),
        mavlink.MAVLink_ping_message(0, 0, 0, 0),
        setup(OTHER),
    ],
    ids=lambda message: message.get_type(),
)
@pytest.mark.parametrize("how", ["unsigned", "wrong key"])
def test_with_a_key_wrongly_signed_frames_have_no_effect_and_no_answer(message, how):
    keyring = Keyring({None: KEY}, timestamp=T)
    end = vehicle(keyring)
    end.handle_timer(0.0)
    end.datagrams_to_send()
    data = frame(message) if how == "unsigned" else signed(message, OTHER)
    end.receive_datagram(data, LOCAL, 0.0)
    assert end.events() == []
    assert end.datagrams_to_send() == []
    expected = Verdict.BAD_SIGNATURE if how == "wrong key" else Verdict.UNSIGNED
    assert (keyring.refused, keyring.counts) == (1, {expected: 1})
    assert end.statistics[LOCAL].refused == 1


def test_a_refused_frame_is_counted_for_no_source():
    codec = Codec(1, 1, Keyring({None: KEY}, timestamp=T).link(None))
    assert codec.decode(frame(order()) + signed(order(), OTHER)) == []
    assert (codec.statistics.refused, codec.statistics.received, dict(codec.statistics.sources)) == (2, 0, {})
    (message,) = codec.decode(signed(order()))
    assert message.get_signed()
    assert codec.statistics.signed == 1


def test_version_1_cannot_be_signed_and_is_refused():
    keyring = Keyring({None: KEY}, timestamp=T)
    assert not obeys(vehicle(keyring), bare(order(), version=1, system=255, component=190))
    assert keyring.counts == {Verdict.UNSIGNED: 1}


def test_correctly_signed_commands_are_executed():
    assert obeys(vehicle(), signed(order()))


def test_unsigned_heartbeats_and_radio_status_are_shown_without_effect():
    keyring = Keyring({None: KEY}, timestamp=T)
    end = vehicle(keyring)
    radio = mavlink.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7)
    end.receive_datagram(frame(heartbeat()) + frame(radio), LOCAL, 5.0)
    assert keyring.counts == {Verdict.DISPLAY_ONLY: 2}
    assert end.presence.ground(5.0) is None  # an unsigned sender must not count as the ground station
    end.receive_datagram(signed(heartbeat()), LOCAL, 5.0)
    assert end.presence.ground(5.0) == 0.0


def test_an_unknown_sender_becomes_a_peer_by_a_signed_frame_only():
    end = vehicle()
    end.receive_datagram(frame(heartbeat()) + frame(order()), "stranger", 0.0)
    assert "stranger" not in end.statistics
    end.receive_datagram(signed(heartbeat()), "stranger", 0.0)
    assert "stranger" in end.statistics


def test_a_forged_timestamp_has_no_effect():
    """Unmodified pymavlink stores the time before it verifies: there, one such frame locks the true sender out."""
    end = vehicle()
    assert obeys(end, signed(order(), timestamp=T + 1))
    assert not obeys(end, signed(order(), OTHER, timestamp=T + 10**12))
    assert obeys(end, signed(order(), timestamp=T + 2))


@pytest.mark.parametrize("older", [0, 1, 1000])
def test_a_frame_that_is_not_newer_than_its_stream_is_refused(older):
    end = vehicle()
    assert obeys(end, signed(order(), timestamp=T))
    assert not obeys(end, signed(order(), timestamp=T - older))


def test_a_replay_from_another_address_is_refused():
    end = vehicle()
    data = signed(order())
    assert obeys(end, data)
    assert not obeys(end, data, peer="stranger")
    assert "stranger" not in end.statistics


def test_streams_are_identified_by_link_id_and_sender():
    end = vehicle()
    assert obeys(end, signed(order(), timestamp=T))
    assert obeys(end, signed(order(), timestamp=T - 5, link=1))
    assert obeys(end, signed(order(), timestamp=T - 5, system=254))
    assert obeys(end, signed(order(), timestamp=T - 5, component=191))


@pytest.mark.parametrize(("behind", "taken"), [(MAX_NEW_STREAM_AGE, True), (MAX_NEW_STREAM_AGE + 1, False)])
def test_a_new_stream_may_be_a_minute_behind_and_no_more(behind, taken):
    assert obeys(vehicle(), signed(order(), timestamp=T - behind)) is taken


def test_a_new_stream_is_compared_with_the_present_time():
    end = vehicle()
    end.handle_timer(61.0)
    assert not obeys(end, signed(order(), timestamp=T), now=61.0)
    assert obeys(end, signed(order(), timestamp=T + 2 * 10**5), now=61.0)


@pytest.mark.parametrize("told", [MAX_ACCEPTED_TIMESTAMP + 1, MAX_TIMESTAMP])
def test_timestamps_near_the_end_of_their_range_are_refused(told):
    keyring = Keyring({None: KEY}, timestamp=T)
    end = vehicle(keyring)
    assert not obeys(end, signed(order(), timestamp=told, system=7))
    assert keyring.counts[Verdict.FUTURE] == 1
    assert obeys(end, signed(order(), timestamp=T + 1))
    assert keyring.next_timestamp() < T + LOOK_AHEAD
    assert keyring.record.timestamp < T + 2 * LOOK_AHEAD


def test_a_key_with_a_timestamp_near_the_end_of_its_range_is_refused():
    assert states(open_vehicle(), frame(setup(KEY, MAX_TIMESTAMP))) == [KeyState.REFUSED]


def test_streams_are_limited_and_a_forgotten_one_cannot_be_replayed():
    keyring = Keyring({None: KEY}, timestamp=T)
    end, first = vehicle(keyring), signed(order(), timestamp=T + 1)
    assert obeys(end, first)
    for number in range(2 * MAX_STREAMS):
        assert obeys(end, signed(order(), timestamp=T + 2 + number, link=number % 256, system=2 + number // 256))
    assert len(keyring._streams) == MAX_STREAMS
    assert not obeys(end, first)
    assert obeys(end, signed(order(), timestamp=T + 3 * MAX_STREAMS))


def test_sent_timestamps_increase_over_all_links_and_follow_received_ones():
    keyring = Keyring({None: KEY}, timestamp=T)
    end = vehicle(keyring)
    end.receive_datagram(signed(heartbeat(), timestamp=T + 10**9), "other", 0.0)
    end.datagrams_to_send()
    for _ in range(3):
        end.status_text(6, "x")
    signatures = [signature_of(data) for _, data in end.datagrams_to_send()]
    times = [signature.timestamp for signature in signatures]
    assert times == sorted(set(times))
    assert times[0] > T + 10**9
    assert len({signature.link for signature in signatures}) == 2


def test_each_link_has_its_own_key_and_one_without_any_is_read_only():
    end = vehicle(Keyring({LOCAL: KEY, "api": OTHER}, timestamp=T))
    assert obeys(end, signed(order(), KEY))
    assert not obeys(end, signed(order(), OTHER, T + 2))
    assert obeys(end, signed(order(), OTHER, T), peer="api")  # the same ids and time are another stream there
    assert not obeys(end, signed(order(), KEY, T + 2), peer="api")
    assert not obeys(end, frame(order()), peer="stranger")
    end.datagrams_to_send()
    end.status_text(6, "x")
    keys = {"ground": KEY, "api": OTHER}
    assert all(verify(data, keys[peer]) for peer, data in end.datagrams_to_send())


class Disk:
    """Stores the last record, as a file would."""

    def __init__(self):
        self.records = []

    def start(self, timestamp):
        floor = self.records[-1].timestamp if self.records else 0
        return vehicle(Keyring({None: KEY}, timestamp=timestamp, floor=floor, keep=self.records.append))


@pytest.mark.parametrize("clock", [T, T - 10**9, T + 10**5], ids=["same", "backwards", "one second later"])
def test_frames_from_before_a_restart_are_refused(clock):
    disk = Disk()
    end, before = disk.start(T), [signed(order(), timestamp=T + n * 10**5) for n in range(40)]
    assert all(obeys(end, data, now=float(n)) for n, data in enumerate(before))
    again = disk.start(clock)  # killed without an orderly end
    assert not any(obeys(again, data) for data in before)


def test_timestamps_continue_after_a_restart():
    disk = Disk()
    end = disk.start(T)
    end.status_text(6, "x")
    ((_, last),) = end.datagrams_to_send()
    again = disk.start(T - 10**9)
    again.status_text(6, "x")
    ((_, first),) = again.datagrams_to_send()
    assert signature_of(first).timestamp > signature_of(last).timestamp
    assert obeys(again, signed(order(), timestamp=signature_of(first).timestamp + 1))


def test_the_saved_time_is_ahead_and_rarely_written():
    disk = Disk()
    end = disk.start(T)
    for n in range(6001):  # one minute at 100 frames per second
        end.receive_datagram(signed(heartbeat(), timestamp=T + n * 1000), LOCAL, n / 100)
        assert disk.records[-1].timestamp >= T + n * 1000
        assert disk.records[-1].timestamp <= T + n * 1000 + 10 * 10**5  # ten seconds
    assert len(disk.records) == 6


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["fresh", "late", "forged", "replayed", "restart"]),
        st.integers(1, 3 * MAX_NEW_STREAM_AGE),
        st.integers(0, 2),
        st.sampled_from([LOCAL, "stranger"]),
    ),
    max_size=40,
)


@settings(max_examples=150, deadline=None)
@given(steps=STEPS)
def test_any_sequence_accepts_fresh_frames_once_and_no_forged_ones(steps):
    records, believed, sent = [], [], []

    def start():
        floor = records[-1].timestamp if records else 0
        return Keyring({None: KEY}, timestamp=T, floor=floor, keep=records.append)

    keyring = start()
    for what, amount, link, peer in steps:
        if what == "restart":
            keyring = start()
            continue
        own = keyring.next_timestamp()
        timestamp = own - amount if what == "late" else own + amount
        data = signed(order(), OTHER if what == "forged" else KEY, timestamp, link)
        if what == "replayed" and sent:
            data = sent[amount % len(sent)]
        verdict = keyring.link(peer).judge(data)
        if what == "forged":
            assert verdict is Verdict.BAD_SIGNATURE
            continue
        assert what != "fresh" or verdict is Verdict.SIGNED
        sent.append(data)
        if verdict is Verdict.SIGNED:
            assert data not in believed
            believed.append(data)


def test_no_timestamp_of_the_last_ten_years_of_its_range_is_accepted():
    """Whoever sends one would leave no time for later frames."""
    assert (MAX_TIMESTAMP - MAX_ACCEPTED_TIMESTAMP) / (86400 * 100_000) == 3650


def test_the_last_timestamp_before_those_years_is_accepted():
    latest = 2**48 - 1 - 3650 * 86400 * 100_000
    assert obeys(vehicle(), signed(order(), timestamp=latest))
    assert not obeys(vehicle(), signed(order(), timestamp=latest + 1))


def test_a_keyring_takes_no_first_key_unless_a_link_is_said_to_be_private():
    keyring = Keyring(timestamp=T)
    keyring.propose(LOCAL, KEY, T, signed=False)
    assert [change.state for change in keyring.changes()] == [KeyState.REFUSED]
