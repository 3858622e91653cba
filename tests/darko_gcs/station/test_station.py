"""The ground station against the real vehicle node, on a virtual clock and without a socket."""

import io

import pytest

from darko_gcs.station.station import Station
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from protocol.events import CommandDone, MissionDownloaded, MissionUploaded, ParametersComplete
from protocol.plans import load
from protocol.tlog import TlogReader, TlogWriter
from protocol.wire.codec import Codec
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.messages import station_heartbeat
from tests.support.gcs.screens import panel_text
from tests.support.paths import DATA

TRANSITION = mavlink.MAV_CMD_DO_VTOL_TRANSITION
RECORDED = (("COMMAND_LONG", (255, 190)), ("COMMAND_ACK", (1, 1)))  # kinds of messages with their senders


@pytest.fixture
def link(tmp_path):
    linked = LinkedStation(tmp_path)
    linked.run(2.5)
    return linked


def climb(link, height):
    link.station.arm(link.now)
    link.run(0.5)
    link.station.take_off(height, link.now)


@pytest.mark.long
def test_a_flight_by_hand_takes_off_goes_to_a_point_holds_and_lands(link):
    climb(link, 4.0)
    link.run(9.0)
    assert -link.snapshot.position.p[2] == pytest.approx(4.0, abs=0.2)
    link.station.go_to(3.0, -2.0, 5.0, link.now)
    link.run(9.0)
    assert link.snapshot.position.p == pytest.approx((3.0, -2.0, -5.0), abs=0.2)
    assert "Go to: arrived at 3.0 m north, -2.0 m east of home, 5.0 m above it" in link.lines
    link.station.hold(link.now)
    link.run(1.0)
    link.station.land(link.now)
    link.run(16.0)
    assert link.snapshot.status.armed is False
    assert link.snapshot.position.p[:2] == pytest.approx((3.0, -2.0), abs=0.3)
    assert all(event.result == mavlink.MAV_RESULT_ACCEPTED for event in link.events_of(CommandDone))


def test_a_mission_comes_back_as_it_was_sent(link):
    items = load(DATA / "square.plan").items
    link.station.plans.upload(items, link.now)
    link.run(1.0)
    assert link.snapshot.plans.mission == items
    link.station.plans.download(link.now)
    link.run(1.0)
    assert link.events_of(MissionUploaded)
    assert link.events_of(MissionDownloaded)[0].items == items


def test_loss_and_return_of_the_vehicle_are_shown(link):
    link.connected = False
    link.run(4.0)
    assert link.snapshot.link.lost
    assert "lost" in link.lines[-1]
    link.connected = True
    link.run(2.0)
    assert not link.snapshot.link.lost


def test_a_refusal_is_shown_with_the_vehicles_reason(link):
    link.station.land(link.now)
    link.run(0.5)
    assert "land: temporarily rejected" in link.text
    assert "not in the air" in link.text


def test_transition_and_speed_are_sent_as_their_commands(link):
    link.station.transition(link.now, forward=True)
    link.station.transition(link.now + 0.1, forward=False)
    link.station.change_speed(15.0, link.now, over_ground=True)
    sent = [m for data in link.station.outgoing(link.now, 0) for m in Codec(1, 1).decode(data)]
    commands = [m for m in sent if m.get_type() == "COMMAND_LONG"]
    (transition,) = [m for m in commands if m.command == TRANSITION]  # one at a time
    (speed,) = [m for m in commands if m.command == mavlink.MAV_CMD_DO_CHANGE_SPEED]
    assert transition.param1 == mavlink.MAV_VTOL_STATE_FW
    assert (speed.param1, speed.param2, speed.param3) == (mavlink.SPEED_TYPE_GROUNDSPEED, 15.0, -1.0)


@pytest.mark.long
def test_a_transition_shows_its_progress_and_can_be_cancelled(link):
    link.station.cancel(link.now)
    assert link.lines[-1] == "No command is in progress"
    climb(link, 15.0)
    link.run(20.0)
    link.station.transition(link.now, forward=True)
    link.run(2.0)
    assert link.snapshot.operator.in_progress.command == TRANSITION
    percent = link.snapshot.operator.in_progress.progress
    assert 0 < percent < 100
    assert f"transition {percent} %" in panel_text(StatusBar(), link.snapshot, width=160, height=1)
    link.station.cancel(link.now)
    link.run(0.5)
    assert link.snapshot.operator.in_progress is None
    assert "front transition: cancelled" in link.lines
    assert sum("in progress" in line for line in link.lines) == 2  # the first cancel, and the transition


@pytest.mark.long
def test_the_opposite_transition_cancels_the_one_in_progress(link):
    climb(link, 15.0)
    link.run(20.0)
    link.station.transition(link.now, forward=True)
    link.run(2.5)
    link.station.transition(link.now, forward=False)
    link.run(15.0)
    ends = [event.reason for event in link.events_of(CommandDone) if event.command == TRANSITION]
    assert ends == ["CANCELLED", "ACCEPTED"]
    assert link.snapshot.status.vtol_state == mavlink.MAV_VTOL_STATE_MC


def test_a_speed_that_the_vehicle_cannot_fly_is_refused(link):
    link.station.change_speed(400.0, link.now)
    link.run(0.5)
    assert "airspeed 400.0 m/s: denied" in link.lines


def test_the_acceptance_of_a_speed_names_which_one_was_set(link):
    link.station.change_speed(2.5, link.now, over_ground=True)
    link.run(0.5)
    assert any(line.startswith("hover speed 2.5 m/s: ") for line in link.lines)


def test_all_parameters_are_fetched(link):
    link.station.fetch_parameters(link.now)
    link.run(2.0)
    assert link.events_of(ParametersComplete)


def test_a_request_before_a_vehicle_is_heard_is_reported():
    station = Station()
    station.arm(1.0)
    assert "no vehicle" in station.snapshot.log.lines[-1].text


def test_all_frames_sent_and_received_are_recorded(link):
    link.station.arm(link.now)
    link.run(1.0)
    reader = TlogReader(link.recording())
    assert not reader.damage
    sent, answers = ([reader.decode(row).command for row in reader.rows(*kind)] for kind in RECORDED)
    assert sent == answers
    assert sent.count(mavlink.MAV_CMD_COMPONENT_ARM_DISARM) == 1
    assert len(reader.rows("ATTITUDE")) > 40
    assert mavlink.MAVLINK_MSG_ID_DARKO_HYBRID_STATE in reader.ids


class FullDisk(io.RawIOBase):
    def seek(self, *_):
        return 0

    def write(self, _):
        raise OSError(28, "No space left on device")


def test_a_full_disk_is_reported_and_the_flight_goes_on(tmp_path):
    link = LinkedStation(tmp_path, recorder=TlogWriter(FullDisk()))
    link.run(4.0)
    assert any("No space left" in line for line in link.lines)
    assert link.snapshot.identity.source == (1, 1)


def test_answers_go_only_to_addresses_that_the_vehicle_sends_from(link):
    ping = mavlink.MAVLink_ping_message(time_usec=0, seq=0, target_system=0, target_component=0)
    assert not link.receive(b"garbage")
    assert not link.receive(Codec(42, 1).encode(ping))
    for _, data in link.vehicle.datagrams(link.now + 5.0):
        assert link.receive(data)


def test_gaps_in_the_messages_of_other_components_are_no_loss_of_the_link(link):
    camera, beat = Codec(1, 100), station_heartbeat(mavlink.MAV_TYPE_CAMERA)
    for _ in range(20):
        camera.encode(beat)  # for another station: the vehicle does not forward it
        link.receive(camera.encode(beat))
        link.run(0.2)
    assert link.snapshot.link.loss == 0.0
    link.connected = False
    link.run(0.5)
    link.connected = True
    link.run(4.0)
    assert 0.01 < link.snapshot.link.loss < 0.2
