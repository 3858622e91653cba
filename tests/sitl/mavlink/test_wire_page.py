"""docs/wire.md agrees with the code's tables, and each of its messages and commands is named by a test."""

import re

from protocol.dialect import mavlink
from scripts import build_wire_page
from tests.support.paths import DATA

ROOT = DATA.parents[1]
PAGE = (ROOT / "docs" / "wire.md").read_text(encoding="utf-8")
# The tests reach these by other names: by number, by their family, or as what a client makes of them.
UNNAMED = {"DARKO_PLAN_BLOCK", "DARKO_PLAN_SECTOR", "LOG_DATA", "SET_GPS_GLOBAL_ORIGIN"}


def words(text):
    """All words of Python code."""
    return set(re.findall(r"[A-Za-z_]\w*", text))


def mentions(name, found):
    """Whether a test's words have a message or a command, under any of its names in Python code."""
    return not found.isdisjoint({name, f"MAVLINK_MSG_ID_{name}", f"MAV_CMD_{name}", f"MAVLink_{name.lower()}_message"})


def test_the_page_is_up_to_date():
    assert build_wire_page.page() == PAGE, "run scripts/build_wire_page.py"


def test_every_message_and_command_is_named_by_a_test():
    paths = [path for path in (ROOT / "tests").rglob("test_*.py") if path.name != "test_wire_page.py"]
    found = set().union(*(words(path.read_text(encoding="utf-8")) for path in paths))
    messages = {known.msgname for known in mavlink.mavlink_map.values()}
    commands = {entry.name.removeprefix("MAV_CMD_") for entry in mavlink.enums["MAV_CMD"].values()}
    named = words(PAGE.split("\n## Parameters")[0]) & (messages | commands)
    assert len(named) > 150
    assert {name for name in named if not mentions(name, found)} == UNNAMED


def test_names_are_found_as_words():
    assert mentions("ATTITUDE", words('last("ATTITUDE")'))
    assert mentions("ATTITUDE", words("MAVLink_attitude_message("))
    assert mentions("NAV_LAND", words("mavlink.MAV_CMD_NAV_LAND"))
    assert not mentions("ATTITUDE", words("ATTITUDE_QUATERNION SET_ATTITUDE MAVLink_attitude_target_message"))
