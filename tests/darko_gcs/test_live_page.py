"""The page that draws the vehicle live: what it is told, by whom, and what it shows."""

import json
import math
import socket
from contextlib import contextmanager
from types import SimpleNamespace
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from darko_gcs.__main__ import main
from darko_gcs.live_page import LivePage, live_state
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.values import Actuators
from protocol.dialect.vocabulary import Limit
from protocol.flight_log.flight_charts import GREY, law_colour
from tests.support.browser import SHOWN, needs_browser, shown_page
from tests.support.gcs.snapshots import HOVERING, NOSE_UP, snapshot_with

SECONDS = 60.0  # a machine that has much else to do answers within
ACTING = Actuators(
    motor=(600.0, 610.0), motor_command=(600.0, 610.0), thrust=(2.0, 3.0), elevon=(0.3, -0.2),
    elevon_command=(0.3, -0.2), motor_min=100.0, motor_max=1000.0, elevon_max=0.5, limits=Limit(0),
)  # fmt: skip
FLYING = snapshot_with(HOVERING, actuation={"actuators": ACTING})


@contextmanager
def served(snapshot=FLYING):
    feed = SimpleNamespace(snapshot=snapshot)
    with LivePage(feed, 0) as page:
        yield feed, page.url


def told(answer):
    """The next state of a stream."""
    while not (line := answer.readline().decode()).startswith("data: "):
        assert line
    return json.loads(line.removeprefix("data: "))


def status(url, **headers):
    try:
        with urlopen(Request(url, headers=headers), timeout=SECONDS) as answer:  # noqa: S310 - our own page
            return answer.status
    except HTTPError as error:
        return error.code


def test_the_state_is_what_the_snapshot_says_in_the_axes_of_the_wire():
    state = live_state(FLYING)
    assert (state["time"], state["place"], state["target"], state["wind"]) == (60.0, [2, 1, -3], [4, 0, -3], [0, 2, 0])
    assert state["attitude"] == pytest.approx(NOSE_UP, abs=1e-4)
    assert (state["thrust"], state["elevon"]) == ([2.0, 3.0], [0.3, -0.2])  # left, right; positive nose-up
    assert state["law"] == ["hover linear", law_colour("HOVER_LINEAR")]
    assert state["home"] == [0.0, 0.0, 0.0]
    assert state["status"] == "1/1, HOLD, armed"
    assert "LINK LOST" in live_state(snapshot_with(FLYING, link={"lost": True}))["status"]


def test_what_is_not_known_or_no_number_is_none():
    state = live_state(EMPTY_SNAPSHOT)
    assert {state[name] for name in ("time", "place", "attitude", "wind", "target", "home")} == {None}
    assert (state["thrust"], state["waypoints"], state["law"][1]) == ([], [], GREY)
    assert state["status"] == "No vehicle yet"
    broken = snapshot_with(FLYING, position={"p": (math.nan, 0.0, 0.0)}, estimates={"wind": (math.inf, 0.0, 0.0)})
    assert (live_state(broken)["place"], live_state(broken)["wind"]) == (None, None)
    json.dumps(live_state(broken), allow_nan=False)


def test_the_stream_tells_each_change():
    with served() as (feed, url), urlopen(f"{url}flight", timeout=SECONDS) as stream:  # noqa: S310 - our own page
        assert stream.headers["Content-Type"] == "text/event-stream"
        assert told(stream)["place"] == [2, 1, -3]
        feed.snapshot = snapshot_with(FLYING, position={"p": (5.0, 1.0, -3.0)}, link={"boot": 61.0})
        later = told(stream)
        assert (later["time"], later["place"]) == (61.0, [5, 1, -3])


def test_the_page_is_for_this_machine_alone():
    with served() as (_, url):
        assert status(url) == status(url, Origin=url.rstrip("/")) == 200
        assert status(f"{url}other") == 404
        for path in ("", "flight"):
            assert status(f"{url}{path}", Host="example.org") == 403  # a name of its own that leads here
            for stranger in ("http://example.org", "http://127.0.0.1:1", "null"):
                assert status(f"{url}{path}", Origin=stranger) == 403, stranger


def test_a_port_that_is_taken_is_named(capsys, monkeypatch):
    monkeypatch.delenv("TEXTUAL_DRIVER", raising=False)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["--port", "0", "--live-3d", port]) == 2
    assert f"--live-3d {port}: " in capsys.readouterr().err
    assert main(["--port", "0", "--live-3d", "0"]) == 2
    assert "--live-3d 0: a page needs a port" in capsys.readouterr().err


@needs_browser
def test_a_browser_shows_the_vehicle_as_it_flies():
    with served() as (feed, url), shown_page(url) as shown:
        shown.wait_for_function("shownFlight.time === 60")
        first = shown.evaluate(SHOWN)
        assert first["place"] == pytest.approx([1.0, 2.0, 3.0])
        assert first["nose"] == pytest.approx([0.0, 0.0, 1.0], abs=1e-3)
        assert first["edges"][0] < 0.0 < first["edges"][1]
        feed.snapshot = snapshot_with(FLYING, position={"p": (12.0, 1.0, -3.0)}, link={"boot": 61.0})
        shown.wait_for_function("shownFlight.time === 61")
        second = shown.evaluate(SHOWN)
        assert second["place"] == pytest.approx([1.0, 12.0, 3.0])
        assert "1/1, HOLD, armed" in shown.inner_text("#status")
        assert shown.errors == shown.strangers == []
