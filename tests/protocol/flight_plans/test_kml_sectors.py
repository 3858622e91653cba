"""Sectors in KML files: read from the plan's folder, one sector for each polygon."""

import pytest

from protocol.flight_plans import FlightPlanError, load_flight_plan, read_flight_plan, render_flight_plan
from protocol.flight_plans.plan_check import check_flown
from tests.support.plans import plan_text

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
