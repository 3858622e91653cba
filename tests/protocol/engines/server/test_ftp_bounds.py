"""The bounds of the FTP server in numbers: bursts, sessions and stored answers."""

import pytest

from protocol.dialect import mavlink
from protocol.engines.file_transfer import MAX_DATA, Entry, FtpPacket
from protocol.engines.server.ftp_server import FtpServer
from protocol.wire.message import Peer
from tests.support.links.ftp_tree import Tree

GROUND = Peer(255, 190, "ground")
OPEN, RESET, BURST = (
    mavlink.MAV_FTP_OPCODE_OPENFILERO,
    mavlink.MAV_FTP_OPCODE_RESETSESSION,
    mavlink.MAV_FTP_OPCODE_BURSTREADFILE,
)
ACK, NAK = mavlink.MAV_FTP_OPCODE_ACK, mavlink.MAV_FTP_OPCODE_NAK


def ask(server, opcode, *, path="", seq=1, session=0, now=0.0, peer=GROUND):
    """The immediate answers to a request."""
    data = path.encode()
    server.receive(FtpPacket(seq, session, opcode, len(data), data=data).to_message(1, 1), now, peer)
    return [FtpPacket.of(out.message) for out in server.messages_to_send()]


def burst(size):
    """All packets of one burst of a file of that many bytes."""
    server = FtpServer(1, 1, Tree(file=bytes(size)))
    ask(server, OPEN, path="file")
    ask(server, BURST, seq=2)
    packets = []
    for _ in range(100):
        if (now := server.next_deadline()) < 5.0:
            server.handle_timer(now)
        packets += [FtpPacket.of(out.message) for out in server.messages_to_send()]
    return packets


@pytest.mark.parametrize(("parts", "sent"), [(1, 1), (199, 199), (200, 200), (201, 200), (400, 200)])
def test_a_burst_has_200_messages_at_most_and_its_last_one_says_so(parts, sent):
    packets = burst(parts * MAX_DATA)
    assert [packet.offset for packet in packets] == [number * MAX_DATA for number in range(sent)]
    assert [packet.burst_complete for packet in packets] == [0] * (sent - 1) + [1]


def test_a_client_may_open_6_sessions_and_all_clients_16():
    server = FtpServer(1, 1, Tree())
    peers = [Peer(system, 190, system) for system in (10, 11, 12)]
    opened = [
        [ask(server, OPEN, path="a.txt", seq=number, session=number, peer=peer)[0].opcode for number in range(7)]
        for peer in peers
    ]
    assert opened == [[ACK] * 6 + [NAK], [ACK] * 6 + [NAK], [ACK] * 4 + [NAK] * 3]
    assert server.sessions == 16


@pytest.mark.parametrize(("age", "sessions"), [(14.99, 1), (15.0, 0)])
def test_a_session_is_closed_after_15_seconds_without_use(age, sessions):
    server = FtpServer(1, 1, Tree())
    ask(server, OPEN, path="a.txt", now=100.0)
    assert server.next_deadline() == 115.0
    server.handle_timer(100.0 + age)
    assert server.sessions == sessions


class CountingTree(Tree):
    """Counts how often a file is opened."""

    openings = 0

    def open(self, path):
        self.openings += 1
        return super().open(path)


@pytest.mark.parametrize(("age", "openings"), [(0.0, 1), (4.99, 1), (5.0, 2)])
def test_an_opening_is_answered_again_for_5_seconds_and_then_a_new_one(age, openings):
    tree = CountingTree()
    server = FtpServer(1, 1, tree)
    for now in (100.0, 100.0 + age):
        assert ask(server, OPEN, path="a.txt", now=now)[0].opcode == ACK
    assert tree.openings == openings
    assert server.sessions == 1  # whoever opens the same number again has been restarted


def stored(server):
    return list(server._answered)


def test_answers_of_32_clients_are_stored_and_one_more_drops_the_one_that_asked_longest_ago():
    server = FtpServer(1, 1, Tree())
    peers = [Peer(system, 190, system) for system in range(1, 34)]
    for peer in peers[:32]:
        ask(server, RESET, peer=peer)
    ask(server, RESET, seq=2, peer=peers[0])
    assert stored(server) == [*peers[1:32], peers[0]]
    ask(server, RESET, peer=peers[32])
    assert stored(server) == [*peers[2:32], peers[0], peers[32]]


class Growing(Tree):
    """Its files have more bytes than when they were opened."""

    def open(self, path):
        file = super().open(path)
        file.read = lambda offset, size: bytes(1000)[offset : offset + size]
        return file


def test_of_a_file_that_grew_after_its_opening_the_earlier_size_is_sent():
    server = FtpServer(1, 1, Growing(file=bytes(300)))
    ask(server, OPEN, path="file")
    for offset, size in ((0, 239), (239, 61)):
        request = FtpPacket(2 + offset, 0, mavlink.MAV_FTP_OPCODE_READFILE, MAX_DATA, offset=offset)
        server.receive(request.to_message(1, 1), 0.0, GROUND)
        (out,) = server.messages_to_send()
        assert FtpPacket.of(out.message).size == size


class Listed(Tree):
    """Has entries of these lengths, each with its type and an end in the list."""

    def __init__(self, *lengths):
        super().__init__()
        self.lengths = lengths

    def entries(self, _path):
        return [Entry("x" * (length - 2), None) for length in self.lengths]


@pytest.mark.parametrize(("last", "size"), [(39, 239), (40, 200)])
def test_an_answer_lists_as_many_entries_as_fit_its_239_bytes(last, size):
    (answer,) = ask(FtpServer(1, 1, Listed(100, 100, last)), mavlink.MAV_FTP_OPCODE_LISTDIRECTORY, path="/")
    assert answer.size == size
