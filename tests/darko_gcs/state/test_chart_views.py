"""Views of charts: kept in a file, changed, and checked when they are read."""

import pytest

from darko_gcs.state.chart_views import BUILT_IN, ChartView, ChartViews
from protocol.errors import FileError
from protocol.flight_log.field_expressions import quantity
from protocol.tlog import read_tlog
from tests.support.paths import DATA

VIEW = ChartView("my 'own' \u00e9", (("ATTITUDE.roll", "ATTITUDE.pitch"), ("VFR_HUD.alt",)))


def test_a_saved_view_is_there_again_before_those_to_begin_with(tmp_path):
    file = tmp_path / "darko" / "views.toml"
    ChartViews(file).save(VIEW)
    ChartViews(file).save(ChartView("second", (("VFR_HUD.climb",),)))
    views = ChartViews(file)
    assert list(views.load()) == ["second", VIEW.name, *BUILT_IN]
    assert views.view(VIEW.name) == VIEW


def test_a_view_takes_the_place_of_one_of_its_name_and_can_be_deleted(tmp_path):
    views = ChartViews(tmp_path / "views.toml")
    views.save(VIEW)
    views.save(VIEW.without(0, 0))
    assert views.view(VIEW.name).charts == (("ATTITUDE.pitch",), ("VFR_HUD.alt",))
    views.delete(VIEW.name)
    assert ChartViews(views.file).load() == BUILT_IN
    with pytest.raises(FileError, match="no view that was saved"):
        views.delete("attitude")


def test_the_height_that_is_ready_made_is_the_one_that_the_screens_show():
    assert BUILT_IN["height and speed"].charts[0] == ("altitude",)


def test_expressions_come_and_go_with_their_charts():
    view = ChartView().with_expression(0, "A.b").with_expression(0, "A.c").with_expression(5, "D.e")
    assert view.charts == (("A.b", "A.c"), ("D.e",))
    assert view.expressions == ("A.b", "A.c", "D.e")
    assert view.without(1, 0).charts == (("A.b", "A.c"),)
    assert view.without(1, 0).name == view.name
    assert ChartView("attitude", (("A.b",),)).without(0, 0) == ChartView()  # what is put in is another view


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("view = [[1]]", "not a list of charts"),
        ("view = 'x'", "not a list of charts"),
        ("view = [[]]", "not a list of charts"),
        ("view = [", "not TOML"),
        (f"view = {[['A.b'] * 61]}", "more than 12 charts or 60"),
    ],
)
def test_an_error_in_the_file_is_told_and_nothing_is_overwritten(tmp_path, text, told):
    file = tmp_path / "views.toml"
    file.write_text(text)
    with pytest.raises(FileError, match=told):
        ChartViews(file).load()
    with pytest.raises(FileError, match=told):
        ChartViews(file).save(VIEW)
    assert file.read_text() == text


def test_a_view_needs_a_name_and_an_unknown_one_names_those_there_are(tmp_path):
    views = ChartViews(tmp_path / "views.toml")
    with pytest.raises(FileError, match="name of 1 to"):
        views.save(VIEW._replace(name=""))
    with pytest.raises(FileError, match="no view heigt: there is attitude, height and speed"):
        views.view("heigt")


@pytest.mark.parametrize("text", [text for view in BUILT_IN.values() for text in view.expressions])
def test_views_to_begin_with_name_what_the_vehicle_sends(text):
    assert len(quantity(read_tlog(DATA / "square-flight.tlog"), text).values)
