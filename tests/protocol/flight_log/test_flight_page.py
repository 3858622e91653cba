"""The page about a flight: one self-contained file with its facts, its charts and its events."""

import base64
import gzip
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from protocol.flight_log.flight_page import MissingPlotlyError, flight_page
from protocol.flight_log.flight_series import NOTHING, FlightEvent, FlightSeries, Prism, Series
from protocol.flight_log.flight_summary import LoggedFlight, LoggedJump
from protocol.flight_log.flown_legs import LoggedLeg

offline = pytest.importorskip("plotly.offline")

PACKED = re.compile(r'<script type="application/gzip" id="(.*?)">(.*?)</script>')
SUMMARY = LoggedFlight(
    system=1,
    component=1,
    type="VTOL_DUOROTOR",
    autopilot="PX4",
    modes=(),
    armed=(),
    distance=None,
    height=None,
    speed=None,
    cross_track_rms=None,
    cross_track_max=None,
    laws={},
    energy={},
    vtol=(),
    decisions=(),
    jumps=(),
)
SERIES = ("position", "truth", "target", "hybrid", "actuators", "servos", "energy", "battery", "air", "attitude")
FLIGHT = FlightSeries(name="f", summary=SUMMARY, duration=12.34, **dict.fromkeys(SERIES, NOTHING))
POSITION = Series(np.arange(2.0), {axis: np.zeros(2) for axis in ("x", "y", "z")})
AIR = Series(np.arange(2.0), {name: np.zeros((2, 3)) for name in ("wind_estimate", "wind_true")})
JUMP = LoggedJump(time=1.0, number=1, law_from="LANDED", law_to="HOVER_LINEAR", reason="x", v=1.0, name="y")


def page(flight=FLIGHT, title="A flight", **others):
    """The page without what is packed in it."""
    return PACKED.sub("", flight_page(flight, title=title, **others))


def unpacked(made, name):
    """A text that its script takes out of a page by a name."""
    (found,) = [packed for other, packed in PACKED.findall(made) if other == name]
    return gzip.decompress(base64.b64decode(found)).decode()


def rows(page):
    return re.findall(r"<tr><th>(.*?)</th><td>(.*?)</td></tr>", page)


@pytest.mark.long
def test_a_page_is_one_document_with_plotly_in_it_once():
    whole = flight_page(replace(FLIGHT, position=POSITION, target=POSITION, air=AIR), title="A flight")
    made = PACKED.sub("", whole)
    for tag in ("<html", "<head", "<body", "</html>", '<div id="view">'):
        assert made.count(tag) == 1
    assert unpacked(whole, "plotly") == offline.get_plotlyjs()
    assert made.count('<div class="chart">') == len(json.loads(unpacked(whole, "charts"))) == 2
    scripts = unpacked(whole, "view-scripts")
    assert "The MIT License" in scripts
    assert "three.js authors" in scripts
    assert not re.search(r"(src|href)=.?https?:", made)


def test_a_page_without_places_or_charts_has_no_scripts_for_them():
    whole = flight_page(FLIGHT, title="A flight")
    assert [unpacked(whole, name) for name in ("plotly", "view-scripts", "motion", "charts")] == ["", "", "null", "[]"]
    assert len(whole) < 20_000


def test_a_page_has_a_chart_for_what_was_recorded():
    made = page(replace(FLIGHT, position=POSITION, air=AIR))
    assert re.findall("<h2>(.*?)</h2>", made) == ["Path", "Wind", "Events"]
    assert re.findall("<h2>(.*?)</h2>", page()) == ["Events"]


def test_a_page_draws_what_stands_around_the_path():
    house = Prism("house", ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0)), 0.0, 2.0)
    made = flight_page(replace(FLIGHT, position=POSITION), title="A flight", scenery=[house])
    (solid,) = json.loads(unpacked(made, "motion"))["scenery"]
    assert solid == {"name": "house", "corners": [[0, 0], [4, 0], [4, 3]], "bottom": 0, "top": 2, "hollow": False}


def test_a_page_begins_with_its_preamble_and_then_the_facts_that_are_known():
    assert rows(page(preamble=[("Seed", "7")])) == [
        ("Seed", "7"),
        ("Flight time on the vehicle&#x27;s clock", "12.3 s"),
    ]
    summary = replace(
        SUMMARY,
        distance=5.04,
        height=9.06,
        jumps=(JUMP, JUMP),
        laws={"HOVER_LINEAR": 3.04, "LANDED": 2.0},
        energy={"HOVER_LINEAR": 50.4},
    )
    assert rows(page(replace(FLIGHT, summary=summary)))[1:] == [
        ("Distance flown while armed", "5.0 m"),
        ("Greatest height", "9.1 m"),
        ("Jumps", "2"),
        ("Under hover linear", "3.0 s, 50 J"),
        ("Under landed", "2.0 s"),
    ]


def test_a_page_lists_the_events_with_their_times():
    events = (FlightEvent(1.234, "jump", "a to b", "b"), FlightEvent(2.0, "text", "ready"))
    made = page(replace(FLIGHT, events=events))
    assert re.findall('<tr class="(.*?)"><td class="n">(.*?)</td><td>(.*?)</td>', made) == [
        ("jump", "1.23 s", "a to b"),
        ("text", "2.00 s", "ready"),
    ]


def test_a_page_tells_the_date_and_is_dark_where_the_reader_wants_it():
    made = page(replace(FLIGHT, start_usec=1_700_000_000_000_000))
    assert "<th>Recorded</th><td>2023-11-14 22:13:20 UTC</td>" in made
    assert "Recorded" not in page(FLIGHT)
    assert "prefers-color-scheme: dark" in made
    assert ".alarm { color: var(--alarm)" in made


def test_texts_of_a_vehicle_are_no_markup():
    event = FlightEvent(1.0, "text", "<script>alert(1)</script>")
    made = page(replace(FLIGHT, events=(event,)), title="<b>", preamble=[("<i>", "<u>")])
    assert not re.search("<script>alert|<b>|<i>|<u>", made)
    assert made.count("&lt;b&gt;") == 2  # heading and title


def test_without_plotly_there_is_no_page(monkeypatch):
    monkeypatch.setattr("protocol.flight_log.flight_page.find_spec", lambda _name: None)
    with pytest.raises(MissingPlotlyError, match="pip install"):
        flight_page(FLIGHT, title="A flight")


def test_legs_stand_among_the_facts_beside_their_bounds():
    leg = LoggedLeg(
        time=1.0,
        seq=2,
        distance=30.0,
        climb=0.0,
        flown_time=5.0,
        flown_energy=600.0,
        bound_time=4.0,
        bound_energy=500.0,
    )
    told = rows(page(replace(FLIGHT, summary=replace(SUMMARY, legs=(leg,)))))
    assert told[-1] == ("Leg to 2, 30 m", "5.0 s of 4.0: 1.25, 600 J of 500: 1.20")
    assert told[-2][0].startswith("Legs as flown, of the least of darko")
