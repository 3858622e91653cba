"""From one signing key to the next: nobody is locked out, and no key crosses a wire in clear."""

import pytest

from darko_gcs.__main__ import main
from darko_gcs.errors import GroundError, LinkError
from darko_gcs.key_change import KeyChangeover
from darko_gcs.signing import Signing
from protocol.signing import is_secret, verify
from tests.support.signed_ground import KEY, OTHER
from tests.support.signed_pair import Pair


class Changing(Pair):
    """A signed pair; ``lost`` says which of the frames that the station sends never arrive."""

    def __init__(self, folder, lost=lambda _frame: False, **options):
        super().__init__(folder, key=KEY, vehicle_key=KEY, **options)
        arrive = self.node.receive
        self.node.receive = lambda data, peer, now: None if lost(data) else arrive(data, peer, now)
        self.run(1.5)
        self.changeover = KeyChangeover(self.station.endpoint, self.station.signing, OTHER)

    def change(self, seconds):
        for _ in range(round(seconds / 0.1)):
            if self.changeover.is_done:
                return
            self.changeover.handle_timer(self.now)
            self.run(0.1)


def test_the_key_is_changed_in_flight_and_orders_go_on(tmp_path):
    pair = Changing(tmp_path)
    pair.change(2.0)
    assert pair.changeover.is_done
    pair.run(1.5)
    assert pair.state is Signing.SIGNED
    pair.station.arm(pair.now)
    pair.run(0.3)
    assert pair.is_armed
    assert verify(pair.sent[-1], OTHER)


@pytest.mark.parametrize("kind", ["setup", "probe"])
def test_a_lost_frame_is_sent_again(tmp_path, kind):
    left = [2]

    def lost(frame):
        is_kind = is_secret(frame) if kind == "setup" else verify(frame, OTHER)
        left[0] -= is_kind
        return is_kind and left[0] >= 0

    pair = Changing(tmp_path, lost)
    pair.change(6.0)
    assert pair.changeover.is_done
    assert left[0] < 0


def test_a_key_that_never_arrives_leaves_the_old_one_in_force(tmp_path):
    pair = Changing(tmp_path, is_secret)
    with pytest.raises(LinkError, match="the old one stays in force"):
        pair.change(20.0)
    pair.run(2.0)
    assert pair.station.endpoint.keyring.key(None) == KEY
    pair.station.arm(pair.now)
    pair.run(0.3)
    assert pair.is_armed


def test_no_key_is_sent_over_another_link_than_loopback(tmp_path):
    pair = Changing(tmp_path, private=False)
    with pytest.raises(GroundError, match="in clear"):
        pair.change(2.0)
    assert not any(map(is_secret, pair.sent))


@pytest.mark.parametrize(("key", "words"), [(KEY, "is the one in force"), (None, "--give-key")])
def test_what_cannot_be_changed_is_said(tmp_path, key, words):
    pair = Pair(tmp_path, key=key, vehicle_key=key)
    with pytest.raises(GroundError, match=words):
        KeyChangeover(pair.station.endpoint, pair.station.signing, KEY)


def test_a_new_key_that_is_none_is_refused_without_being_quoted(capsys):
    assert main(["signing", "--signing-key", KEY.hex(), "--new-key", "0" * 64]) == 2
    assert "--new-key: signing key: a key of zeros" in capsys.readouterr().err


def test_no_key_is_recorded(tmp_path):
    pair = Changing(tmp_path)
    pair.change(2.0)
    pair.station._recorder.flush()
    assert len(pair.log.getvalue()) > 1000
    assert OTHER not in pair.log.getvalue()
