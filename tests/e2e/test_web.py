"""The ground station in a browser: one flight, from a headless Chromium."""

import os
import re
import shutil
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from darko_gcs.__main__ import main
from protocol.dialect import mavlink
from protocol.tlog import read_tlog
from tests.e2e.support import brisk
from tests.support.browser import SHOWN, WITH_WEBGL

pytest.importorskip("textual_serve")
playwright = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium")
DEADLINE = 90.0  # for a step of the flight on a machine that has much else to do [s]
COMPILED = 600.0  # for the vehicle's first start there [s]
FILLS = """() => {
  const drawn = document.querySelector(".xterm-screen").getBoundingClientRect();
  return drawn.bottom <= innerHeight && drawn.right <= innerWidth && drawn.height > innerHeight - 30;
}"""
ESCAPES = re.compile(rb"\x1b\[[0-9;?]*[A-Za-z]")


@contextmanager
def served(folder, *arguments):
    """``darko-gcs --web``; yields the address of its page."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    own = {"XDG_STATE_HOME": str(folder), "XDG_DATA_HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
    process = subprocess.Popen(
        [sys.executable, "-m", "darko_gcs", "--web", str(port), *arguments],
        env=os.environ | own, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert str(port) in process.stdout.readline()
        yield f"http://127.0.0.1:{port}/"
    finally:
        process.terminate()
        process.wait(timeout=DEADLINE)
        process.stdout.close()


class Page:
    """A page in Chromium, with what the ground station has drawn in it."""

    def __init__(self, browser, url):
        self.drawn, self.strangers = b"", []
        self.page = browser.new_page(viewport={"width": 1280, "height": 800})
        self.page.on("websocket", lambda socket: socket.on("framereceived", self._take))
        self.page.on("request", lambda request: request.url.startswith(url) or self.strangers.append(request.url))
        self.page.goto(url)

    def _take(self, frame):
        self.drawn += frame if isinstance(frame, bytes) else b""

    def until(self, words, deadline=DEADLINE):
        """Wait until it has drawn these words since the last call."""
        end = time.monotonic() + deadline
        while words not in (text := ESCAPES.sub(b"", self.drawn).decode(errors="replace")):
            assert time.monotonic() < end, f"{words} not in {text[-3000:]}"
            self.page.wait_for_timeout(100)
        self.drawn = b""

    def press(self, *keys):
        for key in keys:
            self.page.keyboard.press(key)


@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
def test_a_browser_flies_the_vehicle_from_the_ground_and_back(tmp_path):
    with (
        served(tmp_path, "--sitl", "--speed", "6", *brisk(tmp_path / "sitl"), "--record", str(tmp_path)) as url,
        playwright.sync_playwright() as driver,
        driver.chromium.launch(executable_path=CHROMIUM, args=WITH_WEBGL) as browser,
    ):
        page = Page(browser, url)
        page.until("Navigation: aligned", deadline=COMPILED)
        page.press("a")
        page.until("propellers")
        page.press("y")
        page.until("ARMED")
        page.press("t")
        page.until("Height above home")
        page.press("Enter")
        page.until("Take-off complete")
        with page.page.expect_popup() as opened:
            page.page.click(".live")
        opened.value.wait_for_function("window.shownFlight?.time > 0", timeout=1000 * DEADLINE)
        drawn = opened.value.evaluate(SHOWN)
        assert drawn["place"][2] > 1.0
        assert drawn["nose"][2] > 0.9
        assert min(drawn["arrows"]) > 0.0
        opened.value.close()
        page.page.reload()  # the station and the vehicle fly on
        page.until("in air")
        page.page.close()
        page = Page(browser, url)
        page.until("Take-off complete")  # in the messages that came before
        page.press("l")
        page.until("Land here?")
        page.press("y")
        page.until("Landed")
        assert page.strangers == []
        page.page.close()
    (log,) = tmp_path.glob("*.tlog")  # one station for all three pages
    states = list(read_tlog(log).columns("EXTENDED_SYS_STATE")["landed_state"])
    assert states[0] == mavlink.MAV_LANDED_STATE_ON_GROUND
    assert mavlink.MAV_LANDED_STATE_IN_AIR in states
    # It comes twice a second: the page may be closed before it tells of the ground.
    assert states[-1] in {mavlink.MAV_LANDED_STATE_LANDING, mavlink.MAV_LANDED_STATE_ON_GROUND}


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    with served(tmp_path_factory.mktemp("web"), "--port", "0") as url:
        yield url


def status(url, **headers):
    try:
        with urlopen(Request(url, headers=headers), timeout=DEADLINE) as answer:  # noqa: S310 - our own page
            return answer.status
    except HTTPError as error:
        return error.code


def test_the_page_is_for_this_machine_alone(url):
    own = url.rstrip("/")
    assert status(url) == status(url, Origin=own) == 200
    for stranger in ("http://example.org", "http://127.0.0.1:1", "null", f"{own}.example.org"):
        assert status(url, Origin=stranger) == 403, stranger
    assert status(url, Host="example.org") == 403  # a name of its own that leads here


@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
def test_a_second_page_does_not_take_the_vehicle_from_the_first(url):
    with (
        playwright.sync_playwright() as driver,
        driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"]) as browser,
    ):
        first = Page(browser, url)
        first.until("Listening on")
        second = Page(browser, url)
        second.page.wait_for_selector("body.-closed", timeout=1000 * DEADLINE)
        assert b"Listening on" not in second.drawn
        assert "Another page has the ground station open" in second.page.inner_text("body")
        assert not second.page.is_visible(".ended")
        first.page.bring_to_front()
        first.press("?")
        first.until("Keys")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--web", "0"), "a page needs a port"),
        (("--web", "99999"), "is not a port"),
        (("--web", "taken"), "whole number"),
    ],
)
def test_a_wrong_port_is_refused_in_a_line(arguments, words, capsys):
    try:
        code = main(arguments)
    except SystemExit as refused:
        code = refused.code
    assert code == 2
    assert words in capsys.readouterr().err


@pytest.mark.long
def test_a_port_that_is_taken_is_named(capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["--web", port]) == 2
    assert f"--web {port}: " in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
def test_a_page_that_is_made_smaller_keeps_the_last_line(url):
    with (
        playwright.sync_playwright() as driver,
        driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"]) as browser,
    ):
        page = Page(browser, url)
        page.until("Listening on")
        for width, height in ((700, 420), (1280, 800), (500, 300)):
            page.page.set_viewport_size({"width": width, "height": height})
            page.page.wait_for_function(FILLS, timeout=1000 * DEADLINE)
            page.page.wait_for_timeout(300)
            assert page.page.evaluate(FILLS)  # it stays so
