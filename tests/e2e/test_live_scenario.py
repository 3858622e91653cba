"""A scenario in the real process, watched by a stock client."""

import socket
import subprocess
import sys
from pathlib import Path

from pymavlink import mavutil

SITL = str(Path(sys.executable).parent / "darko-sitl")


def test_a_stock_client_watches_law_and_lyapunov_value_to_the_end(tmp_path):
    ground = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="common")
    ground.port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    port = ground.port.getsockname()[1]
    command = [SITL, "--scenario", "far-target", "--speed", "0", "--port", "0", "--gcs-port", str(port)]
    vehicle = subprocess.Popen(
        [*command, "--api-port", "0", "--state-dir", str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    laws, lyapunov, texts = [], [], ""
    try:
        while "Scenario complete" not in texts:
            message = ground.recv_match(blocking=True, timeout=120)
            assert message is not None, texts
            if message.get_type() == "STATUSTEXT":
                texts += message.text
            elif message.get_type() == "NAMED_VALUE_FLOAT":
                {"law": laws, "V": lyapunov}.get(message.name, []).append(message.value)
        figures, _ = vehicle.communicate(timeout=60)
    finally:
        vehicle.kill()
        vehicle.wait()
        ground.close()
    assert "Target [100, 100, 50]" in texts
    assert vehicle.returncode == 0
    assert "ok: before 100 s" in figures
    assert {1.0, 2.0} <= set(laws)  # both hover laws
    assert max(lyapunov) > 1e4
    assert lyapunov[-1] < 1e-3
