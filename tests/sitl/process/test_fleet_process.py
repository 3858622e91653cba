"""Start of each vehicle of a fleet, and the options that several vehicles cannot combine."""

from pathlib import Path

import pytest

from protocol.dialect import mavlink
from sitl.commands.run import parser
from sitl.errors import SitlError
from sitl.mavlink.services.command_service import ExitRequest
from sitl.process.fleet_process import Flown, Squadron, closing_line, grid, member_arguments
from sitl.tools.error_guard import ErrorGuard
from tests.support.logs import bare


def members(*options):
    return member_arguments(parser({}).parse_args(options), Path("state"))


def test_vehicles_start_on_a_grid_with_ids_seeds_and_folders_of_their_own():
    made = members("--vehicles", "3", "--sysid", "7", "--seed", "40", "--start", "10,20,3,90", "--spacing", "4")
    assert [one.start for one in made] == [(10, 20, 3, 90), (10, 24, 3, 90), (14, 20, 3, 90)]
    assert [(one.sysid, one.seed) for one in made] == [(7, 40), (8, 41), (9, 42)]
    assert [one.state_dir for one in made] == [
        Path("state/vehicle-7"),
        Path("state/vehicle-8"),
        Path("state/vehicle-9"),
    ]


def test_one_vehicle_alone_forwards_between_peers():
    assert [one.forwards for one in members("--vehicles", "3")] == [True, False, False]


@pytest.mark.parametrize("count", [1, 2, 5, 9, 20])
def test_a_grid_is_as_square_as_can_be_and_has_each_place_once(count):
    places = grid(count)
    rows, columns = (max(place[axis] for place in places) + 1 for axis in (0, 1))
    assert len(set(places)) == count
    assert 0 <= columns - rows <= 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--scenario", "far-target"), "--scenario: not with --vehicles 2"),
        (("--day", "a.toml"), "--day: not with --vehicles 2"),
        (("--flight-plan", "a.xml"), "--flight-plan: not with --vehicles 2"),
        (("--speed", "0"), "--speed 0: not with --vehicles 2"),
        (("--sysid", "254"), "system ids 254 to 255 would go beyond 254"),
    ],
)
def test_what_cannot_be_combined_is_refused_by_name(options, words):
    with pytest.raises(SitlError, match=words):
        members("--vehicles", "2", *options)


@pytest.mark.parametrize("option", [("--vehicles", "0"), ("--sysid", "255"), ("--spacing", "0")])
def test_senseless_numbers_are_refused_with_their_option(option, capsys):
    with pytest.raises(SystemExit):
        parser({}).parse_args(option)
    assert f"argument {option[0]}" in capsys.readouterr().err


# Several vehicles in one process: delivery of datagrams, order of their flights, and their ends.


HEARTBEAT = bare(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), system=255)
PEER = ("127.0.0.1", 5000)


def order(system):
    return bare(mavlink.MAVLink_command_long_message(system, 1, 400, 0, *[0.0] * 7), system=255)


class Craft:
    """A node that only notes what it is asked."""

    def __init__(self, step=10, *, forwards=False):
        self.step, self.forwards, self.exit_request = step, forwards, None
        self.heard, self.flown, self.spoke, self.peers = [], 0, 0, (PEER,)
        self.broken = None

    def receive(self, data, _peer, _now):
        self.heard.append(data)

    def periods_to_fly(self):
        return self.step

    def advance(self, periods):
        if self.broken is not None:
            raise self.broken
        self.flown += periods

    def datagrams(self, _now):
        self.spoke += 1
        return [(None, b"x")]

    def know(self, peers):
        self.known = list(peers)


@pytest.fixture
def crafts():
    return {1: Craft(forwards=True), 2: Craft(), 3: Craft(5)}


@pytest.fixture
def told():
    return []


@pytest.fixture
def squadron(crafts):
    made = Squadron(crafts, {1, 2, 3, 4}, lambda _system: Craft())
    made.receive(HEARTBEAT, PEER, 0.0)
    for craft in crafts.values():
        craft.heard.clear()
    return made


@pytest.mark.parametrize(
    ("datagram", "hearers"),
    [
        (HEARTBEAT, {1, 2, 3}),
        (order(0), {1, 2, 3}),
        (order(2), {2}),
        (order(2) + order(3), {2, 3}),
        (order(4), set()),  # flown by another process
        (order(77), {1}),  # of nobody here: the vehicle that forwards knows where it is
        (b"nonsense", set()),
    ],
)
def test_a_datagram_reaches_those_it_names(squadron, crafts, datagram, hearers):
    squadron.receive(datagram, PEER, 1.0)
    assert {system for system, craft in crafts.items() if craft.heard} == hearers


def test_a_new_peer_is_heard_by_all_so_that_all_speak_to_it(squadron, crafts):
    squadron.receive(order(2), ("127.0.0.1", 5001), 1.0)
    assert all(craft.heard for craft in crafts.values())


def test_each_flies_in_its_own_turn_and_all_as_far_as_time_has_come(squadron, crafts):
    clock = 0
    while clock < 2000:
        periods = squadron.periods_to_fly()
        assert periods > 0
        squadron.advance(periods)
        clock += periods
    starts = {1: 0, 2: 309, 3: 118}  # spread over the first second
    for system, craft in crafts.items():
        assert -craft.step < craft.flown - (clock - starts[system]) < craft.step


def test_who_has_neither_flown_nor_heard_anything_says_nothing(squadron, crafts):
    squadron.datagrams(0.0)  # the answers to the first heartbeat
    spoken = {system: craft.spoke for system, craft in crafts.items()}
    squadron.receive(order(3), PEER, 1.0)
    assert len(squadron.datagrams(1.0)) == 1
    assert {s for s, craft in crafts.items() if craft.spoke > spoken[s]} == {3}


def test_a_vehicle_that_cannot_fly_on_is_named_and_the_others_fly_on(crafts, told):
    squadron = Squadron(crafts, {1, 2, 3}, lambda _system: Craft(), told.append)
    crafts[1].broken = SitlError("not finite")
    for _ in range(200):
        squadron.advance(squadron.periods_to_fly())
    assert told == ["vehicle 1 cannot fly on: not finite"]
    assert (list(squadron.nodes), squadron.lost) == ([2, 3], 1)
    assert crafts[2].flown > 100 < crafts[3].flown


@pytest.mark.parametrize("ask", ["receive", "advance", "datagrams"])
def test_an_error_that_nobody_expects_leaves_one_vehicle_out(crafts, told, monkeypatch, ask):
    monkeypatch.setattr(ErrorGuard, "raises", False)
    squadron = Squadron(crafts, {1, 2, 3}, lambda _system: Craft(), told.append)
    setattr(crafts[2], ask, lambda *_: 1 / 0)
    for _ in range(200):
        squadron.receive(HEARTBEAT, PEER, 0.0)
        squadron.advance(squadron.periods_to_fly())
        squadron.datagrams(0.0)
    (line,) = told
    assert line.startswith("vehicle 2 cannot fly on: internal error in ")
    assert line.endswith("division by zero")
    assert list(squadron.nodes) == [1, 3]


def test_a_vehicle_that_cannot_boot_anew_ends_alone(crafts, told):
    def reboot(_system):
        raise SitlError("mission.plan is damaged")

    squadron = Squadron(crafts, {1, 2, 3}, reboot, told.append)
    crafts[3].exit_request = ExitRequest.REBOOT
    assert not squadron.is_over()
    assert told == ["vehicle 3 cannot fly on: mission.plan is damaged"]


def test_without_a_vehicle_left_it_is_over(crafts, told):
    squadron = Squadron({1: crafts[1]}, {1}, lambda _system: Craft(), told.append)
    crafts[1].broken = SitlError("not finite")
    squadron.advance(squadron.periods_to_fly())
    assert squadron.periods_to_fly() > 0
    assert squadron.is_over()


def test_one_is_rebooted_and_one_ends_while_the_third_flies_on(squadron, crafts):
    crafts[1].exit_request, crafts[2].exit_request = ExitRequest.REBOOT, ExitRequest.SHUTDOWN
    assert not squadron.is_over()
    assert list(squadron.nodes) == [1, 3]
    assert squadron.nodes[1] is not crafts[1]
    assert squadron.nodes[1].known == [PEER]
    squadron.advance(squadron.periods_to_fly())
    for craft in squadron.nodes.values():
        craft.exit_request = ExitRequest.SHUTDOWN
    assert squadron.is_over()


def test_the_closing_line_sums_what_was_missed_and_tells_the_longest_delay():
    line = closing_line([Flown(60.0, 30.0, 1, 0.025), Flown(60.1, 27.0, 2, 0.0311)])
    assert line == "flown for 60.1 s: 3 ticks missed, none more than 31.1 ms late; processes took 50 + 45 % of a core"
