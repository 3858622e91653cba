"""The palette finds what has no key: overlays, the page in 3-D, the recording, the report."""

import json

import pytest

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.map_panel import MapPanel
from darko_gcs.tui.screens.dialogs import FileDialog
from tests.support.gcs.screens import FakeFeed, until
from tests.support.gcs.snapshots import HOVERING

SQUARE = {"type": "Polygon", "coordinates": [[[1.48, 43.56], [1.49, 43.56], [1.49, 43.57], [1.48, 43.56]]]}


async def test_each_word_finds_its_entry_first_and_a_file_of_shapes_is_laid_over_the_maps(tmp_path):
    file = tmp_path / "field.geojson"
    file.write_text(json.dumps({"type": "Feature", "properties": {}, "geometry": SQUARE}))
    app = GroundStationApp(FakeFeed(HOVERING))
    app.live_page, app.recording = "http://127.0.0.1:8001/", "/flights/1.tlog"
    async with app.run_test(size=(120, 40)) as pilot:
        entries = app.palette_entries(app.screen)
        first = {}
        for word in ("overlay", "geojson", "report", "wind", "record", "3d"):
            best = max(entries, key=lambda entry, word=word: entry.score(word))
            first[word] = f"{best.title}: {best.help}"
        assert first["overlay"] == first["geojson"] == "Lay a file of shapes over the maps: GeoJSON or KML"
        assert "log report /flights/1.tlog" in first["report"]
        assert "arameter" in first["wind"]
        assert "/flights/1.tlog" in first["record"]
        assert "http://127.0.0.1:8001/" in first["3d"]
        app.open_overlay()
        await until(pilot, lambda: isinstance(app.screen, FileDialog) and app.screen.query("#path"))
        app.screen.field.value = str(file)
        await pilot.press("enter")
        await until(pilot, lambda: app.overlay and not app.screen.is_modal)
        assert app.screen.query_one(MapPanel).overlay.overlay == app.overlay


@pytest.mark.parametrize("url", ["foo", "127.0.0.1:14550", "udp"])
def test_an_address_that_is_none_to_connect_to_is_refused_by_name(url, capsys):
    from darko_gcs.commands.connect import parser

    with pytest.raises(SystemExit):
        parser({}).parse_args(["--connect", url])
    assert "no address to connect to: udpout:HOST:PORT" in capsys.readouterr().err
