"""Included procedures: their names, arguments and reroutes, and files that are not opened."""

import pytest

from protocol.flight_plans import FlightPlanError, load_flight_plan, read_flight_plan
from protocol.flight_plans.expressions import expression_text
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.xml_elements import MAX_ELEMENTS
from protocol.limits import MAX_PLAN_FILE
from tests.support.plans import OUR_PLANS, plan_text

PROCEDURE = "<procedure><param name='far'/><blocks><block name='b'><go wp='A'/></block></blocks></procedure>"


def plan_with(include):
    return plan_text('<block name="main"/>', f"<includes>{include}</includes>")


def written(folder, include, procedure=PROCEDURE):
    (folder / "p.xml").write_text(procedure)
    path = folder / "plan.xml"
    path.write_text(plan_with(include))
    return path


def test_a_procedure_is_put_in_place():
    plan = load_flight_plan(OUR_PLANS / "with_procedure.xml")
    assert [block.name for block in plan.blocks] == ["Wait", "Bring down", "down.begin", "down.end"]
    assert (plan.waypoint("TD").x, plan.waypoint("AF").x) == (3.0, 10.0)  # the plan's own place comes first
    assert plan.waypoint("down.AF") == plan.waypoint("AF")
    begin, end = plan.blocks[2:]
    assert expression_text(begin.stages[1].climb.tree) == "2 * (-0.4 - 0.1)"
    assert expression_text(begin.stages[2].stages[0].until.tree) == "stage_time @GT $i"
    assert (begin.stages[3].block.name, end.stages[0].block.name) == ("down.end", "Wait")
    exception = plan.exceptions[1]
    assert exception.deroute.name == "Wait"
    assert "IndexOfBlock('down.begin')" in exception.cond.text
    assert "30" in exception.cond.text


@pytest.mark.parametrize(
    ("include", "words"),
    [
        ('<include name="i" procedure="p.xml"/>', "needs <arg name='far'>"),
        (
            '<include name="i" procedure="p.xml"><arg name="far" value="1"/><arg name="n" value="1"/></include>',
            "parameter 'n'",
        ),
        ('<include name="i" procedure="q.xml"/>', "cannot be found"),
        ('<include name="i" procedure="../p.xml"/>', " is outside "),
        ('<include name="i" procedure="/etc/passwd"/>', " is outside "),
        ('<include name="i" procedure="link.xml"/>', " is outside "),
        ('<include name="i" procedure="."/>', "is not a file"),
        ('<include name="i" procedure="http://x/p.xml"/>', "cannot be found"),
        ('<include name="i" procedure="plan.xml"/>', "<flight_plan> where <procedure> was expected"),
        ('<include name="i" procedure="p.xml" extra="1"/>', "no attribute 'extra'"),
        ('<include name="i"/>', "needs the attribute 'procedure'"),
        ('<other name="i"/>', "<other> where <include> was expected"),
        ('<include name="i" procedure="p.xml"/>' * 33, "more than 32 includes"),
    ],
)
def test_includes_that_are_refused(tmp_path, include, words):
    folder = tmp_path / "plans"
    folder.mkdir()
    (tmp_path / "p.xml").write_text(PROCEDURE)
    (folder / "link.xml").symlink_to(tmp_path / "p.xml")
    with pytest.raises(FlightPlanError) as caught:
        load_flight_plan(written(folder, include))
    assert words in str(caught.value)


def test_a_plan_with_its_procedures_holds_ten_thousand_elements_and_no_more(tmp_path):
    include = '<include name="i" procedure="p.xml"/>'
    procedure = "<procedure><blocks><block name='b'>{}</block></blocks></procedure>"
    stages = MAX_ELEMENTS - 11  # the others: the plan, its sections, waypoints, include and blocks
    plan = load_flight_plan(written(tmp_path, include, procedure.format("<go wp='A'/>" * stages)))
    assert len(plan.blocks[-1].stages) == stages
    with pytest.raises(FlightPlanError, match=f"more than {MAX_ELEMENTS} elements"):
        load_flight_plan(written(tmp_path, include, procedure.format("<go wp='A'/>" * (stages + 1))))


def test_a_procedure_is_not_read_beyond_the_size_of_a_plan(tmp_path):
    procedure = "<procedure/>" + " " * MAX_PLAN_FILE
    with pytest.raises(FlightPlanError, match=f"longer than {MAX_PLAN_FILE} bytes"):
        load_flight_plan(written(tmp_path, '<include name="i" procedure="p.xml"/>', procedure))


def test_a_fault_in_a_procedure_names_its_file(tmp_path):
    path = written(
        tmp_path, '<include name="i" procedure="p.xml"/>', "<procedure>\n<blocks><bock/></blocks></procedure>"
    )
    with pytest.raises(FlightPlanError, match=r"p\.xml:2:9: <bock>"):
        load_flight_plan(path)


def test_without_files_nothing_is_included():
    with pytest.raises(FlightPlanError, match="not available here"):
        read_flight_plan(plan_with('<include name="i" procedure="p.xml"/>').encode(), "t")


def test_a_folder_that_is_named_may_hold_procedures(tmp_path):
    for name in ("plans", "shared"):
        (tmp_path / name).mkdir()
    path = written(tmp_path / "plans", '<include name="i" procedure="q.xml"><arg name="far" value="1"/></include>')
    (tmp_path / "shared" / "q.xml").write_text(PROCEDURE)
    assert load_flight_plan(path, tmp_path / "shared").blocks[-1].name == "i.b"
    (tmp_path / "shared" / "q.xml").unlink()
    (tmp_path / "shared" / "q.xml").symlink_to(tmp_path / "plans" / "p.xml")
    with pytest.raises(FlightPlanError, match="is outside"):
        load_flight_plan(path, tmp_path / "shared")


def test_variables_modules_and_macros_of_a_procedure_are_the_plans_too(tmp_path):
    procedure = (
        "<procedure><header>\n#define HALF 0.5\n</header>"
        '<variables><variable var="v" init="HALF"/><variable var="w"/></variables><modules><module name="m"/></modules>'
        '<blocks><block name="b"><stay wp="A" until="v > HALF"/></block></blocks></procedure>'
    )
    plan = load_flight_plan(written(tmp_path, '<include name="i" procedure="p.xml"/>', procedure))
    assert [variable.var for variable in plan.variables][-2:] == ["v", "w"]
    assert [module.name for module in plan.modules] == ["m"]
    assert check_flown(plan).refusals == ()
