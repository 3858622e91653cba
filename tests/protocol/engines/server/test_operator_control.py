"""Operator control, message by message: who may control the vehicle, and what the others are answered."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.server.operator_control import OperatorControl
from protocol.events import OperatorChanged, OperatorRefused, OperatorRequested
from protocol.wire.codec import Codec
from protocol.wire.message import Peer

ARM, REQUEST_CONTROL = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL
ACCEPTED, DENIED, UNSUPPORTED, FAILED, NOT_IN_CONTROL = 0, 2, 3, 4, mavlink.MAV_RESULT_NOT_IN_CONTROL
FIRST, SECOND, COMPANION = Peer(255, 190, "first"), Peer(245, 190, "second"), Peer(1, 191, "companion")
NAN = math.nan
TAKE, SHARE, GIVE_BACK = (1, 0, 10), (1, 1, 10), (0, 0, 0)  # action, takeover, time-out [s]


def command(number, *params):
    return mavlink.MAVLink_command_long_message(1, 1, number, 0, *params, *[NAN] * (7 - len(params)))


class Stations:
    """An operator control, and what it says to whom."""

    def __init__(self):
        self.control = OperatorControl(1, 1, harmless={520})
        self.now = 100.0

    def send(self, peer, message):
        """A message from a peer: whether it is admitted, and the answers (receiver, message)."""
        (received,) = Codec(1, 1).decode(Codec(peer.system, peer.component).encode(message))
        admitted = self.control.admits(received, self.now, peer)
        return admitted, [(out.peer, out.message) for out in self.control.messages_to_send()]

    def ask(self, peer, *params):
        """The result that a peer gets for a request of control."""
        admitted, answers = self.send(peer, command(REQUEST_CONTROL, *params))
        assert not admitted
        (result,) = [m.result for to, m in answers if to == peer and m.get_type() == "COMMAND_ACK"]
        return result

    def may(self, peer, message):
        return self.send(peer, message)[0]

    @property
    def holder(self):
        return self.control.holder


@pytest.fixture
def stations():
    return Stations()


@pytest.fixture
def taken(stations):
    assert stations.ask(FIRST, *TAKE) == ACCEPTED
    assert stations.control.events() == [OperatorChanged(255, "requested")]
    return stations


def test_everyone_may_command_until_one_takes_control(stations):
    assert stations.holder is None
    assert all(stations.may(peer, command(ARM, 1)) for peer in (FIRST, SECOND, COMPANION))
    assert stations.ask(FIRST, *TAKE) == ACCEPTED
    assert [stations.may(peer, command(ARM, 1)) for peer in (FIRST, SECOND, COMPANION)] == [True, False, True]


CONTROLS = {
    "COMMAND_LONG": command(ARM, 0),
    "COMMAND_INT": mavlink.MAVLink_command_int_message(1, 1, 0, ARM, 0, 0, 0, 0, 0, 0, 0, 0, 0),
    "MISSION_COUNT": mavlink.MAVLink_mission_count_message(1, 1, 2, 1),
    "MISSION_WRITE_PARTIAL_LIST": mavlink.MAVLink_mission_write_partial_list_message(1, 1, 0, 1, 2),
    "MISSION_CLEAR_ALL": mavlink.MAVLink_mission_clear_all_message(1, 1, 255),
    "MISSION_SET_CURRENT": mavlink.MAVLink_mission_set_current_message(1, 1, 3),
    "PARAM_SET": mavlink.MAVLink_param_set_message(1, 1, b"K_1", 2.0, 9),
    "SET_MODE": mavlink.MAVLink_set_mode_message(1, 1, 5),
    "LOG_ERASE": mavlink.MAVLink_log_erase_message(1, 1),
    "DARKO_PLAN_FILE": mavlink.MAVLink_darko_plan_file_message(180, 7, 0, 1, 1, 180, [0] * 180),
    "SET_ATTITUDE_TARGET": mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0, [1, 0, 0, 0], 0, 0, 0, 0.5),
    "MANUAL_CONTROL": mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0),
}
ANSWERS = {
    "COMMAND_LONG": ("COMMAND_ACK", {"command": ARM, "result": NOT_IN_CONTROL}),
    "COMMAND_INT": ("COMMAND_ACK", {"command": ARM, "result": NOT_IN_CONTROL}),
    "MISSION_COUNT": ("MISSION_ACK", {"type": mavlink.MAV_MISSION_DENIED, "mission_type": 1}),
    "MISSION_WRITE_PARTIAL_LIST": ("MISSION_ACK", {"type": mavlink.MAV_MISSION_DENIED, "mission_type": 2}),
    "MISSION_CLEAR_ALL": ("MISSION_ACK", {"type": mavlink.MAV_MISSION_DENIED, "mission_type": 255}),
    "MISSION_SET_CURRENT": ("MISSION_ACK", {"type": mavlink.MAV_MISSION_DENIED, "mission_type": 0}),
    "PARAM_SET": (
        "PARAM_ERROR",
        {"param_id": "K_1", "param_index": -1, "error": mavlink.MAV_PARAM_ERROR_PERMISSION_DENIED},
    ),
    "DARKO_PLAN_FILE": ("DARKO_PLAN_FILE_ACK", {"crc": 7, "result": NOT_IN_CONTROL}),
}  # the others have no answer of their own


@pytest.mark.parametrize("kind", CONTROLS)
def test_what_controls_the_vehicle_is_refused_to_others_with_the_answer_of_its_protocol(taken, kind):
    assert taken.may(FIRST, CONTROLS[kind])
    admitted, answers = taken.send(SECOND, CONTROLS[kind])
    assert not admitted
    assert taken.control.events() == [OperatorRefused(SECOND, 255)]
    if kind not in ANSWERS:
        assert answers == []
        return
    ((to, message),) = answers
    name, fields = ANSWERS[kind]
    assert (to, message.get_type()) == (SECOND, name)
    assert {field: message.to_dict()[field] for field in fields} == fields
    assert (message.target_system, message.target_component) == (245, 190)


@pytest.mark.parametrize(
    "message",
    [
        command(520),
        command(mavlink.MAV_CMD_REQUEST_MESSAGE, 30),
        mavlink.MAVLink_mission_request_list_message(1, 1),
        mavlink.MAVLink_param_request_list_message(1, 1),
        mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        mavlink.MAVLink_command_long_message(2, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0),  # for another vehicle
    ],
    ids=lambda message: message.get_type(),
)
def test_questions_and_messages_for_others_are_refused_to_nobody(taken, message):
    assert taken.send(SECOND, message) == (True, [])
    assert taken.control.events() == []


def test_another_station_has_to_wait_for_the_one_in_control_which_is_notified(taken):
    admitted, answers = taken.send(SECOND, command(REQUEST_CONTROL, 1, 1, 7, 245))
    assert not admitted
    (to, notice), (asking, answer) = answers
    assert (to, asking, answer.result) == (FIRST, SECOND, FAILED)
    assert (notice.target_system, notice.target_component, notice.command) == (255, 190, REQUEST_CONTROL)
    assert [notice.param1, notice.param2, notice.param3, notice.param4] == [1.0, 1.0, 7.0, 245.0]
    assert taken.control.events() == [OperatorRequested(SECOND, 255)]
    assert taken.holder == FIRST


def test_the_one_in_control_is_notified_every_three_seconds_at_most(taken):
    notified = []
    for taken.now in (100.0, 102.9, 103.0, 105.9, 106.0):
        taken.may(FIRST, command(520))
        assert taken.ask(SECOND, *TAKE) == FAILED
        notified += [taken.now for event in taken.control.events() if isinstance(event, OperatorRequested)]
    assert notified == [100.0, 103.0, 106.0]


def test_control_is_given_back_by_the_one_who_has_it_alone(taken):
    assert taken.ask(SECOND, *GIVE_BACK) == NOT_IN_CONTROL
    assert taken.holder == FIRST
    assert taken.ask(FIRST, *GIVE_BACK) == ACCEPTED
    assert taken.holder is None
    assert taken.control.events() == [OperatorChanged(0, "given back")]
    assert taken.ask(FIRST, *GIVE_BACK) == ACCEPTED  # nobody has it: nothing changes
    assert taken.control.events() == []


def test_a_station_may_let_others_take_control(stations):
    assert stations.ask(FIRST, *SHARE) == ACCEPTED
    assert stations.control.takeover
    assert stations.ask(SECOND, *TAKE) == ACCEPTED
    assert stations.holder == SECOND
    assert not stations.control.takeover
    assert stations.control.events() == [OperatorChanged(255, "requested"), OperatorChanged(245, "requested")]
    assert stations.ask(SECOND, *SHARE) == ACCEPTED  # it may allow so later
    assert stations.ask(FIRST, *TAKE) == ACCEPTED


def test_who_arms_without_asking_is_in_control_until_disarming(stations):
    stations.control.armed(COMPANION, 100.0)
    assert stations.holder is None
    stations.control.armed(FIRST, 100.0)
    stations.control.armed(SECOND, 100.0)
    assert stations.holder == FIRST
    stations.control.disarmed()
    assert stations.holder is None
    assert stations.control.events() == [OperatorChanged(255, "armed"), OperatorChanged(0, "disarmed")]


def test_who_has_control_by_arming_lets_nobody_take_it(stations):
    assert stations.ask(FIRST, *SHARE) == ACCEPTED
    assert stations.ask(FIRST, *GIVE_BACK) == ACCEPTED
    stations.control.armed(FIRST, 100.0)
    assert not stations.control.takeover
    assert stations.ask(SECOND, *TAKE) == FAILED
    assert stations.holder == FIRST


def test_control_that_was_asked_for_outlasts_disarming(taken):
    taken.control.armed(FIRST, 100.0)
    taken.control.disarmed()
    assert taken.holder == FIRST
    assert taken.control.events() == []


def test_asking_after_arming_makes_control_outlast_disarming(stations):
    stations.control.armed(FIRST, 100.0)
    assert stations.ask(FIRST, *TAKE) == ACCEPTED
    stations.control.disarmed()
    assert stations.holder == FIRST
    assert stations.control.events() == [OperatorChanged(255, "armed")]


def test_control_ends_after_ten_seconds_without_a_message(taken):
    taken.now = 104.0
    taken.may(FIRST, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    assert taken.control.next_deadline() == 114.0
    taken.control.handle_timer(113.99)
    assert (taken.holder, taken.control.missed) == (FIRST, 255)
    taken.control.handle_timer(114.0)
    assert taken.holder is None
    assert taken.control.missed == 255
    assert taken.control.next_deadline() == math.inf
    assert taken.control.events() == [OperatorChanged(0, "silent for 10 s")]


def test_a_station_that_fell_silent_is_missed_until_it_comes_back_is_replaced_or_nothing_flies(taken):
    def silence():
        taken.now += 50.0
        taken.control.handle_timer(taken.now)
        assert taken.control.missed == 255

    silence()
    taken.may(SECOND, command(520))
    assert taken.control.missed == 255
    taken.may(FIRST, command(520))
    assert taken.control.missed is None
    for end in (taken.control.disarmed, lambda: taken.control.armed(FIRST, taken.now)):
        assert taken.ask(FIRST, *TAKE) == ACCEPTED
        silence()
        end()
        assert taken.control.missed == (255 if taken.holder else None)
    assert taken.holder == FIRST


def test_the_answer_goes_to_where_the_one_in_control_was_heard_last(taken):
    moved = Peer(255, 190, "moved")
    assert taken.may(moved, command(ARM, 1))
    assert taken.holder == moved
    _, answers = taken.send(SECOND, command(REQUEST_CONTROL, *TAKE))
    assert [to for to, _ in answers] == [moved, SECOND]


def test_without_the_rule_of_one_station_everyone_may_and_nobody_gets_control(taken):
    taken.control.only_one = False
    assert taken.holder is None
    assert taken.may(SECOND, command(ARM, 1))
    assert taken.ask(SECOND, *TAKE) == UNSUPPORTED
    taken.control.only_one = True
    assert taken.holder == FIRST


@pytest.mark.parametrize("action", [2.0, -1.0, 0.5, NAN])
def test_an_unknown_action_is_denied(taken, action):
    assert taken.ask(FIRST, action, 0, 10) == DENIED
    assert taken.ask(SECOND, action, 0, 10) == DENIED


def test_the_older_order_of_parameters_is_understood(stations):
    """Until 2026: 0, action, takeover, timeout."""
    assert stations.ask(FIRST, 0, 1, 1, 10) == ACCEPTED
    assert stations.holder == FIRST
    assert stations.control.takeover
    assert stations.ask(SECOND, 0, 1, 0, 10) == ACCEPTED
    assert stations.holder == SECOND
    assert stations.ask(SECOND, 0, 1, 10, 245) == ACCEPTED  # today's: action 0, its own id in param4
    assert stations.holder is None


def test_the_older_request_is_passed_on_in_the_order_of_today(taken):
    _, answers = taken.send(SECOND, command(REQUEST_CONTROL, 0, 1, 0, 12))
    notice = next(message for to, message in answers if to == FIRST)
    assert [notice.param1, notice.param2, notice.param3, notice.param4] == [1.0, 0.0, 12.0, 245.0]


def test_as_long_as_nobody_is_in_control_nobody_offers_it():
    assert OperatorControl(1, 1).holder is None
    assert not OperatorControl(1, 1).takeover
