"""The autopilot type and the mode names that the real process reports to unmodified pymavlink."""

import pytest
from pymavlink import mavutil

from tests.e2e.support import vehicle

AVAILABLE_MODES = 435


@pytest.mark.parametrize(("arguments", "autopilot"), [((), 12), (("--autopilot", "generic"), 0)])
def test_the_vehicle_reports_the_autopilot_type_of_the_command_line_and_its_mode_names(tmp_path, arguments, autopilot):
    ground = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="all")
    try:
        with vehicle(ground.port.getsockname()[1], tmp_path, *arguments):
            assert ground.wait_heartbeat(timeout=60).autopilot == autopilot
            ground.mav.command_long_send(1, 1, 512, 0, AVAILABLE_MODES, 0, 0, 0, 0, 0, 0)
            first = ground.recv_match(type="AVAILABLE_MODES", blocking=True, timeout=60)
            rest = [
                ground.recv_match(type="AVAILABLE_MODES", blocking=True, timeout=60)
                for _ in range(first.number_modes - 1)
            ]
    finally:
        ground.close()
    assert "Law: forward line of sight" in [m.mode_name for m in [first, *rest]]
