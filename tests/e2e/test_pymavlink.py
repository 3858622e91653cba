"""A plain pymavlink script flies the real process."""

import re

import pytest

from tests.e2e.support import BRISK, fly, free_ports, vehicle


@pytest.mark.long
def test_a_plain_script_flies_a_whole_session(tmp_path):
    (port,) = free_ports(1)
    with vehicle(port, tmp_path, "--speed", "10", "--param", "COM_OF_LOSS_T=5", *BRISK):
        code, output = fly("pymavlink_session.py", "--url", f"udpin:127.0.0.1:{port}")
    assert code == 0, output
    steps = re.findall(r"^ok (\w+):", output, re.MULTILINE)
    assert steps == ["connect", "parameters", "rates", "mission", "fly", "set_points", "land"]
    assert "ATTITUDE every 20 ms" in output
