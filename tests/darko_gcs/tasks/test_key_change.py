"""Changing the signing key: nobody is locked out, and no key is sent where others can read it."""

import pytest

from darko_gcs.errors import GroundError, LinkError
from darko_gcs.state.values import SigningState
from darko_gcs.tasks.key_change import KeyChangeover
from protocol.wire.signing import is_secret, verify
from tests.support.gcs.signed_link import SignedLink
from tests.support.vehicle.signed_station import KEY, OTHER


class ChangingLink(SignedLink):
    """A signed link with a key change; ``is_lost`` selects frames of the station that never arrive."""

    def __init__(self, folder, is_lost=lambda _frame: False, **options):
        super().__init__(folder, key=KEY, vehicle_key=KEY, **options)
        receive = self.vehicle.receive
        self.vehicle.receive = lambda data, peer, now: None if is_lost(data) else receive(data, peer, now)
        self.run(1.5)
        self.changeover = KeyChangeover(self.station.endpoint, self.station.signing, OTHER)

    def change(self, seconds):
        for _ in range(round(seconds / 0.1)):
            if self.changeover.is_done:
                return
            self.changeover.handle_timer(self.now)
            self.run(0.1)


def test_the_key_is_changed_in_flight_and_commands_are_obeyed_after_it(tmp_path):
    link = ChangingLink(tmp_path)
    link.change(2.0)
    assert link.changeover.is_done
    link.run(1.5)
    assert link.state is SigningState.SIGNED
    link.station.arm(link.now)
    link.run(0.3)
    assert link.is_armed
    assert verify(link.sent[-1], OTHER)


@pytest.mark.parametrize("kind", ["setup", "probe"])
def test_a_lost_frame_is_sent_again(tmp_path, kind):
    left = [2]

    def is_lost(frame):
        is_kind = is_secret(frame) if kind == "setup" else verify(frame, OTHER)
        left[0] -= is_kind
        return is_kind and left[0] >= 0

    link = ChangingLink(tmp_path, is_lost)
    link.change(6.0)
    assert link.changeover.is_done
    assert left[0] < 0


@pytest.mark.long
def test_a_key_that_never_arrives_leaves_the_old_one_in_force(tmp_path):
    link = ChangingLink(tmp_path, is_secret)
    with pytest.raises(LinkError, match="the old one stays in force"):
        link.change(20.0)
    link.run(2.0)
    assert link.station.endpoint.keyring.key(None) == KEY
    link.station.arm(link.now)
    link.run(0.3)
    assert link.is_armed


def test_a_key_is_sent_over_loopback_only(tmp_path):
    link = ChangingLink(tmp_path, private=False)
    with pytest.raises(GroundError, match="NOT sent: others could read it"):
        link.change(2.0)
    assert not any(map(is_secret, link.sent))


@pytest.mark.parametrize(("key", "words"), [(KEY, "is the one in force"), (None, "--give-key")])
def test_a_change_that_makes_no_sense_is_refused(tmp_path, key, words):
    link = SignedLink(tmp_path, key=key, vehicle_key=key)
    with pytest.raises(GroundError, match=words):
        KeyChangeover(link.station.endpoint, link.station.signing, KEY)


def test_the_recording_holds_no_key(tmp_path):
    link = ChangingLink(tmp_path)
    link.change(2.0)
    assert len(link.recording()) > 1000
    assert OTHER not in link.recording()
