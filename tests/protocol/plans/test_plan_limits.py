"""Plans and their files at the limits of their sizes and of their numbers."""

import json

import pytest

from protocol.errors import FileError
from protocol.frames import Geodetic
from protocol.plans import Plan, load, save
from protocol.plans.fence_rally import fence_items, rally_items, with_fence, with_rally
from protocol.tools.files import JsonTable
from tests.support.vehicle.fence_shapes import POINTS, SHAPES

MAX_SIZE = 16 * 1024 * 1024
HOME = "0 1 0 16 0 0 0 0 {} {} {} 1"
ITEM = "1 0 3 {} 0 0 0 0 43.5 1.5 3 1"


def waypoints(*rows):
    return "\n".join(("QGC WPL 110", *rows, ""))


def loaded(tmp_path, text):
    path = tmp_path / "plan.waypoints"
    path.write_bytes(text.encode())
    return load(path)


def test_a_file_of_16_mib_is_read_and_a_longer_one_is_too_long(tmp_path):
    text = waypoints(HOME.format(43.5, 1.5, 100), "#")
    longest = text + "#" * (MAX_SIZE - len(text))
    assert loaded(tmp_path, longest).planned_home == Geodetic(43.5, 1.5, 100.0)
    with pytest.raises(FileError, match="too long for a plan"):
        loaded(tmp_path, longest + "#")


@pytest.mark.parametrize(("lat", "lon"), [(90, 180), (-90, -180)])
def test_a_home_at_the_edge_of_the_globe_is_read_and_none_beyond_it(tmp_path, lat, lon):
    assert loaded(tmp_path, waypoints(HOME.format(lat, lon, 1))).planned_home == Geodetic(lat, lon, 1.0)
    for row in (HOME.format(lat * 1.001, lon, 1), HOME.format(lat, lon * 1.001, 1), HOME.format(lat, lon, "inf")):
        with pytest.raises(FileError, match="is not on the globe"):
            loaded(tmp_path, waypoints(row))


def test_a_home_of_zeros_is_none_and_one_number_makes_it_a_place(tmp_path):
    assert loaded(tmp_path, waypoints(HOME.format(0, 0, 0))) == Plan(source=tmp_path / "plan.waypoints")
    for place in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        assert loaded(tmp_path, waypoints(HOME.format(*place))).planned_home == Geodetic(*map(float, place))


def test_a_command_number_has_16_bits(tmp_path):
    home = HOME.format(43.5, 1.5, 100)
    assert [item.command for item in loaded(tmp_path, waypoints(home, ITEM.format(65535))).items] == [65535]
    for number in ("65536", "-1", "16.5"):
        with pytest.raises(FileError, match=r":3: command is .*, not a whole number from 0 to 65535"):
            loaded(tmp_path, waypoints(home, ITEM.format(number)))


@pytest.mark.parametrize(("lat", "lon"), [(90.0, 180.0), (-90.0, -180.0)])
def test_fences_and_rally_points_reach_the_edge_of_the_globe_and_not_beyond_it(lat, lon):
    def plan(lat, lon):
        circle = {"circle": {"center": [lat, lon], "radius": 20.0}}
        return Plan(geo_fence={"circles": [circle]}, rally_points={"points": [[lat, lon, 30.0]]})

    for items in (fence_items(plan(lat, lon)), rally_items(plan(lat, lon))):
        assert [(item.x, item.y) for item in items] == [(lat * 1e7, lon * 1e7)]
    for beyond in (plan(1.0001 * lat, lon), plan(lat, 1.0001 * lon)):
        for items in (fence_items, rally_items):
            with pytest.raises(FileError, match="is not on the globe"):
                items(beyond)


@pytest.mark.parametrize(("radius", "fits"), [(3.4e38, True), (3.5e38, False), (1e-3, True), (0.0, False)])
def test_a_radius_is_positive_and_fits_a_float_of_32_bits(radius, fits):
    plan = Plan(geo_fence={"circles": [{"circle": {"center": [1.0, 2.0], "radius": radius}}]})
    if fits:
        assert [item.params[0] for item in fence_items(plan)] == [radius]
    else:
        with pytest.raises(FileError, match="is not a radius"):
            fence_items(plan)


def test_fences_and_rally_points_are_written_as_qgroundcontrol_numbers_its_formats():
    written = with_rally(with_fence(Plan(), SHAPES), POINTS)
    assert (written.geo_fence["version"], written.rally_points["version"]) == (2, 2)
    shapes = [*written.geo_fence["circles"], *written.geo_fence["polygons"]]
    assert [shape["version"] for shape in shapes] == [1] * 4


def table(**values):
    return JsonTable(json.loads(json.dumps(values)), "a.plan")


@pytest.mark.parametrize("number", [0, 1, 65535])
def test_whole_numbers_have_16_bits(number):
    assert table(x=number).whole("x") == table().whole("x", number) == number


@pytest.mark.parametrize("value", [-1, 65536, 1.0, True, "1", None])
def test_other_values_are_no_whole_numbers(value):
    with pytest.raises(FileError, match=r"^a.plan: x: .* is not a whole number from 0 to 65535$"):
        table(x=value).whole("x")


def test_a_number_may_be_as_large_as_a_double_and_must_be_finite():
    assert table(x=1e300).number("x", 0.0) == 1e300
    assert table().number("x", 2.5) == 2.5
    for text in ('{"x": 1.1e300}', '{"x": -1.1e300}', '{"x": true}', '{"x": null}', '{"x": NaN}', '{"x": "1"}'):
        with pytest.raises(FileError, match="is not a number"):
            JsonTable(json.loads(text), "a.plan").number("x", 0.0)


def test_a_long_value_is_shortened_in_messages():
    for length, shown in ((38, '"' + "a" * 38 + '"'), (39, '"' + "a" * 36 + "...")):
        with pytest.raises(FileError) as error:
            table(x="a" * length).whole("x")
        assert str(error.value) == f"a.plan: x: {shown} is not a whole number from 0 to 65535"


def test_a_home_of_a_plan_file_is_on_the_edge_of_the_globe_or_within_it(tmp_path):
    path = tmp_path / "a.plan"
    for lat, lon in ((90.0, 180.0), (-90.0, -180.0)):
        save(Plan(planned_home=Geodetic(lat, lon, 1.0)), path)
        assert load(path).planned_home == Geodetic(lat, lon, 1.0)
        for beyond in (Geodetic(1.001 * lat, lon, 1.0), Geodetic(lat, 1.001 * lon, 1.0)):
            text = path.read_text().replace(f"{lat},", f"{beyond.lat_deg},").replace(f"{lon},", f"{beyond.lon_deg},")
            (tmp_path / "b.plan").write_text(text)
            with pytest.raises(FileError):
                load(tmp_path / "b.plan")


def test_a_number_that_json_does_not_have_is_not_written(tmp_path):
    with pytest.raises(FileError, match="cannot be written as JSON"):
        save(Plan(file_keys={"x": float("nan")}), tmp_path / "a.plan")
