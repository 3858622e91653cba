"""The pictures of the lockstep on the pages are those that the script draws, and are sound SVG."""

import sys
from pathlib import Path

import pytest
from defusedxml.ElementTree import fromstring

from scripts.build_lockstep import PICTURES, drawn, main

DOCS = Path(__file__).parent.parent.parent / "docs"


def test_the_pictures_on_the_pages_are_as_they_would_be_drawn(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["build_lockstep", "--check"])
    assert main() == 0


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_svg_that_its_page_shows(name):
    picture = fromstring(drawn(PICTURES[name]))
    words = [text.text for text in picture.iter("{http://www.w3.org/2000/svg}text")]
    assert PICTURES[name].plant in words
    assert f"(physics-{name}.svg)" in (DOCS / f"physics-{name}.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ardupilot", ["UDP 9002", "18458 (16 outputs)", "29569 (32 outputs)"]),
        ("px4", ["TCP 4560", "HIL_SENSOR", "ODOMETRY"]),
        ("betaflight", ["UDP 9001", "UDP 9003", "18 doubles"]),
        ("paparazzi", ["sitl.physics.nps"]),
    ],
)
def test_a_picture_tells_its_packets_and_ports(name, words):
    text = drawn(PICTURES[name])
    assert all(word in text for word in words)
