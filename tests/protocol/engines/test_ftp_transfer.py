"""FTP client and server over a good and a bad link."""

import pytest

from protocol.engines.client.ftp_client import FtpClient
from protocol.engines.server import ftp_server
from protocol.engines.server.ftp_server import FtpServer
from protocol.events import FileFailed, FileProgress, FileReceived
from protocol.wire.message import Peer
from tests.support.links.ftp_tree import BIG, Tree
from tests.support.links.lossy_pipe import LossyPipe

GROUND, VEHICLE = Peer(255, 190, "ground"), (1, 1)


MISSING = 10


def outcome(client):
    return [event for event in client.events() if not isinstance(event, FileProgress)]


def converse(paths, *, seed=0, limit=120.0, **losses):
    """Read files over a link; returns the events, the server and the end time."""
    tree = Tree()
    server, client = FtpServer(1, 1, tree), FtpClient(255, 190)
    up, down = LossyPipe(seed, **losses), LossyPipe(seed + 1000, **losses)
    now, events = 0.0, []
    for path in paths:
        client.read(VEHICLE, path, now)
    while client.is_busy and now < limit:
        for engine, pipe in ((client, up), (server, down)):
            for item in engine.messages_to_send():
                pipe.send(getattr(item, "message", item), now)
        instants = (client.next_deadline(), server.next_deadline(), up.next_arrival(), down.next_arrival())
        now = max(now, min(instants))
        for message in up.receive(now):
            server.receive(message, now, GROUND)
        for message in down.receive(now):
            client.receive(message, now)
        server.handle_timer(now)
        client.handle_timer(now)
        events += outcome(client)
    return events, server, now


PATHS = ["big.bin", "empty", "no"]


def check(events):
    file, empty, failed = events
    assert file == FileReceived("big.bin", BIG)
    assert empty == FileReceived("empty", b"")
    assert failed == FileFailed("no", MISSING, "FILENOTFOUND")


def test_files_are_read_on_a_good_link_and_no_session_stays_open():
    events, server, now = converse(PATHS)
    check(events)
    assert server.sessions == 0
    assert now < 1.0


@pytest.mark.parametrize("seed", range(6))
def test_files_are_read_through_30_percent_loss(seed):
    events, server, now = converse(PATHS, seed=seed, drop=0.3, duplicate=0.1, reorder=0.3, delay=0.05)
    check(events)
    server.handle_timer(now + ftp_server.SESSION_TIMEOUT)
    assert server.sessions == 0
