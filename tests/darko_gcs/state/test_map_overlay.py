"""Shapes over the maps: GeoJSON and KML, read whole or refused with one line."""

import json

import pytest

from darko_gcs.state.map_overlay import MAX_OVERLAY_POINTS, load_overlay
from protocol.errors import FileError
from protocol.frames import Geodetic

RING = [[1.48, 43.56], [1.49, 43.56], [1.49, 43.57], [1.48, 43.56]]
KML = """<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document><!-- of a field -->
<Placemark><name>Field</name><Polygon>{extrude}<outerBoundaryIs><LinearRing><coordinates>
1.48,43.56,{top} 1.49,43.56,{top} 1.49,43.57,{top} 1.48,43.56,{top}</coordinates></LinearRing></outerBoundaryIs>
</Polygon></Placemark>
<Placemark><name>Pilot</name><Point><coordinates>1.481,43.561</coordinates></Point></Placemark>
<Placemark><LineString><coordinates>1.48,43.56 1.49,43.57</coordinates></LineString></Placemark></Document></kml>"""


@pytest.fixture
def written(tmp_path):
    def write(content):
        path = tmp_path / "field.json"
        path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
        return path

    return write


def feature(kind, coordinates, **properties):
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}


def test_geojson_gives_places_lines_and_areas_with_names_and_heights(written):
    hole = [[x, y] for x, y in RING]
    features = [
        feature("Point", [1.48, 43.56, 140.0], name="Pilot"), feature("LineString", RING[:2]),
        feature("Polygon", [RING, hole], name="Hangar", height=9), feature("MultiPolygon", [[RING], [RING]]),
        {"type": "Feature", "properties": None, "geometry": None},
    ]  # fmt: skip
    point, line, area, inner, *rest = load_overlay(written({"type": "FeatureCollection", "features": features}))
    assert (point.name, point.points) == ("Pilot", (Geodetic(43.56, 1.48, 0.0),))
    assert (len(line.points), line.is_area) == (2, False)
    assert (area.name, area.is_area, area.top, inner.top) == ("Hangar", True, 9.0, None)
    assert len(rest) == 2


def test_a_bare_geometry_is_geojson_too(written):
    (line,) = load_overlay(
        written({"type": "GeometryCollection", "geometries": [feature("LineString", RING)["geometry"]]})
    )
    assert len(line.points) == 4


def test_kml_gives_the_same_and_a_polygon_that_stands_on_the_ground_has_a_height(written):
    area, pilot, line = load_overlay(written(KML.format(extrude="", top=0)))
    assert (area.name, area.is_area, area.top, len(area.points)) == ("Field", True, None, 4)
    assert (pilot.name, pilot.points, len(line.points)) == ("Pilot", (Geodetic(43.561, 1.481, 0.0),), 2)
    shapes = load_overlay(written(KML.format(extrude="<extrude>1</extrude>", top=12)))
    assert [shape.top for shape in shapes if shape.top is not None] == [12.0]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "neither GeoJSON nor KML"),
        ("[1]", "is not an object"),
        ("[" * 100_000, "neither GeoJSON nor KML"),
        ({"type": "FeatureCollection", "features": []}, "holds no point, line or polygon"),
        ({"type": "FeatureCollection", "features": [feature("Point", [43.56, 143.0])]}, "begins with the longitude"),
        ({"type": "FeatureCollection", "features": [feature("Blob", [])]}, "features[0].geometry.type: 'Blob' is no"),
        (feature("LineString", [[1.0, "x"]]), 'geometry.coordinates[1]: "x" is not a number'),
        (feature("Polygon", [3]), "geometry.coordinates: is not a list of rings"),
        (feature("LineString", [[0.0, 0.0]] * (MAX_OVERLAY_POINTS + 1)), f"more than {MAX_OVERLAY_POINTS} points"),
        ("<kml><Placemark>", "not KML"),
        ("<gpx/>", "<gpx> where <kml> was expected"),
        ('<!DOCTYPE k [<!ENTITY a "b">]><kml>&a;</kml>', "not read: EntitiesForbidden"),
        (KML.format(extrude="", top="x"), "Field: '1.48,43.56,x' is not longitude,latitude"),
        ("<kml><Placemark><Point/></Placemark></kml>", "<Point> without coordinates"),
    ],
)
def test_a_bad_file_is_refused_with_a_line_that_names_it_and_the_place(written, content, words):
    path = written(content)
    with pytest.raises(FileError) as caught:
        load_overlay(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_one_that_is_no_text_are_refused(tmp_path):
    with pytest.raises(FileError, match="cannot be read"):
        load_overlay(tmp_path / "none.kml")
    (tmp_path / "a.kmz").write_bytes(b"PK\x03\x04\0\0")
    with pytest.raises(FileError, match="zero bytes"):
        load_overlay(tmp_path / "a.kmz")
