"""A new key is held until a frame signed with it arrives."""

import pytest

from protocol.dialect import mavlink
from protocol.wire.signing import (
    CONFIRMATION_TIMEOUT,
    MAX_ACCEPTED_TIMESTAMP,
    MAX_NEW_STREAM_AGE,
    MAX_TIMESTAMP,
    NO_KEY,
    Keyring,
    KeyState,
    verify,
)
from tests.support.links.link import frame
from tests.support.links.signed_frames import (
    KEY,
    LOCAL,
    OTHER,
    T,
    heartbeat,
    obeys,
    open_vehicle,
    order,
    setup,
    signed,
    states,
    vehicle,
)


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


def test_an_unconfirmed_key_expires_and_the_old_one_stays():
    end = open_vehicle()
    states(end, frame(setup(KEY)))
    assert states(end, frame(heartbeat()), now=CONFIRMATION_TIMEOUT) == [KeyState.EXPIRED]
    assert states(end, signed(heartbeat(), timestamp=T + 1), now=CONFIRMATION_TIMEOUT) == []
    assert obeys(end, frame(order()), now=CONFIRMATION_TIMEOUT)


def test_an_old_frame_signed_with_the_new_key_does_not_confirm_it():
    end = open_vehicle()
    states(end, frame(setup(KEY)))
    assert states(end, signed(heartbeat(), timestamp=T - MAX_NEW_STREAM_AGE - 1)) == []
    assert obeys(end, frame(order()))


def test_the_expiry_of_a_key_is_a_deadline():
    end = open_vehicle()
    end.announce(heartbeat(), 0.0)
    states(end, frame(setup(KEY)), now=0.5)
    assert min(end.next_deadline(), 0.5 + CONFIRMATION_TIMEOUT) == end.next_deadline()
    states(end, b"", now=0.5 + CONFIRMATION_TIMEOUT)
    assert end.next_deadline() > 0.5 + CONFIRMATION_TIMEOUT


def test_the_old_key_is_valid_until_the_new_one_is_confirmed():
    end = vehicle()
    assert states(end, signed(setup(OTHER))) == [KeyState.PENDING]
    assert obeys(end, signed(order(), KEY, T + 1))
    assert states(end, signed(heartbeat(), OTHER, T + 2)) == [KeyState.ON]
    assert not obeys(end, signed(order(), KEY, T + 3))
    assert obeys(end, signed(order(), OTHER, T + 3))


def test_frames_signed_with_a_restored_key_can_still_be_replays():
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
def test_a_first_key_over_a_public_link_is_refused(end, data, peer):
    made = end()
    assert states(made, data, peer=peer) == [KeyState.REFUSED]
    assert states(made, signed(heartbeat(), timestamp=T + 1), peer=peer) == []


def test_a_key_for_another_vehicle_is_ignored():
    message = mavlink.MAVLink_setup_signing_message(2, 1, list(KEY), T)
    assert states(open_vehicle(), frame(message)) == []


def test_a_repeated_proposal_is_reported_once():
    end = open_vehicle()
    assert [states(end, frame(setup(KEY)), now=n / 10) for n in range(3)] == [[KeyState.PENDING], [], []]


def test_the_holder_of_the_key_can_end_signing():
    end = vehicle()
    assert states(end, frame(setup(NO_KEY))) == []
    assert states(end, signed(setup(NO_KEY))) == [KeyState.OFF]
    assert obeys(end, frame(order()))


def test_with_a_key_an_unsigned_proposal_is_refused_on_any_link():
    keyring = Keyring({None: KEY}, timestamp=T, is_private=lambda _name: True)
    keyring.propose(LOCAL, OTHER, T, signed=False)
    assert [change.state for change in keyring.changes()] == [KeyState.REFUSED]
    assert keyring.next_deadline() == float("inf")


def test_signing_cannot_end_on_one_link_while_others_have_keys():
    end = vehicle(Keyring({LOCAL: KEY, "api": OTHER}, timestamp=T))
    assert states(end, signed(setup(NO_KEY))) == [KeyState.REFUSED]


def test_a_key_is_saved_once_it_is_confirmed():
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


@pytest.mark.parametrize(("timestamp", "is_valid"), [(0, True), (MAX_ACCEPTED_TIMESTAMP, True), (MAX_TIMESTAMP, False)])
def test_a_key_comes_with_any_time_that_can_be_lived_through(timestamp, is_valid):
    state = KeyState.PENDING if is_valid else KeyState.REFUSED
    assert states(open_vehicle(), frame(setup(KEY, timestamp))) == [state]
