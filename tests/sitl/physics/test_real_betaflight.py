"""The real Betaflight SITL in lockstep with the plant, where BETAFLIGHT_SITL names its executable (docs/physics.md)."""

import math
import os
import socket
import struct
import subprocess
import time
from contextlib import ExitStack, contextmanager, suppress

import pytest

from protocol.frames import flip_quaternion, quaternion_from_euler
from sitl.commands.physics import parser
from sitl.model.quaternions import Quaternion
from sitl.model.vectors import Vector
from sitl.physics.server import Server
from sitl.physics.serving import build_seats

EXECUTABLE = os.environ.get("BETAFLIGHT_SITL", "")
CONFIGURATION_PORT, ATTITUDE = 5761, 108  # MSP's, and the number of a message of it
PATIENCE = 60.0  # of real time, on a busy machine [s]

pytestmark = [pytest.mark.long, pytest.mark.skipif(not EXECUTABLE, reason="BETAFLIGHT_SITL names no executable")]


@contextmanager
def betaflight(folder):
    process = subprocess.Popen([EXECUTABLE], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def until(server, holds):
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        server.turn()


def attitude(server, client):
    """Roll, pitch (nose down) and yaw as it believes them to be [deg]."""
    client.sendall(b"$M<\0" + bytes([ATTITUDE, ATTITUDE]))
    told = bytearray()

    def is_told():
        with suppress(BlockingIOError):
            told.extend(client.recv(100))
        return len(told) >= 12

    until(server, is_told)
    return [x / scale for x, scale in zip(struct.unpack("<3h", told[5:11]), (10.0, 10.0, 1.0), strict=True)]


def test_it_flies_in_lockstep_sees_how_it_lies_and_comes_back(tmp_path):
    with betaflight(tmp_path):  # its first start writes its configuration
        until(Nobody(), lambda: any(file.stat().st_size >= 32768 for file in tmp_path.glob("eeprom.bin")))
        time.sleep(5.0)
    with ExitStack() as stack:
        args = parser({"physics": ""}).parse_args(["betaflight", "--start", "0,0,900,0"])
        server = Server(build_seats(args, lambda _: None, stack), lambda _: None, listens=False)
        rig = server._seats[0].link.rig
        vehicle = rig.vehicle
        with betaflight(tmp_path):
            until(server, lambda: vehicle.periods > 500)
            client = stack.enter_context(socket.create_connection(("127.0.0.1", CONFIGURATION_PORT)))
            client.setblocking(False)
            for roll, pitch, yaw in ((30, 0, 0), (0, 30, 0), (0, 0, 60)):
                q = Quaternion(*flip_quaternion(quaternion_from_euler(*map(math.radians, (roll, pitch, yaw)))))
                still = Vector(0.0, 0.0, 0.0)
                vehicle.place(vehicle.truth.body._replace(attitude=q, velocity=still, rates=still))
                begun = vehicle.periods
                until(server, lambda begun=begun: vehicle.periods > begun + 10)
                assert attitude(server, client) == pytest.approx((roll, -pitch, yaw), abs=2.0)
            client.close()
        until(server, lambda: rig.journal.counts["silences"] == 1)
        waiting = vehicle.periods
        with betaflight(tmp_path):
            until(server, lambda: vehicle.periods > waiting + 500)
        assert rig.journal.counts["restarts"] == 1
        assert rig.journal.counts["bad packets"] == rig.journal.counts["bad outputs"] == 0


class Nobody:
    """Serves nothing, and lets time pass."""

    @staticmethod
    def turn():
        time.sleep(0.1)
