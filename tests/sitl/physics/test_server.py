import os
import signal
import socket
import subprocess
import sys
from contextlib import ExitStack

import pytest

from sitl.commands.physics import parser
from sitl.defaults import HOME
from sitl.errors import SitlError
from sitl.physics.server import Server
from sitl.physics.serving import build_seats
from tests.support.foreign_autopilots import ArduPilotClient, Px4Client

ORIGIN = (HOME.lat_deg, HOME.lon_deg, HOME.alt)


@pytest.fixture
def serve():
    """A function that makes a server of a command line, on ports of the system's choice."""
    with ExitStack() as stack:

        def made(*words):
            told = []
            args = parser({"physics": ""}).parse_args([*words, "--port", "0"])
            return Server(build_seats(args, told.append, stack), told.append, listens=False), told

        yield made


def udp(port):
    client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    client.connect(("127.0.0.1", port))
    client.setblocking(False)
    return client


def received(client, server, turns=200):
    """Bytes that the server sends to a client within some turns."""
    for _ in range(turns):
        server.turn()
        try:
            return client.recv(65536)
        except BlockingIOError:
            continue
    return None


def test_two_instances_fly_by_themselves(serve):
    server, told = serve("ardupilot", "--instances", "2", "--start", "0,0,9,0")
    autopilots = [(udp(seat.port.port), ArduPilotClient()) for seat in server._seats]
    for number in range(20):
        for k, (client, autopilot) in enumerate(autopilots):
            if k == 0 or number < 5:
                client.send(autopilot.frame())
                autopilot.take(received(client, server))
    assert [seat.link.rig.vehicle.periods for seat in server._seats] == [20, 5]
    assert "instance 1: physics for ardupilot" in " ".join(told)


def test_while_it_is_paused_nothing_is_answered(serve):
    server, told = serve("ardupilot")
    client, autopilot = udp(server._seats[0].port.port), ArduPilotClient()
    server.order("pause")
    client.send(autopilot.frame())
    assert received(client, server, turns=3) is None
    server.order("go")
    autopilot.take(received(client, server))
    server.order("counts")
    server.order("dance")
    said = [line for line in told[2:-1] if not line.startswith("ArduPilot at")]
    assert said == ["paused: go flies on", "flies on", "nothing to note"]
    assert "'dance' is none of pause, go" in told[-1]


def test_a_client_that_dies_leaves_the_vehicle_where_it_is_and_another_begins_anew(serve):
    server, told = serve("px4", "--start", "0,0,9,0")
    port = server._seats[0].port.port
    for _ in range(2):
        client, autopilot = socket.create_connection(("127.0.0.1", port)), Px4Client(ORIGIN)
        client.setblocking(False)
        client.send(autopilot.greeting())
        for _ in range(10):
            client.send(autopilot.take(received(client, server)))
        client.close()
        for _ in range(20):
            server.turn()
    counts = server._seats[0].link.journal.counts
    assert counts == {"restarts": 1, "closed connections": 2}
    assert "PX4 is gone" in " ".join(told)


def test_a_port_in_use_is_one_line(serve):
    for autopilot, kind in (("ardupilot", socket.SOCK_DGRAM), ("px4", socket.SOCK_STREAM)):
        with socket.socket(socket.AF_INET, kind) as taken, ExitStack() as stack:
            taken.bind(("127.0.0.1", 0))
            if kind == socket.SOCK_STREAM:
                taken.listen(1)
            args = parser({"physics": ""}).parse_args([autopilot, "--port", str(taken.getsockname()[1])])
            with pytest.raises(SitlError, match=r"cannot listen on 127\.0\.0\.1:\d+: Address already in use"):
                build_seats(args, lambda _: None, stack)


def test_a_start_outside_of_the_arena_is_one_line():
    args = parser({"physics": ""}).parse_args(["px4", "--arena", "voliere", "--start", "0,0,90,0"])
    with ExitStack() as stack, pytest.raises(SitlError, match=r"--start: altitude 90\.0 m is outside the arena"):
        build_seats(args, lambda _: None, stack)


@pytest.mark.long
def test_the_process_serves_until_it_is_interrupted():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "sitl", "physics", "ardupilot", "--port", str(port), "--start", "0,0,9,0"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ)
    try:
        assert "loading the plant" in process.stderr.readline()
        assert f"physics for ardupilot on 127.0.0.1:{port} (UDP)" in process.stderr.readline()
        client, autopilot = udp(port), ArduPilotClient()
        client.setblocking(True)
        client.settimeout(120.0)
        for _ in range(500):
            client.send(autopilot.frame())
            autopilot.take(client.recv(65536))
        process.stdin.write("counts\n")
        process.stdin.flush()
        assert "ArduPilot at" in process.stderr.readline()
        assert "nothing to note" in process.stderr.readline()
        process.send_signal(signal.SIGTERM)
        _, rest = process.communicate(timeout=60.0)
        assert "flew 1.0 s; nothing to note" in rest
        assert "Traceback" not in rest
    finally:
        process.kill()
