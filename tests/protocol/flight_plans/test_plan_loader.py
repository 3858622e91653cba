"""Opens flight plans with the procedures and KML files they name, and nothing outside the plan's folder."""

import pytest

from protocol.flight_plans import FlightPlanError, load_flight_plan, read_flight_plan, render_flight_plan
from protocol.flight_plans.expressions import expression_text
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.xml_elements import MAX_ELEMENTS
from protocol.ranges import MAX_PLAN_FILE
from tests.support.plans import OUR_PLANS, plan_text

KML = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Folder>
  <Placemark><name>Flying area</name><Polygon><outerBoundaryIs><LinearRing><coordinates>
    1.48,43.56,0 1.49,43.56,0 1.49,43.57,0 1.48,43.57,0 1.48,43.56,0
  </coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>
  <Placemark><name>Tree</name><Point><coordinates>1.485,43.565</coordinates></Point></Placemark>
  <Placemark><name>Pond</name><LineString><coordinates>1.481,43.561 1.482,43.561 1.482,43.562</coordinates>
  </LineString></Placemark>
</Folder></Document></kml>"""
BEFORE = '<sectors><!-- the area --><kml file="area.kml"/></sectors>'
BLOCKS = '<block name="a"><stay wp="A" until="InsideFlying_area(GetPosX(), GetPosY()) @AND !InsidePond(0, 0)"/></block>'


def load(tmp_path, kml=KML, before=BEFORE):
    (tmp_path / "plan.xml").write_text(plan_text(BLOCKS, before))
    if kml is not None:
        (tmp_path / "area.kml").write_text(kml)
    return load_flight_plan(tmp_path / "plan.xml")


def test_every_polygon_is_a_sector(tmp_path):
    plan = load(tmp_path)
    assert [(sector.name, len(sector.corners)) for sector in plan.sectors] == [("Flying_area", 4), ("Pond", 3)]
    corner = plan.waypoint("_Flying_area_3")
    assert (corner.lat, corner.lon, corner.is_shown) == (43.57, 1.49, False)
    assert check_flown(plan).findings == ()


def test_a_polygon_of_two_corners_has_nothing_inside(tmp_path):
    check = check_flown(load(tmp_path, KML.replace("1.482,43.562", "")))
    assert check.refusals == ()
    assert [finding.construct for finding in check.notices] == ["sector Pond"]


def test_a_corner_may_be_at_a_pole_and_at_the_end_of_longitudes(tmp_path):
    plan = load(tmp_path, KML.replace("1.482,43.562", "-180,90"))
    corner = plan.waypoint("_Pond_3")
    assert (corner.lat, corner.lon) == (90.0, -180.0)


def test_the_plan_is_written_as_one_file(tmp_path):
    plan = load(tmp_path)
    text = render_flight_plan(plan)
    assert "the area" in text
    assert read_flight_plan(text.encode(), "again") == plan


def test_a_file_that_is_not_there_leaves_its_sectors_out(tmp_path):
    check = check_flown(load(tmp_path, kml=None))
    assert [str(finding).split(": ", 1)[1] for finding in check.notices] == ["kml area.kml: the file is not there"]
    assert {finding.construct for finding in check.refusals} == {"InsideFlying_area()", "InsidePond()"}


@pytest.mark.parametrize(
    ("kml", "words"),
    [
        ("<kml><Document/></kml>", "holds no polygon"),
        ("<kml", "not XML"),
        ('<!DOCTYPE k [<!ENTITY e "x">]><kml>&e;</kml>', "entities"),
        (KML.replace("1.482,43.562", "1.482"), "'1.482' is not a longitude and a latitude"),
        (KML.replace("1.482,43.562", "1.482,90.1"), "not on the globe"),
        (KML.replace("1.482,43.562", "-180.1,43"), "not on the globe"),
        (KML.replace("1.482,43.562", "nan,4"), "not on the globe"),
        (KML.replace("<name>Pond</name>", ""), "a polygon has no <name>"),
        (KML.replace("Pond", "Flying area"), "a second"),
    ],
)
def test_files_that_are_refused(tmp_path, kml, words):
    with pytest.raises(FlightPlanError, match=words) as caught:
        load(tmp_path, kml)
    assert "area.kml" in str(caught.value)


def test_a_plan_names_32_kml_files_at_most(tmp_path):
    files = '<kml file="none.kml"/>' * 32
    assert len(load(tmp_path, None, f"<sectors>{files}</sectors>").sectors) == 32
    with pytest.raises(FlightPlanError, match="more than 32 KML files"):
        load(tmp_path, None, f'<sectors>{files}<kml file="none.kml"/></sectors>')


def test_nothing_outside_of_the_plans_folder_is_opened(tmp_path):
    folder = tmp_path / "plans"
    folder.mkdir()
    (tmp_path / "area.kml").write_text(KML)
    with pytest.raises(FlightPlanError, match="outside"):
        load(folder, None, BEFORE.replace("area.kml", "../area.kml"))


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


@pytest.mark.long
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
