"""The vehicle's own log, fetched from the real process."""

import json

import pytest

from darko_gcs.__main__ import main
from protocol.tlog import read_tlog
from tests.e2e.support import free_ports, vehicle


@pytest.mark.long
def test_a_flight_is_fetched_from_the_vehicle_and_reads_as_a_log(tmp_path, capsys):
    def fetch(*arguments):
        assert main(["log", "fetch", "--json", "--port", str(port), *arguments]) == 0
        return json.loads(capsys.readouterr().out)["logs"]

    (port,) = free_ports(1)
    with vehicle(port, tmp_path / "state", "--start", "0,0,5,0", "--speed", "2", "--nav", "truth"):
        (listed,) = fetch("--list")
        assert listed["file"] is None
        (log,) = fetch("--to", str(tmp_path))
    reader = read_tlog(log["file"])
    assert not reader.damage
    assert reader.size == log["bytes"] >= listed["bytes"]
    assert len(reader.rows("DARKO_HYBRID_STATE")) > 0
