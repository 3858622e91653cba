"""``darko-gcs plan``: its words, what it tells, and its requests on the wire to a real vehicle."""

import json

import pytest

from darko_gcs.__main__ import COMMANDS, main
from darko_gcs.commands import plan as plan_command
from darko_gcs.errors import GroundError
from darko_gcs.tasks.plan_request import blocks_table, file_to_send, send_request, status_table
from protocol.events import CommandDone, FlightPlanReceived
from protocol.flight_plans import read_flight_plan
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.planned_snapshots import planned
from tests.support.plans import OUR_PLANS, VOLIERE, plan_of
from tests.support.vehicle.planned_flight import PlannedFlight

PLAN = plan_of(
    '<block name="Stay"><stay wp="A"/></block><block name="Go"><stay wp="B"/></block>',
    '<variables><variable var="k" init="2" min="1" max="5"/></variables>',
)


def asked(*words):
    return plan_command.parser(COMMANDS).parse_args(words)


@pytest.fixture
def link(tmp_path):
    link = LinkedStation(tmp_path, aircraft=PlannedFlight(PLAN, up=2.0, arena="open").aircraft)
    assert link.run(10.0, lambda: link.events_of(FlightPlanReceived))
    return link


def send(link, *words):
    command = send_request(link.station, link.snapshot.flight_plan, asked(*words), link.now)
    link.run(1.0)
    (done,) = [event for event in link.events_of(CommandDone) if event.command == command]
    return done.reason


@pytest.mark.parametrize("words", [[], ["jump"], ["move", "A", "x", "0"], ["set", "k"], ["dance"]])
def test_incomplete_requests_are_refused(words, capsys):
    with pytest.raises(SystemExit):
        main(["plan", *words])
    assert "darko-gcs plan" in capsys.readouterr().err


def test_blocks_waypoints_and_variables_are_named(link):
    assert send(link, "jump", "Go") == "ACCEPTED"
    assert send(link, "move", "A", "1.5", "-2") == "ACCEPTED"
    assert send(link, "set", "k", "4") == "ACCEPTED"
    plan = link.snapshot.flight_plan
    told = status_table(link.snapshot, plan)
    assert (told["block"], told["flown"], told["waypoints"]["A"], told["variables"]) == (
        "Go", True, [1.5, -2.0, plan.points[2].position[2]], {"k": 4.0},
    )  # fmt: skip


def test_a_block_is_also_named_by_its_number(link):
    assert send(link, "jump", "1") == "ACCEPTED"


def test_a_value_outside_its_limits_is_denied(link):
    assert send(link, "set", "k", "9") == "DENIED"


def test_the_plan_is_flown_again(link):
    link.station.hold(link.now)
    link.run(1.0)
    assert not link.snapshot.flies_plan
    link.events.clear()
    assert send(link, "fly") == "ACCEPTED"
    assert link.run(1.0, lambda: link.snapshot.flies_plan)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["jump", "Nowhere"], "no block 'Nowhere': it has Stay, Go, HOME"),
        (["move", "X", "0", "0"], "no waypoint 'X'"),
        (["set", "x", "1"], "no variable 'x': it has k"),
    ],
)
def test_what_the_plan_does_not_have_is_refused_here(link, words, text):
    with pytest.raises(GroundError, match=text):
        send_request(link.station, link.snapshot.flight_plan, asked(*words), link.now)


def test_tables_are_json():
    _, s = planned()
    told = json.loads(json.dumps(status_table(s, s.flight_plan)))
    assert told["exceptions"] == [{"time": 50.0, "text": "datalink_time > 10", "from": "Engine off", "to": "Takeoff"}]
    blocks = blocks_table(s.flight_plan)
    assert [block["name"] for block in blocks if block["present"]] == ["Standby"]
    assert [block["name"] for block in blocks if block["locked"]] == ["Camera"]


def test_a_file_is_sent_with_its_procedures_in_place():
    data = file_to_send(OUR_PLANS / "with_procedure.xml")
    assert b"include" not in data
    assert read_flight_plan(data, "sent").blocks


def test_a_file_that_cannot_be_flown_is_refused_with_its_place(tmp_path):
    path = tmp_path / "broken.xml"
    path.write_text(VOLIERE.read_text().replace('<stay wp="STDBY"/>', '<stay wp="STDBY" until="1 +"/>'))
    with pytest.raises(GroundError, match=r"broken\.xml:\d+:\d+"):
        file_to_send(path)
