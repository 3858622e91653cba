"""Ctrl+C in the terminal of the page's server: twice where a ground station runs."""

import time
from types import SimpleNamespace

import pytest

web = pytest.importorskip("aiohttp.web")
from darko_gcs.web import SECOND_INTERRUPT, PageServer  # noqa: E402 - it needs aiohttp


@pytest.fixture
def server():
    return PageServer("true", 8000, 8001)


def test_without_a_ground_station_the_first_one_ends(server):
    with pytest.raises(web.GracefulExit):
        server.interrupt()


def test_a_ground_station_that_runs_is_ended_by_the_second_one_soon_after(server, monkeypatch, capsys):
    server._station = SimpleNamespace(has_ended=False)
    times = iter((100.0, 100.1 + SECOND_INTERRUPT, 100.2 + SECOND_INTERRUPT))
    monkeypatch.setattr(time, "monotonic", lambda: next(times))
    server.interrupt()
    server.interrupt()
    assert capsys.readouterr().out.count("Ctrl+C again within 5 s ends it") == 2
    with pytest.raises(web.GracefulExit):
        server.interrupt()


def test_one_that_has_ended_needs_no_second_one(server):
    server._station = SimpleNamespace(has_ended=True)
    with pytest.raises(web.GracefulExit):
        server.interrupt()
