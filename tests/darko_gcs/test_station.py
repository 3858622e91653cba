"""The ground station against the real vehicle node, on virtual time and without a socket."""

import io

import pytest

from darko_gcs.station import Station
from darko_gcs.widgets.status import StatusBar
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.events import CommandDone, MissionDownloaded, MissionUploaded, ParametersComplete
from protocol.plans import load
from protocol.tlog import TlogReader, TlogWriter
from tests.support.paths import DATA
from tests.support.station_pair import Pair

BEAT = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_CAMERA, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)


@pytest.fixture
def pair(tmp_path):
    made = Pair(tmp_path)
    made.run(2.5)
    return made


def test_a_flight_by_hand_take_off_go_to_hold_land(pair):
    pair.station.arm(pair.now)
    pair.run(0.5)
    pair.station.take_off(4.0, pair.now)
    pair.run(9.0)
    assert -pair.snapshot.p[2] == pytest.approx(4.0, abs=0.2)
    pair.station.go_to(3.0, -2.0, 5.0, pair.now)
    pair.run(9.0)
    assert pair.snapshot.p == pytest.approx((3.0, -2.0, -5.0), abs=0.2)
    pair.station.hold(pair.now)
    pair.run(1.0)
    pair.station.land(pair.now)
    pair.run(16.0)
    assert pair.snapshot.armed is False
    assert pair.snapshot.p[:2] == pytest.approx((3.0, -2.0), abs=0.3)
    assert all(e.result == 0 for e in pair.station.events() if isinstance(e, CommandDone))


def test_a_mission_comes_back_as_it_was_sent(pair):
    items = load(DATA / "square.plan").items
    pair.station.upload(items, pair.now)
    pair.run(1.0)
    assert pair.snapshot.mission == items
    pair.station.download(pair.now)
    pair.run(1.0)
    events = pair.station.events()
    assert any(isinstance(e, MissionUploaded) for e in events)
    assert next(e for e in events if isinstance(e, MissionDownloaded)).items == items


def test_a_lost_vehicle_is_shown_and_its_return_too(pair):
    pair.connected = False
    pair.run(4.0)
    assert pair.snapshot.lost
    assert "lost" in pair.snapshot.messages[-1].text
    pair.connected = True
    pair.run(2.0)
    assert not pair.snapshot.lost


def test_a_refusal_is_said_with_the_vehicles_reason(pair):
    pair.station.land(pair.now)
    pair.run(0.5)
    words = " ".join(line.text for line in pair.snapshot.messages)
    assert "nav land: temporarily rejected" in words
    assert "not in the air" in words


def test_transition_and_speed_go_out_as_their_commands(pair):
    pair.station.transition(pair.now, forward=True)
    pair.station.transition(pair.now + 0.1, forward=False)
    pair.station.change_speed(15.0, pair.now, over_ground=True)
    sent = [m for data in pair.station.outgoing(pair.now, 0) for m in Codec(1, 1).decode(data)]
    commands = [m for m in sent if m.get_type() == "COMMAND_LONG"]
    (transition,) = [m for m in commands if m.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION]  # one at a time
    (speed,) = [m for m in commands if m.command == mavlink.MAV_CMD_DO_CHANGE_SPEED]
    assert transition.param1 == mavlink.MAV_VTOL_STATE_FW
    assert (speed.param1, speed.param2, speed.param3) == (mavlink.SPEED_TYPE_GROUNDSPEED, 15.0, -1.0)


def test_a_transition_is_followed_and_can_be_cancelled(pair):
    pair.station.cancel(pair.now)
    assert pair.snapshot.messages[-1].text == "Nothing is in progress"
    pair.station.arm(pair.now)
    pair.run(0.5)
    pair.station.take_off(15.0, pair.now)
    pair.run(20.0)
    pair.station.transition(pair.now, forward=True)
    pair.run(2.0)
    assert pair.snapshot.in_progress.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION
    percent = pair.snapshot.in_progress.progress
    assert 0 < percent < 100
    assert f"do vtol transition {percent} %" in str(StatusBar().draw(pair.snapshot, 160, 1)[0])
    pair.station.cancel(pair.now)
    pair.run(0.5)
    assert pair.snapshot.in_progress is None
    words = [line.text for line in pair.snapshot.messages]
    assert "do vtol transition: cancelled" in words
    assert sum("in progress" in text for text in words) == 2  # once for nothing, once for the transition


def test_turning_round_in_a_transition_cancels_it_and_asks_for_the_other(pair):
    pair.station.arm(pair.now)
    pair.run(0.5)
    pair.station.take_off(15.0, pair.now)
    pair.run(20.0)
    pair.station.transition(pair.now, forward=True)
    pair.run(2.5)
    pair.station.transition(pair.now, forward=False)
    pair.run(15.0)
    done = [e for e in pair.station.events() if isinstance(e, CommandDone)]
    ends = [e.reason for e in done if e.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION]
    assert ends == ["CANCELLED", "ACCEPTED"]
    assert pair.snapshot.vtol_state == mavlink.MAV_VTOL_STATE_MC


def test_a_speed_the_vehicle_cannot_fly_is_answered(pair):
    pair.station.change_speed(400.0, pair.now)
    pair.run(0.5)
    assert any(line.text == "do change speed: denied" for line in pair.snapshot.messages)


def test_parameters_are_fetched_whole(pair):
    pair.station.fetch_parameters(pair.now)
    pair.run(2.0)
    assert any(isinstance(e, ParametersComplete) for e in pair.station.events())


def test_before_a_vehicle_is_heard_requests_say_so():
    station = Station()
    station.arm(1.0)
    assert "no vehicle" in station.snapshot.messages[-1].text


def test_everything_sent_and_received_is_recorded(pair):
    pair.station.arm(pair.now)
    pair.run(1.0)
    pair.station._recorder.flush()
    reader = TlogReader(pair.log.getvalue())
    assert not reader.damage
    assert len(reader.rows("COMMAND_LONG", (255, 190))) == 1
    assert len(reader.rows("COMMAND_ACK", (1, 1))) == 1
    assert len(reader.rows("ATTITUDE")) > 40
    assert mavlink.MAVLINK_MSG_ID_DARKO_HYBRID_STATE in reader.ids


class FullDisk(io.RawIOBase):
    def seek(self, *_):
        return 0

    def write(self, _):
        raise OSError(28, "No space left on device")


def test_a_full_disk_is_said_and_the_flight_goes_on(tmp_path):
    pair = Pair(tmp_path)
    pair.station = Station(TlogWriter(FullDisk()))
    pair.run(4.0)
    assert any("No space left" in line.text for line in pair.snapshot.messages)
    assert pair.snapshot.source == (1, 1)


def test_only_the_vehicle_draws_answers_to_where_it_speaks_from(pair):
    stranger = Codec(42, 1).encode(mavlink.MAVLink_ping_message(0, 0, 0, 0))
    assert not pair.station.receive(b"garbage", pair.now, 0)
    assert not pair.station.receive(stranger, pair.now, 0)
    for _, data in pair.vehicle.datagrams(pair.now + 5.0):
        assert pair.station.receive(data, pair.now, 0)


def test_gaps_in_what_other_components_say_are_no_loss_of_the_link(pair):
    camera = Codec(1, 100)
    for _ in range(20):
        camera.encode(BEAT)  # meant for others: the vehicle does not pass it on
        pair.station.receive(camera.encode(BEAT), pair.now, 0)
        pair.run(0.2)
    assert pair.snapshot.loss == 0.0
    pair.connected = False
    pair.run(0.5)
    pair.connected = True
    pair.run(4.0)
    assert 0.01 < pair.snapshot.loss < 0.2
