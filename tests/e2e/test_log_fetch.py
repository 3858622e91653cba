"""The vehicle's own log, fetched from the real process by the real command."""

import json
import subprocess

from protocol.tlog import read_tlog
from tests.e2e.support import BIN, free_ports, vehicle


def fetch(port, *arguments):
    command = [str(BIN / "darko-gcs"), "log", "fetch", "--json", "--port", str(port), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["logs"]


def test_a_flight_is_fetched_from_the_vehicle_and_reads_as_a_log(tmp_path):
    (port,) = free_ports(1)
    with vehicle(port, tmp_path / "state", "--start", "0,0,5,0", "--speed", "5", "--nav", "truth"):
        (listed,) = fetch(port, "--list")
        assert listed["file"] is None
        (log,) = fetch(port, "--to", str(tmp_path))
    reader = read_tlog(log["file"])
    assert not reader.damage
    assert reader.size == log["bytes"] >= listed["bytes"]
    assert len(reader.rows("DARKO_HYBRID_STATE")) > 0
