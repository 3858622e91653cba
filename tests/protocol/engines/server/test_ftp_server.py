"""The FTP server: sessions, reads, bursts, checksums and refusals."""

import itertools
import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.engines.file_transfer import MAX_DATA, FtpPacket, crc32
from protocol.engines.server import ftp_server
from protocol.engines.server.ftp_server import FtpServer
from protocol.wire.message import Peer
from tests.support.links.ftp_tree import BIG, Tree

GROUND, OTHER = Peer(255, 190, "ground"), Peer(245, 190, "other")


NONE, TERMINATE, RESET, LIST, OPEN, READ, CREATE, WRITE = range(8)


REMOVE, CRC, BURST, ACK, NAK = 8, 14, 15, 128, 129


SIZE, SESSION, FULL, EOF, UNKNOWN, PROTECTED, MISSING = 3, 4, 5, 6, 7, 9, 10


def request(opcode, path="", *, seq=1, session=0, offset=0, size=None):
    data = path.encode()
    return FtpPacket(seq, session, opcode, len(data) if size is None else size, offset=offset, data=data)


def ask(server, packet, *, now=0.0, peer=GROUND):
    """Send one request; returns the immediate answers."""
    server.receive(packet.to_message(1, 1), now, peer)
    return taken(server)


def taken(server):
    return [FtpPacket.of(outgoing.message) for outgoing in server.messages_to_send()]


def stream(server, limit=30.0):
    """The packets of bursts and checksums until they end."""
    packets = []
    while server._deadline < limit:
        server.handle_timer(server._deadline)
        packets += taken(server)
    return packets


def error(answers):
    (answer,) = answers
    assert (answer.opcode, answer.size) == (NAK, 1)
    return answer.data[0]


def opened(server, path="big.bin", **options):
    (answer,) = ask(server, request(OPEN, path, **options))
    assert answer.opcode == ACK
    return answer.session


def test_opening_returns_the_size_and_the_requested_session():
    (answer,) = ask(FtpServer(1, 1, Tree()), request(OPEN, "/big.bin", seq=65535, session=77))
    assert (answer.seq, answer.session, answer.opcode, answer.req_opcode, answer.size) == (0, 77, ACK, OPEN, 4)
    assert int.from_bytes(answer.content, "little") == len(BIG)


def test_two_clients_may_use_the_same_session_number():
    server = FtpServer(1, 1, Tree())
    assert opened(server, "a.txt", session=3) == 3
    ask(server, request(OPEN, "big.bin", session=3), peer=OTHER)
    (own,) = ask(server, request(READ, session=3, size=5))
    (theirs,) = ask(server, request(READ, session=3, size=5), peer=OTHER)
    assert (own.content, theirs.content) == (b"hello", BIG[:5])


def test_a_session_number_in_use_is_replaced_by_another():
    server = FtpServer(1, 1, Tree())
    first, second = opened(server, seq=1), opened(server, "a.txt", seq=2)
    assert first != second


def test_a_restarted_client_gets_its_old_session_number():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    opened(server, seq=1)
    (answer,) = ask(server, request(OPEN, "a.txt", seq=2), now=ftp_server.RESTART_TIME)
    assert (answer.session, tree.opened) == (0, 1)


def test_reads_are_independent_and_end_with_eof():
    server = FtpServer(1, 1, Tree())
    session = opened(server)
    for offset, size in ((300, 100), (0, MAX_DATA), (len(BIG) - 3, 50)):
        (answer,) = ask(server, request(READ, session=session, offset=offset, size=size))
        assert (answer.content, answer.offset) == (BIG[offset : offset + size], offset)
    answers = ask(server, request(READ, session=session, offset=len(BIG), size=10))
    assert error(answers) == EOF


@pytest.mark.parametrize(
    ("packet", "code"),
    [
        (request(OPEN, "nosuch"), MISSING),
        (request(OPEN, "many"), 1),
        (request(OPEN, ""), MISSING),
        (request(LIST, "/nosuch"), MISSING),
        (request(LIST, "/", offset=4), EOF),
        (request(READ, session=9, size=10), SESSION),
        (request(BURST, session=9, size=10), SESSION),
        (request(TERMINATE, session=9), SESSION),
        (request(WRITE, "data", session=9), SESSION),
        (request(CREATE, "new"), PROTECTED),
        (request(REMOVE, "a.txt"), PROTECTED),
        (request(9, "folder"), PROTECTED),
        (request(10, "many"), PROTECTED),
        (request(11, "a.txt"), PROTECTED),
        (request(12, "a.txt"), PROTECTED),
        (request(13, "a.txt\0b.txt"), PROTECTED),
        (request(CRC, "nosuch"), MISSING),
        (request(16, "/"), UNKNOWN),
        (request(77), UNKNOWN),
        (request(OPEN, "a.txt", size=240), SIZE),
    ],
)
def test_refusals_carry_the_exact_code(packet, code):
    server = FtpServer(1, 1, Tree())
    answers = ask(server, packet)
    assert error(answers) == code
    assert (answers[0].seq, answers[0].req_opcode) == (packet.seq + 1, packet.opcode)
    assert server.sessions == 0


def test_a_session_that_reads_cannot_be_written_to():
    server = FtpServer(1, 1, Tree())
    assert error(ask(server, request(WRITE, "data", session=opened(server)))) == PROTECTED


def test_a_read_of_nothing_is_an_invalid_size():
    server = FtpServer(1, 1, Tree())
    assert error(ask(server, request(READ, session=opened(server), size=0))) == SIZE


def test_a_disk_error_is_reported_with_its_number():
    server = FtpServer(1, 1, Tree())
    session = opened(server, "broken")
    for answers in (
        ask(server, request(READ, session=session, size=10)),
        ask(server, request(BURST, session=session, size=10)) + stream(server),
        ask(server, request(CRC, "broken")) + stream(server),
    ):
        assert [(a.opcode, a.content) for a in answers] == [(NAK, bytes([2, 5]))]


def test_a_listing_comes_in_parts_that_join():
    server, names, offset = FtpServer(1, 1, Tree()), [], 0
    while (answer := ask(server, request(LIST, "many", offset=offset))[0]).opcode == ACK:
        lines = answer.content.rstrip(b"\0").split(b"\0")
        names += [line.split(b"\t")[0] for line in lines]
        offset += len(lines)
    assert names == [b"Flog%04d.tlog" % n for n in range(100)]
    assert error([answer]) == EOF


def test_a_repeated_opening_is_answered_but_not_executed_again():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    assert ask(server, request(OPEN, "a.txt")) == ask(server, request(OPEN, "a.txt"), now=1.0)
    assert (server.sessions, tree.opened) == (1, 1)


def test_a_repeated_end_is_acknowledged_again():
    server = FtpServer(1, 1, Tree())
    ending = request(TERMINATE, session=opened(server), seq=2)
    assert ask(server, ending) == ask(server, ending, now=0.5)
    assert server.sessions == 0


def test_an_opening_repeated_after_its_session_ended_is_executed():
    server = FtpServer(1, 1, Tree())
    session = opened(server)
    ask(server, request(TERMINATE, session=session, seq=2))
    assert opened(server) == session
    assert server.sessions == 1


def test_a_reset_closes_only_the_sessions_of_its_sender():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    for number in range(3):
        opened(server, session=number, seq=number)
    ask(server, request(OPEN, "a.txt"), peer=OTHER)
    assert [a.opcode for a in ask(server, request(RESET, seq=9))] == [ACK]
    assert (server.sessions, tree.opened) == (1, 1)


def test_sessions_are_limited_per_peer_and_in_total():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    for number, system in itertools.product(range(20), range(2, 12)):
        ask(server, request(OPEN, "a.txt", session=number, seq=number), peer=Peer(system, 190, system))
    assert server.sessions == tree.opened == ftp_server.MAX_SESSIONS
    own = FtpServer(1, 1, Tree())
    codes = [ask(own, request(OPEN, "a.txt", session=n, seq=n))[0].opcode for n in range(20)]
    assert codes == [ACK] * ftp_server.MAX_SESSIONS_PER_PEER + [NAK] * (20 - ftp_server.MAX_SESSIONS_PER_PEER)
    assert error(ask(own, request(OPEN, "a.txt", seq=99))) == FULL


def test_an_unused_session_is_closed():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    session = opened(server)
    assert server.next_deadline() == ftp_server.SESSION_TIMEOUT
    ask(server, request(READ, session=session, size=1), now=10.0)
    server.handle_timer(ftp_server.SESSION_TIMEOUT)
    assert tree.opened == 1
    server.handle_timer(10.0 + ftp_server.SESSION_TIMEOUT)
    assert (tree.opened, server.next_deadline()) == (0, math.inf)
    assert error(ask(server, request(READ, session=session, size=1), now=30.0)) == SESSION


def test_a_burst_is_paced_numbered_and_ended():
    server = FtpServer(1, 1, Tree())
    session = opened(server, session=4)
    assert ask(server, request(BURST, session=session, size=200, offset=1000, seq=65530)) == []
    server.handle_timer(server._deadline)
    first = taken(server)
    assert len(first) == ftp_server.MESSAGES_PER_INTERVAL
    packets = first + stream(server)
    assert b"".join(p.content for p in packets) == BIG[1000 : 1000 + len(packets) * 200]
    assert [p.seq for p in packets[:8]] == [65531, 65532, 65533, 65534, 65535, 0, 1, 2]
    assert [p.burst_complete for p in packets] == [0] * (len(packets) - 1) + [1]
    assert {p.session for p in packets} == {4}


def test_a_burst_marks_the_end_of_the_file_and_one_beyond_it_is_eof():
    server = FtpServer(1, 1, Tree())
    session = opened(server, "a.txt")
    ask(server, request(BURST, session=session, size=0))
    (packet,) = stream(server)
    assert (packet.content, packet.burst_complete) == (b"hello", 1)
    answers = ask(server, request(BURST, session=session, offset=5))
    assert error(answers) == EOF
    assert answers[0].offset == 5


def test_an_ended_session_stops_its_burst():
    server = FtpServer(1, 1, Tree())
    session = opened(server)
    ask(server, request(BURST, session=session))
    ask(server, request(TERMINATE, session=session, seq=3))
    assert stream(server) == []


def test_a_checksum_is_computed_in_slices():
    data = random.Random(1).randbytes(5 * ftp_server.CHECKSUM_SLICE + 7)
    tree = Tree(large=data)
    server = FtpServer(1, 1, tree)
    ask(server, request(CRC, "large"))
    ask(server, request(CRC, "large"))
    beats = 0
    while not (answers := taken(server)):
        server.handle_timer(server._deadline)
        beats += 1
    assert [int.from_bytes(a.content, "little") for a in answers] == [crc32(data)]
    assert (beats, tree.opened) == (6, 0)


def test_answers_and_other_targets_are_ignored():
    server = FtpServer(1, 1, Tree())
    server.receive(request(ACK).to_message(1, 1), 0.0, GROUND)
    server.receive(request(OPEN, "a.txt").to_message(2, 1), 0.0, GROUND)
    assert taken(server) == []


@given(st.lists(st.tuples(st.binary(min_size=251, max_size=251), st.integers(0, 40), st.floats(0, 1))))
def test_any_input_leaves_sessions_and_answers_limited(garbage):
    tree, now = Tree(), 0.0
    server = FtpServer(1, 1, tree)
    for payload, system, step in garbage:
        now += step
        packet = FtpPacket.of(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, list(payload)))
        short = packet._replace(opcode=packet.opcode % 18, size=packet.size % 250, data=b"big.bin")
        ask(server, short, now=now, peer=Peer(system, 1, system))
        server.handle_timer(now)
    assert server.sessions <= ftp_server.MAX_SESSIONS
    assert len(server._answered) <= ftp_server.MAX_ANSWERED_PEERS
    assert tree.opened <= ftp_server.MAX_SESSIONS + ftp_server.MAX_CHECKSUMS


def answer(packet, opcode=ACK, data=b"", **changes):
    """A server's answer to a client's request."""
    made = FtpPacket(packet.seq + 1 & 0xFFFF, packet.session, opcode, len(data), packet.opcode, 0, packet.offset, data)
    return made._replace(**changes).to_message(255, 190)


def test_what_is_sent_piece_by_piece_begins_one_interval_later():
    for begin in (request(BURST, seq=2, size=200), request(CRC, "big.bin", seq=2)):
        server = FtpServer(1, 1, Tree())
        opened(server)
        assert ask(server, begin, now=1.0) == []
        assert server.next_deadline() == 1.0 + ftp_server.SEND_INTERVAL
