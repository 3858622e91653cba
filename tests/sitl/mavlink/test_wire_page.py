"""docs/wire.md agrees with the code's tables, and each test it cites names the row."""

import re

import pytest

from scripts import build_wire_page
from tests.support.paths import DATA

ROOT = DATA.parents[1]


@pytest.fixture(scope="module")
def kept():
    return (ROOT / "docs" / "wire.md").read_text(encoding="utf-8")


def without_tests(page):
    return re.sub(r"\| (`tests/[^|]*`|none) \|$", "|", page, flags=re.MULTILINE)


def test_the_page_is_up_to_date(kept, monkeypatch):
    monkeypatch.setattr(build_wire_page, "_test", lambda _name: build_wire_page.UNTESTED)  # compared without them
    assert without_tests(build_wire_page.page()) == without_tests(kept), "run scripts/build_wire_page.py"


def test_every_test_it_cites_names_the_thing(kept):
    cited = re.findall(r"^\| (\w+) \|.*\| `(tests/[^|]*)` \|$", kept, flags=re.MULTILINE)
    assert len(cited) > 80
    for name, path in cited:
        assert build_wire_page.mentions(name, (ROOT / path).read_text(encoding="utf-8")), (name, path)


def test_names_are_found_as_words():
    assert build_wire_page.mentions("ATTITUDE", 'last("ATTITUDE") MAVLink_attitude_message(') == 2
    assert build_wire_page.mentions("NAV_LAND", "mavlink.MAV_CMD_NAV_LAND") == 1
    assert build_wire_page.mentions("ATTITUDE", "ATTITUDE_QUATERNION SET_ATTITUDE MAVLink_attitude_target_message") == 0
