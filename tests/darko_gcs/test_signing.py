"""The ground station and the vehicle with keys: what is shown, what is sent, and what never is."""

from dataclasses import replace

import pytest

from darko_gcs.__main__ import main
from darko_gcs.link import Link
from darko_gcs.signing import Signing
from darko_gcs.snapshot import EMPTY
from darko_gcs.station import Station
from darko_gcs.widgets.status import StatusBar
from protocol.dialect import mavlink
from protocol.keyring import Keyring
from protocol.signing import is_secret, is_signed
from tests.support.ground import Ground
from tests.support.signed_ground import FAR, KEY, LOCAL, OTHER, T
from tests.support.signed_pair import Pair


def test_with_one_key_on_both_sides_the_link_is_signed_and_orders_are_obeyed(tmp_path):
    pair = Pair(tmp_path, key=KEY, vehicle_key=KEY)
    pair.run(1.5)
    pair.station.arm(pair.now)
    pair.run(0.2)
    assert pair.state is Signing.SIGNED
    assert pair.is_armed
    assert all(map(is_signed, pair.sent))


def test_a_vehicle_whose_clock_is_an_hour_behind_catches_up_with_what_it_hears(tmp_path):
    pair = Pair(tmp_path, key=KEY, vehicle_key=KEY, ahead=3600 * 10**5)
    pair.run(2.5)
    assert pair.state is Signing.SIGNED
    assert pair.station.snapshot.source == (1, 1)


def test_what_was_signed_before_the_ground_station_started_is_not_believed(tmp_path):
    before = Pair(tmp_path, key=KEY, vehicle_key=KEY)
    before.run(1.0)
    recorded = [data for _, data in before.node.datagrams(before.now + 5.0)]
    again = Station(keyring=Keyring({None: KEY}, timestamp=T + 10**6, now=0.0, floor=T + 10**6))
    assert recorded
    for data in recorded:
        again.receive(data, 0.1, 0)
    assert again.snapshot.source is None


@pytest.mark.parametrize(
    ("key", "vehicle_key", "private", "expected"),
    [
        (None, None, True, Signing.PRIVATE),
        (None, None, False, Signing.OPEN),
        (None, KEY, True, Signing.NO_KEY),
        (KEY, None, True, Signing.UNSIGNED_VEHICLE),
    ],
)
def test_the_state_of_the_link_is_told(tmp_path, key, vehicle_key, private, expected):
    pair = Pair(tmp_path, key=key, vehicle_key=vehicle_key, private=private)
    pair.run(1.5)
    assert pair.state is expected


def test_a_vehicle_with_another_key_is_refused_and_counted(tmp_path):
    pair = Pair(tmp_path, key=KEY, vehicle_key=OTHER)
    pair.run(1.5)
    assert pair.station.snapshot.source is None
    assert pair.station.snapshot.refused > 50


def test_a_vehicle_without_a_key_is_given_ours_and_obeys_nobody_else_from_then_on(tmp_path):
    pair = Pair(tmp_path, key=KEY, give_key=True)
    pair.run(4.0)
    assert "sent to 1/1" in pair.said
    assert pair.state is Signing.SIGNED
    assert pair.station.snapshot.source == (1, 1)
    stranger = Ground(tmp_path / "other")
    stranger.node = pair.node
    stranger.send(mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    assert not pair.is_armed
    pair.station.arm(pair.now)
    pair.run(0.2)
    assert pair.is_armed


def test_a_key_is_not_given_unasked(tmp_path):
    pair = Pair(tmp_path, key=KEY)
    pair.run(3.0)
    assert not any(map(is_secret, pair.sent))


def test_a_key_never_crosses_a_link_that_others_can_hear(tmp_path):
    pair = Pair(tmp_path, key=KEY, give_key=True, private=False)
    pair.run(3.0)
    assert not any(map(is_secret, pair.sent))
    assert pair.said.count("key NOT sent") == 1


def test_a_key_is_in_no_recording(tmp_path):
    pair = Pair(tmp_path, key=KEY, give_key=True)
    pair.run(4.0)
    assert any(is_secret(data) and KEY in data for data in pair.sent)
    assert KEY not in pair.log.getvalue()
    pair.station.receive(next(data for data in pair.sent if is_secret(data)), pair.now, 0)
    assert KEY not in pair.log.getvalue()


class Wire:
    """What asyncio would put on the network."""

    def __init__(self):
        self.sent = []

    def sendto(self, data, _to):
        self.sent.append(data)


def test_a_key_that_was_meant_for_loopback_is_dropped_when_the_vehicle_has_moved():
    link = Link(Station(keyring=Keyring({None: KEY}, timestamp=T)))
    link._transport, link._peer = Wire(), LOCAL
    link.station.endpoint.send_key(KEY, T, (1, 1))
    link._peer = FAR
    link._send()
    assert link._transport.sent == []
    link.station.endpoint.send_key(KEY, T, (1, 1))
    link._peer = LOCAL
    link._send()
    assert [is_secret(data) for data in link._transport.sent] == [True]


@pytest.mark.parametrize(
    ("state", "refused", "words"),
    [
        (Signing.SIGNED, 0, "signed"),
        (Signing.SIGNED, 7, "signed refused 7"),
        (Signing.OPEN, 0, "UNSIGNED"),
        (Signing.NO_KEY, 0, "vehicle signs, no key here"),
    ],
)
def test_the_status_line_shows_the_state(state, refused, words):
    snapshot = replace(EMPTY, source=(1, 1), heartbeat_at=0.0, signing=state, refused=refused)
    assert words in "".join(text for text, _ in StatusBar().draw(snapshot, 120, 1)[0])


def test_the_status_line_shows_a_vehicle_that_does_not_sign():
    line = StatusBar().draw(replace(EMPTY, signing=Signing.UNSIGNED_VEHICLE), 120, 1)[0]
    assert "VEHICLE NOT SIGNED" in "".join(text for text, _ in line)


def test_there_must_be_a_key_to_give(capsys):
    assert main(["connect", "--give-key"]) == 2
    assert capsys.readouterr().err == "darko-gcs: --give-key needs --signing-key: there is no key to give\n"


def test_a_bad_key_is_one_line_and_exit_code_2(tmp_path, capsys):
    (tmp_path / "key").write_text("no key")
    code = main(["connect", "--record", str(tmp_path), "--signing-key", str(tmp_path / "key")])
    error = capsys.readouterr().err
    assert (code, error.count("\n")) == (2, 1)
    assert "signing key" in error
