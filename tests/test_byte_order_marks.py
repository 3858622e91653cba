"""Files that a person writes are read alike whichever editor saved them: with a byte order mark, with CR LF."""

from pathlib import Path

import pytest

import sitl
from darko_gcs.preferences import PreferencesFile
from protocol.flight_plans import load_flight_plan
from protocol.flight_plans.plan_loader import SHIPPED_PLANS
from protocol.flight_plans.plan_names import load_name_mapping
from protocol.plans import load, save
from protocol.plans.parameter_files import load_parameters
from protocol.wire.signing import load_key
from sitl.day import load_day
from sitl.enclosure.arena_files import load_arena
from sitl.model import airframe_files
from sitl.motion_capture.rigid_body import load_rigid_body
from sitl.sensors.sensor_files import load_sensors
from tests.support.paths import DATA

SHIPPED = Path(sitl.__file__).parent
READERS = {
    "x.toml": (lambda path: load_arena(str(path)), (SHIPPED / "enclosure/arenas/voliere.toml").read_text("utf-8")),
    "airframe.toml": (
        lambda path: airframe_files.load(str(path)).values,
        '[set]\nname = "x"\ndescription = "y"\nbase = "published"\n[m]\nvalue = 0.5\nunit = "kg"\nsource = "z"\n',
    ),
    "sensors.toml": (lambda path: load_sensors(str(path)), (SHIPPED / "sensors/data/gnss.toml").read_text("utf-8")),
    "body.toml": (
        lambda path: load_rigid_body(str(path)),
        (SHIPPED / "motion_capture/rigid_bodies/darko_markers.toml").read_text("utf-8"),
    ),
    "day.toml": (load_day, 'name = "d"\nduration = 10.0\narena = "voliere"\n'),
    "names.toml": (load_name_mapping, '[functions]\n"f" = 1\n'),
    "gcs.toml": (lambda path: PreferencesFile(path).load(), "favourite_parameters = ['A']\n"),
    "plan.xml": (load_flight_plan, (SHIPPED_PLANS / "voliere.xml").read_text("utf-8")),
    "x.plan": (load, (DATA / "square.plan").read_text("utf-8")),
    "x.params": (lambda path: load_parameters(path).of((1, 1)), "1\t1\tA\t2\t9\n"),
    "x.parm": (lambda path: load_parameters(path).of((1, 1)), "A 2\n"),
    "x.key": (lambda path: load_key(str(path)), "0123456789abcdef" * 4),
}


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize("name", READERS)
def test_a_file_with_a_byte_order_mark_and_lines_of_windows_is_read_as_without(tmp_path, name, encoding):
    read, text = READERS[name]
    path, found = tmp_path / name, []
    for content in (text.encode(), text.replace("\n", "\r\n").encode(encoding)):
        path.write_bytes(content)
        load_arena.cache_clear()
        found.append(repr(read(path)))
    assert found[0] == found[1]


def test_a_waypoint_file_with_a_byte_order_mark_is_read(tmp_path):
    path = tmp_path / "x.waypoints"
    save(load(DATA / "square.waypoints"), path)
    items = load(path).items
    path.write_text(path.read_text(), encoding="utf-8-sig")
    assert load(path).items == items
