"""A scenario in the real process, watched by a stock client."""

import subprocess
import sys
from pathlib import Path

import pytest
from pymavlink import mavutil

SITL = str(Path(sys.executable).parent / "darko-sitl")
HOVER, TO_FORWARD, TO_HOVER = 1.0, 4.0, 7.0  # DARKO_LAW


@pytest.fixture
def watched(tmp_path):
    """Messages, output and exit code of a flight at full speed, heard by a client with the common dialect."""
    ground = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="common")
    port = str(ground.port.getsockname()[1])
    vehicle = subprocess.Popen(
        [SITL, "--scenario", "forward-to-hover", "--speed", "0", "--port", "0", "--gcs-port", port, "--api-port", "0",
         "--state-dir", str(tmp_path)],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    heard = []
    try:
        # A listener that falls behind loses datagrams: the end of the process ends the flight, not a message.
        while (message := ground.recv_match(blocking=True, timeout=1)) is not None or vehicle.poll() is None:
            heard += [message] if message is not None else []
        figures = vehicle.communicate(timeout=60)[0]
    finally:
        vehicle.kill()
        vehicle.wait()
        ground.close()
    return heard, figures, vehicle.returncode


@pytest.mark.long
def test_a_stock_client_sees_the_law_and_the_lyapunov_value_until_the_end(watched):
    heard, figures, code = watched
    named = [(m.name, m.value) for m in heard if m.get_type() == "NAMED_VALUE_FLOAT"]
    lyapunov = [value for name, value in named if name == "V"]
    assert {HOVER, TO_FORWARD, TO_HOVER} <= {value for name, value in named if name == "law"}
    assert max(lyapunov) > 1e3
    assert lyapunov[-1] < 1e-3
    text = "".join(m.text for m in heard if m.get_type() == "STATUSTEXT")
    assert "Scenario forward-to-hover: 80 s" in text
    assert "Target [50, 0, 0] in forward flight at 10 m/s" in text
    assert "ok: before 40 s" in figures
    assert code == 0
