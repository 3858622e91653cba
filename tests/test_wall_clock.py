"""Timers run on monotonic clocks; the wall clock gives only names and time stamps."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
WALL_CLOCK = re.compile(r"\btime\.time\b|\btime_ns\b|\bdatetime\.now\b")
FOR_NAMES_AND_STAMPS = {
    "darko_gcs/feed/links.py",
    "darko_gcs/station/keyring_setup.py",
    "darko_gcs/station/recording.py",
    "darko_gcs/tui/app.py",
    "darko_gcs/tui/view_controls.py",
    "sitl/motion_capture/motive_process.py",
    "darko_gcs/tui/containment.py",
    "sitl/process/vehicle_process.py",
}


def test_no_timer_runs_on_the_wall_clock():
    sources = [path for package in ("protocol", "sitl", "darko_gcs") for path in (ROOT / package).rglob("*.py")]
    users = {str(path.relative_to(ROOT)) for path in sources if WALL_CLOCK.search(path.read_text("utf-8"))}
    assert users - {"protocol/dialect/mavlink.py"} == FOR_NAMES_AND_STAMPS
