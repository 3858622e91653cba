"""Clients of others read the simulated Motive over loopback: the libraries natnet and motioncapture."""

import subprocess
import sys
import threading
from contextlib import ExitStack

import numpy as np
import pytest
from natnet import NatNetClient, Version

from sitl.commands.mocap import parser
from sitl.motion_capture import motive_process
from tests.e2e.support import free_ports, need
from tests.support.motion_capture.hall import motion

PLACE = (1.0, 2.0, 3.0)  # north, west, up
STREAMED = (-2.0, 1.0, 3.0)  # as ENAC's axes have it: right, far, up


class StillVehicle:
    """Stands for the watch of a vehicle that hovers."""

    refusal = ""

    def __init__(self, began):
        self.began = began

    def is_seen(self, _now):
        return True

    def time(self, now):
        return now - self.began

    def requests(self, _now):
        return []


@pytest.fixture
def serve():
    """Starts a Motive with these options; gives its command port and a frame counter."""
    stop, threads = threading.Event(), []
    with ExitStack() as stack:

        def start(*options):
            command_port, data_port = free_ports(2)
            ports = ["--command-port", str(command_port), "--data-port", str(data_port)]
            args = parser({"mocap": ""}).parse_args([*ports, "--noise", "0", "--dropout", "0", *options])
            motive = motive_process.build_motive(args, lambda _text: None, stack)
            motive._stdin = None
            motive._watch = StillVehicle(motive_process.time.monotonic())
            threads.append(threading.Thread(target=run, args=(motive,)))
            threads[-1].start()
            return command_port, data_port

        def run(motive):
            while not stop.is_set():
                now = motive_process.time.monotonic()
                motive._cameras.look(motion(motive._watch.time(now), PLACE))
                motive.step(now)
                motive.wait(now)

        yield start
        stop.set()
        for thread in threads:
            thread.join()


@pytest.mark.parametrize("version", ["3.1", "4.1"])
@pytest.mark.parametrize("way", ["multicast", "unicast"])
def test_natnet_reads_the_stream(serve, version, way):
    command_port, data_port = serve("--natnet", version, *(["--unicast"] if way == "unicast" else []))
    client = NatNetClient(use_multicast=way == "multicast", command_port=command_port, data_port=data_port)
    frames, described = [], []
    enough = threading.Event()

    def take(frame):
        frames.append(frame)
        if len(frames) >= 10 and described:
            enough.set()

    client.on_data_frame_received_event.handlers.append(take)
    client.on_data_description_received_event.handlers.append(described.append)
    with client:
        client.request_modeldef()
        client.run_async()
        assert enough.wait(10.0)
        client.stop_async()
        assert client.protocol_version == Version(*map(int, version.split(".")))
    assert described[0].rigid_bodies[0].name == "DarkO"
    body = frames[-1].rigid_bodies[0]
    assert body.tracking_valid
    assert body.pos == pytest.approx(STREAMED, abs=0.01)
    assert np.abs(body.rot) == pytest.approx((0, 0, 0, 1), abs=0.05)
    assert len(frames[-1].labeled_markers) == 4


CRAZYSWARM = """
import sys, motioncapture
settings = {"hostname": "127.0.0.1", "interface_ip": "127.0.0.1", "port_command": sys.argv[1]}
client = motioncapture.connect("optitrack", settings)
for _ in range(3):
    client.waitForNextFrame()
    body = client.rigidBodies["DarkO"]
    print(*body.position, body.rotation.w)
"""


@pytest.mark.parametrize("version", ["3.1", "4.1"])
def test_motioncapture_reads_the_stream(serve, version):
    need("motioncapture")
    command_port, _ = serve("--natnet", version)
    done = subprocess.run(
        [sys.executable, "-c", CRAZYSWARM, str(command_port)], capture_output=True, text=True, timeout=20, check=False
    )
    assert done.returncode == 0, done.stderr
    x, y, z, w = map(float, done.stdout.splitlines()[-1].split())
    assert (x, y, z) == pytest.approx(STREAMED, abs=0.01)
    assert abs(w) == pytest.approx(1.0, abs=0.01)
