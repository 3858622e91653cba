"""The real process rebooted and shut down over the wire, by unmodified pymavlink."""

import pytest
from pymavlink import mavutil

from tests.e2e.support import running

REBOOT, SHUTDOWN = 1, 2
ACCEPTED, DENIED = 0, 2


@pytest.fixture
def ground():
    connection = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="all")
    yield connection
    connection.close()


def port_of(ground):
    return ground.port.getsockname()[1]


def ask(ground, action):
    ground.mav.command_long_send(1, 1, mavutil.mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 0, action, 0, 0, 0, 0, 0, 0)
    return hear(ground, "COMMAND_ACK").result


def hear(ground, kind):
    message = ground.recv_match(type=kind, blocking=True, timeout=60)
    assert message is not None, kind
    return message


def boot_time(ground):
    return hear(ground, "ATTITUDE").time_boot_ms


@pytest.mark.long
def test_a_reboot_keeps_parameters_and_a_shutdown_ends_the_process(ground, tmp_path):
    with running(port_of(ground), tmp_path, "--speed", "5") as (process, _):
        ground.wait_heartbeat(timeout=60)
        while boot_time(ground) < 5_000:
            pass
        ground.mav.param_set_send(1, 1, b"MIS_TAKEOFF_ALT", 4.5, mavutil.mavlink.MAV_PARAM_TYPE_REAL32)
        assert hear(ground, "PARAM_VALUE").param_value == 4.5
        assert ask(ground, REBOOT) == ACCEPTED
        while boot_time(ground) > 5_000:  # sent before the reboot
            pass
        ground.mav.param_request_read_send(1, 1, b"MIS_TAKEOFF_ALT", -1)
        assert hear(ground, "PARAM_VALUE").param_value == 4.5
        assert process.poll() is None
        assert ask(ground, SHUTDOWN) == ACCEPTED
        assert process.wait(timeout=30) == 0


@pytest.mark.long
def test_a_scenario_refuses_to_reboot(ground, tmp_path):
    with running(port_of(ground), tmp_path, "--scenario", "far-target", "--stay") as (process, _):
        ground.wait_heartbeat(timeout=60)
        assert ask(ground, REBOOT) == DENIED
        assert process.poll() is None
