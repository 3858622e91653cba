"""Signatures: rightly made, checked before anything moves, and interoperable with unmodified pymavlink."""

import hashlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.endpoint import GroundEndpoint, VehicleEndpoint
from protocol.errors import FileError, LocalProtocolError
from protocol.events import SetpointReceived, SigningChanged
from protocol.keyring import (
    CONFIRM_WITHIN,
    LATEST,
    LOOK_AHEAD,
    MOST_STREAMS,
    NEW_STREAM_AGE,
    Keyring,
    KeyState,
    Verdict,
)
from protocol.signing import (
    MOST,
    NO_KEY,
    Signature,
    is_secret,
    load_key,
    sign_frame,
    signature_of,
    timestamp_at,
    verify,
)
from tests.support.link import ARM, Link, frame, table

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))
T = 36_000_000_000_000  # some day in 2026 [10 us since 2015]
LOCAL = "ground"


def heartbeat(kind=6, autopilot=8):
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 4, 3)


def arm():
    return mavlink.MAVLink_command_long_message(1, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0)


def setup(key, timestamp=T):
    return mavlink.MAVLink_setup_signing_message(1, 1, list(key), timestamp)


def order():
    return mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)


def signed(message, key=KEY, timestamp=T, link=0, system=255, component=190):
    return sign_frame(frame(message, system, component), key, Signature(link, timestamp))


def vehicle(keyring=None, **keys):
    keyring = keyring or Keyring({None: KEY} | keys, timestamp=T, is_private=lambda name: name == LOCAL)
    return VehicleEndpoint(
        commands={ARM}, parameters=table(), validate=lambda _kind, _items=None: None, peers=[LOCAL], keyring=keyring
    )


def open_vehicle():
    return vehicle(Keyring(timestamp=T, is_private=lambda name: name == LOCAL))


def obeys(end, data, now=0.0, peer=LOCAL):
    end.receive_datagram(data, peer, now)
    return any(isinstance(event, SetpointReceived) for event in end.events())


def states(end, data, now=0.0, peer=LOCAL):
    end.receive_datagram(data, peer, now)
    end.handle_timer(now)
    return [event.state for event in end.events() if isinstance(event, SigningChanged)]


# The signature


def test_a_signature_is_the_first_48_bits_of_the_digest_the_specification_names():
    data = signed(heartbeat(), timestamp=0x0102_0304_0506, link=7)
    assert data[2] == 1
    assert data[-13:-6] == bytes([7, 6, 5, 4, 3, 2, 1])
    assert data[-6:] == hashlib.sha256(KEY + data[:-6]).digest()[:6]
    assert signature_of(data) == (7, 0x0102_0304_0506)


@given(position=st.integers(0, 33), bit=st.integers(0, 7))
def test_no_bit_of_a_signed_frame_can_be_turned(position, bit):
    data = bytearray(signed(heartbeat()))
    data[position] ^= 1 << bit
    assert not verify(data, KEY)


def test_only_an_own_unsigned_frame_is_signed():
    with pytest.raises(LocalProtocolError):
        sign_frame(signed(heartbeat()), KEY, Signature(0, T))
    with pytest.raises(LocalProtocolError):
        sign_frame(b"\xfe" + frame(heartbeat())[1:], KEY, Signature(0, T))


def test_timestamps_count_from_2015():
    assert timestamp_at(1_420_070_400.0) == 0
    assert timestamp_at(1_420_070_401.5) == 150_000
    assert timestamp_at(0.0) == 0


def test_a_frame_with_a_key_in_it_is_known_as_secret():
    assert is_secret(frame(setup(KEY)))
    assert is_secret(signed(setup(KEY)))
    assert not is_secret(frame(arm()))


def test_a_stranger_s_traffic_is_never_signed_again():
    ours = Codec(1, 1, Keyring({None: KEY}, timestamp=T).link(None))
    (theirs,) = Codec(255, 190).decode(frame(arm(), 42))
    with pytest.raises(LocalProtocolError, match="forward its bytes"):
        ours.encode(theirs)
    assert ours.statistics.sent == 0


# Key files


@pytest.mark.parametrize("content", [KEY.hex().encode(), b" " + KEY.hex().upper().encode() + b"\r\n", KEY])
def test_a_key_file_holds_digits_or_bytes(tmp_path, content):
    (tmp_path / "key").write_bytes(content)
    assert load_key(str(tmp_path / "key")) == KEY


def test_a_key_may_be_given_as_digits():
    assert load_key(KEY.hex()) == KEY


@pytest.mark.parametrize("content", [b"", b"abc", KEY.hex().encode()[:-1], KEY + b"x", b"0" * 64, NO_KEY, b"z" * 64])
def test_what_is_no_key_is_refused_in_one_line_that_does_not_tell_it(tmp_path, content):
    (tmp_path / "key").write_bytes(content)
    with pytest.raises(FileError, match="signing key") as caught:
        load_key(str(tmp_path / "key"))
    assert "\n" not in str(caught.value)
    assert len(content) < 3 or content.decode("latin-1") not in str(caught.value)


@pytest.mark.parametrize("text", ["", "nowhere/key", "0" * 64, KEY.hex()[:-1], "\0", "."])
def test_neither_key_nor_file_is_one_line(text):
    with pytest.raises(FileError, match="signing key") as caught:
        load_key(text)
    assert "\n" not in str(caught.value)
    assert KEY.hex()[:-1] not in str(caught.value)


# Who is believed


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
def test_with_a_key_whatever_is_not_signed_with_it_changes_nothing_and_gets_no_answer(message, how):
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


def test_a_refused_frame_is_no_message_and_counts_for_nobody():
    codec = Codec(1, 1, Keyring({None: KEY}, timestamp=T).link(None))
    assert codec.decode(frame(order()) + signed(order(), OTHER)) == []
    assert (codec.statistics.refused, codec.statistics.received, dict(codec.statistics.sources)) == (2, 0, {})
    (message,) = codec.decode(signed(order()))
    assert message.get_signed()
    assert codec.statistics.signed == 1


def test_version_1_cannot_be_signed_and_is_refused():
    keyring = Keyring({None: KEY}, timestamp=T)
    assert not obeys(vehicle(keyring), order().pack(mavlink.MAVLink(None, 255, 190), force_mavlink1=True))
    assert keyring.counts == {Verdict.UNSIGNED: 1}


def test_what_is_signed_with_the_key_is_obeyed():
    assert obeys(vehicle(), signed(order()))


def test_unsigned_heartbeats_and_radio_status_are_looked_at_and_order_nothing():
    keyring = Keyring({None: KEY}, timestamp=T)
    end = vehicle(keyring)
    radio = mavlink.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7)
    end.receive_datagram(frame(heartbeat()) + frame(radio), LOCAL, 5.0)
    assert keyring.counts == {Verdict.LOOKED_AT: 2}
    assert end.presence.ground(5.0) is None  # a stranger must not stand in for the ground station
    end.receive_datagram(signed(heartbeat()), LOCAL, 5.0)
    assert end.presence.ground(5.0) == 0.0


def test_a_stranger_gets_telemetry_by_a_signed_frame_only():
    end = vehicle()
    end.receive_datagram(frame(heartbeat()) + frame(order()), "stranger", 0.0)
    assert "stranger" not in end.statistics
    end.receive_datagram(signed(heartbeat()), "stranger", 0.0)
    assert "stranger" in end.statistics


def test_a_forged_timestamp_moves_nothing():
    """The stock pymavlink stores the time before it verifies: there, one such frame shuts the true sender out."""
    end = vehicle()
    assert obeys(end, signed(order(), timestamp=T + 1))
    assert not obeys(end, signed(order(), OTHER, timestamp=T + 10**12))
    assert obeys(end, signed(order(), timestamp=T + 2))


@pytest.mark.parametrize("older", [0, 1, 1000])
def test_a_frame_that_is_not_newer_than_its_stream_is_refused(older):
    end = vehicle()
    assert obeys(end, signed(order(), timestamp=T))
    assert not obeys(end, signed(order(), timestamp=T - older))


def test_a_replay_from_another_address_is_a_replay():
    end = vehicle()
    data = signed(order())
    assert obeys(end, data)
    assert not obeys(end, data, peer="stranger")
    assert "stranger" not in end.statistics


def test_streams_are_told_apart_by_link_id_and_sender():
    end = vehicle()
    assert obeys(end, signed(order(), timestamp=T))
    assert obeys(end, signed(order(), timestamp=T - 5, link=1))
    assert obeys(end, signed(order(), timestamp=T - 5, system=254))


@pytest.mark.parametrize(("behind", "taken"), [(NEW_STREAM_AGE, True), (NEW_STREAM_AGE + 1, False)])
def test_a_new_stream_may_be_a_minute_behind_and_no_more(behind, taken):
    assert obeys(vehicle(), signed(order(), timestamp=T - behind)) is taken


def test_a_new_stream_is_measured_against_time_that_went_on():
    end = vehicle()
    end.handle_timer(61.0)
    assert not obeys(end, signed(order(), timestamp=T), now=61.0)
    assert obeys(end, signed(order(), timestamp=T + 2 * 10**5), now=61.0)


@pytest.mark.parametrize("told", [LATEST + 1, MOST])
def test_no_holder_of_the_key_can_use_time_up_for_all_others(told):
    keyring = Keyring({None: KEY}, timestamp=T)
    end = vehicle(keyring)
    assert not obeys(end, signed(order(), timestamp=told, system=7))
    assert keyring.counts[Verdict.FUTURE] == 1
    assert obeys(end, signed(order(), timestamp=T + 1))
    assert keyring.next_timestamp() < T + LOOK_AHEAD
    assert keyring.record.timestamp < T + 2 * LOOK_AHEAD


def test_a_key_that_comes_with_the_end_of_time_is_refused():
    assert states(open_vehicle(), frame(setup(KEY, MOST))) == [KeyState.REFUSED]


def test_streams_are_bounded_and_a_forgotten_one_cannot_be_replayed():
    keyring = Keyring({None: KEY}, timestamp=T)
    end, first = vehicle(keyring), signed(order(), timestamp=T + 1)
    assert obeys(end, first)
    for number in range(2 * MOST_STREAMS):
        assert obeys(end, signed(order(), timestamp=T + 2 + number, link=number % 256, system=2 + number // 256))
    assert len(keyring._streams) == MOST_STREAMS
    assert not obeys(end, first)
    assert obeys(end, signed(order(), timestamp=T + 3 * MOST_STREAMS))


def test_what_is_sent_carries_ever_later_timestamps_over_all_links_and_follows_what_was_received():
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


# Restarts


class Disk:
    """Keeps what it is told, as a file would."""

    def __init__(self):
        self.records = []

    def start(self, timestamp):
        floor = self.records[-1].timestamp if self.records else 0
        return vehicle(Keyring({None: KEY}, timestamp=timestamp, floor=floor, keep=self.records.append))


@pytest.mark.parametrize("clock", [T, T - 10**9, T + 10**5], ids=["same", "backwards", "one second later"])
def test_nothing_that_was_sent_before_a_restart_is_believed_after_it(clock):
    disk = Disk()
    end, before = disk.start(T), [signed(order(), timestamp=T + n * 10**5) for n in range(40)]
    assert all(obeys(end, data, now=float(n)) for n, data in enumerate(before))
    again = disk.start(clock)  # killed: nobody said good-bye
    assert not any(obeys(again, data) for data in before)


def test_own_timestamps_go_on_after_a_restart_and_whoever_follows_them_is_believed():
    disk = Disk()
    end = disk.start(T)
    end.status_text(6, "x")
    ((_, last),) = end.datagrams_to_send()
    again = disk.start(T - 10**9)
    again.status_text(6, "x")
    ((_, first),) = again.datagrams_to_send()
    assert signature_of(first).timestamp > signature_of(last).timestamp
    assert obeys(again, signed(order(), timestamp=signature_of(first).timestamp + 1))


def test_time_is_kept_ahead_of_use_and_seldom():
    disk = Disk()
    end = disk.start(T)
    for n in range(6001):  # one minute at 100 frames per second
        end.receive_datagram(signed(heartbeat(), timestamp=T + n * 1000), LOCAL, n / 100)
        assert disk.records[-1].timestamp >= T + n * 1000
    assert len(disk.records) <= 60 * 10**5 / LOOK_AHEAD + 1


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["fresh", "late", "forged", "replayed", "restart"]),
        st.integers(1, 3 * NEW_STREAM_AGE),
        st.integers(0, 2),
        st.sampled_from([LOCAL, "stranger"]),
    ),
    max_size=40,
)


@settings(max_examples=150, deadline=None)
@given(steps=STEPS)
def test_whatever_comes_no_frame_is_believed_twice_none_forged_and_a_fresh_one_always(steps):
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
        verdict = keyring.link(peer).judge(data, 84)
        if what == "forged":
            assert verdict is Verdict.BAD_SIGNATURE
            continue
        assert what != "fresh" or verdict is Verdict.SIGNED
        sent.append(data)
        if verdict is Verdict.SIGNED:
            assert data not in believed
            believed.append(data)


# A new key


def test_a_first_key_is_held_until_a_frame_signed_with_it_arrives():
    end = open_vehicle()
    assert states(end, frame(setup(KEY))) == [KeyState.PENDING]
    assert obeys(end, frame(order()))
    end.datagrams_to_send()
    end.status_text(6, "x")
    assert not any(data[2] & 1 for _, data in end.datagrams_to_send())
    assert states(end, signed(heartbeat(), timestamp=T + 1)) == [KeyState.ON]
    assert not obeys(end, frame(order()))
    assert obeys(end, signed(order(), timestamp=T + 2))
    end.datagrams_to_send()
    end.status_text(6, "x")
    assert all(verify(data, KEY) for _, data in end.datagrams_to_send())


def test_a_key_nobody_confirms_is_forgotten_and_the_old_state_stays():
    end = open_vehicle()
    states(end, frame(setup(KEY)))
    assert states(end, frame(heartbeat()), now=CONFIRM_WITHIN) == [KeyState.EXPIRED]
    assert states(end, signed(heartbeat(), timestamp=T + 1), now=CONFIRM_WITHIN) == []
    assert obeys(end, frame(order()), now=CONFIRM_WITHIN)


def test_an_old_frame_signed_with_the_new_key_confirms_nothing():
    end = open_vehicle()
    states(end, frame(setup(KEY)))
    assert states(end, signed(heartbeat(), timestamp=T - NEW_STREAM_AGE - 1)) == []
    assert obeys(end, frame(order()))


def test_a_key_wakes_the_owner_when_it_expires():
    end = open_vehicle()
    end.announce(heartbeat(), 0.0)
    states(end, frame(setup(KEY)), now=0.5)
    assert min(end.next_deadline(), 0.5 + CONFIRM_WITHIN) == end.next_deadline()
    states(end, b"", now=0.5 + CONFIRM_WITHIN)
    assert end.next_deadline() > 0.5 + CONFIRM_WITHIN


def test_while_a_key_is_changed_the_old_one_counts_until_the_new_one_is_heard():
    end = vehicle()
    assert states(end, signed(setup(OTHER))) == [KeyState.PENDING]
    assert obeys(end, signed(order(), KEY, T + 1))
    assert states(end, signed(heartbeat(), OTHER, T + 2)) == [KeyState.ON]
    assert not obeys(end, signed(order(), KEY, T + 3))
    assert obeys(end, signed(order(), OTHER, T + 3))


def test_what_was_signed_with_a_key_is_not_new_when_the_key_comes_back():
    end, old = vehicle(), signed(order(), KEY, T)
    assert obeys(end, old)
    states(end, signed(setup(OTHER), KEY, T + 1))
    states(end, signed(heartbeat(), OTHER, T + 2))
    states(end, signed(setup(KEY), OTHER, T + 3))
    assert not obeys(end, old)
    assert states(end, signed(heartbeat(), KEY, T + 4)) == [KeyState.ON]


@pytest.mark.parametrize(
    ("end", "data", "peer"),
    [
        (open_vehicle, frame(setup(KEY)), "radio"),
        (open_vehicle, signed(setup(KEY)), "radio"),
        (open_vehicle, frame(setup(KEY, 1 << 48)), LOCAL),
    ],
    ids=["unsigned from afar", "signed with no key to check it", "impossible time"],
)
def test_a_key_from_nowhere_is_refused(end, data, peer):
    made = end()
    assert states(made, data, peer=peer) == [KeyState.REFUSED]
    assert states(made, signed(heartbeat(), timestamp=T + 1), peer=peer) == []


def test_a_key_for_another_vehicle_is_not_ours():
    message = mavlink.MAVLink_setup_signing_message(2, 1, list(KEY), T)
    assert states(open_vehicle(), frame(message)) == []


def test_a_repeated_proposal_is_told_once():
    end = open_vehicle()
    assert [states(end, frame(setup(KEY)), now=n / 10) for n in range(3)] == [[KeyState.PENDING], [], []]


def test_the_holder_of_the_key_can_end_signing():
    end = vehicle()
    assert states(end, frame(setup(NO_KEY))) == []
    assert states(end, signed(setup(NO_KEY))) == [KeyState.OFF]
    assert obeys(end, frame(order()))


def test_with_a_key_set_an_unsigned_proposal_is_refused_however_private_the_link():
    keyring = Keyring({None: KEY}, timestamp=T, is_private=lambda _name: True)
    keyring.propose(LOCAL, OTHER, T, signed=False)
    assert [change.state for change in keyring.changes()] == [KeyState.REFUSED]
    assert keyring.next_deadline() == float("inf")


def test_a_link_cannot_be_opened_while_others_are_closed():
    end = vehicle(Keyring({LOCAL: KEY, "api": OTHER}, timestamp=T))
    assert states(end, signed(setup(NO_KEY))) == [KeyState.REFUSED]


def test_a_key_is_kept_when_it_is_confirmed_and_not_before():
    records = []
    end = vehicle(Keyring(timestamp=T, is_private=lambda _name: True, keep=records.append))
    states(end, frame(setup(KEY)))
    assert records == []
    states(end, signed(heartbeat(), timestamp=T + 1))
    assert records[-1].keys == {None: KEY}
    assert records[-1].timestamp >= T + 1
    states(end, signed(setup(OTHER), KEY, T + 2))
    assert records[-1].keys == {None: KEY}
    states(end, signed(heartbeat(), OTHER, T + 3))
    assert records[-1].keys == {None: OTHER}


# Both ends, and pymavlink


def test_a_ground_station_with_the_key_flies_over_a_bad_link():
    link = Link(5, drop=0.1, delay=0.05, duplicate=0.1, reorder=0.2)
    link.ground = GroundEndpoint(keyring=Keyring({None: KEY}, timestamp=T))
    link.vehicle.endpoint = vehicle(Keyring({None: KEY}, timestamp=T))
    assert link.run(lambda: link.ground.vehicle is not None)
    link.ground.request_parameters(link.now)
    assert link.run(lambda: not link.ground.is_busy)
    link.ground.command(ARM, 1.0, now=link.now)
    assert link.run(lambda: link.vehicle.armed)
    assert link.ground.codec.statistics.refused > 0  # copies, and frames that others overtook


def test_a_ground_station_with_a_key_believes_no_unsigned_vehicle_but_shows_it():
    ground = GroundEndpoint(keyring=Keyring({None: KEY}, timestamp=T))
    ground.receive_datagram(frame(heartbeat(19, 12), 1, 1), 0.0)
    assert ground.vehicle is None
    assert ground.unsigned_vehicle == (1, 1)
    ground.receive_datagram(signed(heartbeat(19, 12), system=1, component=1), 0.0)
    assert ground.vehicle == (1, 1)
    assert ground.unsigned_vehicle is None


class Pymavlink:
    """Unmodified pymavlink with a key, its own dialect and its own idea of a link."""

    def __init__(self, key, timestamp, link=3):
        self.mav = common.MAVLink(None, 245, 190)
        self.mav.robust_parsing = True
        self.mav.signing.secret_key = key
        self.mav.signing.sign_outgoing = True
        self.mav.signing.timestamp = timestamp
        self.mav.signing.link_id = link

    def frame(self, message):
        data = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return data

    def hears(self, data):
        return [m.get_type() for m in self.mav.parse_buffer(data) or [] if m.get_type() != "BAD_DATA"]


def test_pymavlink_and_we_believe_each_other():
    peer, end = Pymavlink(KEY, T + 500), vehicle()
    command = common.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)
    assert all(obeys(end, peer.frame(command)) for _ in range(3))
    end.datagrams_to_send()
    end.status_text(6, "x")
    end.announce(heartbeat(19, 12), 0.0)
    heard = [kind for name, data in end.datagrams_to_send() if name == LOCAL for kind in peer.hears(data)]
    assert heard == ["STATUSTEXT", "HEARTBEAT"]
    assert peer.mav.signing.goodsig_count == 2
    assert peer.mav.signing.badsig_count == 0


def test_pymavlink_with_another_key_is_not_believed_nor_believes():
    peer, end = Pymavlink(OTHER, T + 500), vehicle()
    assert not obeys(
        end, peer.frame(common.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11))
    )
    end.status_text(6, "x")
    assert [kind for _, data in end.datagrams_to_send() for kind in peer.hears(data)] == []
    assert peer.mav.signing.badsig_count == 1


def test_pymavlink_sets_a_key_up_and_is_believed_from_its_next_frame_on():
    peer, end = Pymavlink(KEY, T + 500), open_vehicle()
    peer.mav.signing.sign_outgoing = False
    assert states(end, peer.frame(common.MAVLink_setup_signing_message(1, 1, list(KEY), T + 500))) == [KeyState.PENDING]
    peer.mav.signing.sign_outgoing = True
    assert states(end, peer.frame(common.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))) == [KeyState.ON]
    end.datagrams_to_send()
    end.status_text(6, "x")
    assert [kind for _, data in end.datagrams_to_send() for kind in peer.hears(data)] == ["STATUSTEXT"]


def test_pymavlink_catches_up_with_a_vehicle_whose_time_ran_ahead():
    """Its counter does not follow a clock, only what it hears."""
    peer, end = Pymavlink(KEY, T), vehicle(Keyring({None: KEY}, timestamp=T, floor=T + 10**6))
    command = common.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)
    assert not obeys(end, peer.frame(command))
    end.status_text(6, "x")
    for _, data in end.datagrams_to_send():
        assert peer.hears(data) == ["STATUSTEXT"]
    assert obeys(end, peer.frame(command))
