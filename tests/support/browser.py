"""Pages in a headless Chromium, and what the 3-D view in them shows."""

import shutil
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium")
WAIT = 120_000  # for a page on a machine that has much else to do, and no graphics processor [ms]
WITH_WEBGL = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SMALL: Any = {"width": 480, "height": 560}  # a phone's width: a processor draws it quickly

SHOWN = """() => {
  const vehicle = shownFlight.scene.vehicle, turn = vehicle.getWorldQuaternion(new THREE.Quaternion());
  const axis = (...along) => new THREE.Vector3(...along).applyQuaternion(turn).toArray();
  const edges = vehicle.elevons.map((flap) => {
    flap.updateMatrix();
    return new THREE.Vector3(TRAILING_EDGE - HINGE, 0, 0).applyMatrix4(flap.matrix).z;
  });
  return {
    time: Number(shownFlight.root.dataset.time), nose: axis(1, 0, 0), right: axis(0, 1, 0),
    place: vehicle.getWorldPosition(new THREE.Vector3()).toArray(), edges,
    arrows: vehicle.thrusts.map((arrow) => arrow.visible ? arrow.shaft.scale.x : 0),
    picture: shownFlight.scene.renderer.domElement.toDataURL(), words: shownFlight.root.innerText,
  };
}"""
"""What is shown: axes and place of the vehicle east, north, up; trailing edges down of the wing, left and right [m]."""


def needs_browser(test):
    """Marks a test that is skipped where there is no Chromium or nothing that drives it."""
    is_missing = CHROMIUM is None or find_spec("playwright") is None
    return pytest.mark.long(pytest.mark.skipif(is_missing, reason="no chromium")(test))


@contextmanager
def shown_page(url, **options):
    """A page once its 3-D view is there; requests for anything but it are in ``strangers``, errors in ``errors``."""
    from playwright.sync_api import sync_playwright

    with (
        sync_playwright() as driver,
        driver.chromium.launch(executable_path=CHROMIUM, args=WITH_WEBGL, timeout=WAIT) as browser,
    ):
        page: Any = browser.new_page(viewport=SMALL, **options)
        page.set_default_timeout(WAIT)
        page.strangers, page.errors = [], []
        page.on("request", lambda request: request.url.startswith(url) or page.strangers.append(request.url))
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        page.goto(url)
        page.wait_for_function("window.shownFlight")
        yield page
