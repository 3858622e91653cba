"""The laws of MAVLink FTP, both sides, and both together over a bad link."""

import itertools
import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.engines import ftp_server
from protocol.engines.base import Peer
from protocol.engines.files import BytesFile, Entry
from protocol.engines.ftp import DATA, Packet, crc32
from protocol.engines.ftp_client import FtpClient
from protocol.engines.ftp_server import FtpServer
from protocol.errors import LocalProtocolError
from protocol.events import FileFailed, FileListed, FileProgress, FileReceived, FileSummed
from tests.support.lossy_pipe import LossyPipe

GROUND, OTHER, VEHICLE = Peer(255, 190, "ground"), Peer(245, 190, "other"), (1, 1)
NONE, TERMINATE, RESET, LIST, OPEN, READ, CREATE, WRITE = range(8)
REMOVE, CRC, BURST, ACK, NAK = 8, 14, 15, 128, 129
SIZE, SESSION, FULL, EOF, UNKNOWN, PROTECTED, MISSING = 3, 4, 5, 6, 7, 9, 10
BIG = random.Random(5).randbytes(40_000)


class Tree:
    """Two folders; counts how many of its files are open."""

    def __init__(self, **files):
        self.files = {"a.txt": b"hello", "big.bin": BIG, "empty": b"", **files}
        self.opened = 0

    def entries(self, path):
        if path.strip("/") == "many":
            return [Entry(f"log{n:04}.tlog", n) for n in range(100)]
        if path.strip("/"):
            raise FileNotFoundError(path)
        return [*(Entry(name, len(data)) for name, data in self.files.items()), Entry("many", None)]

    def open(self, path):
        name = path.strip("/")
        if name == "many":
            raise IsADirectoryError(path)
        if name == "broken":
            return Broken(self)
        if name not in self.files:
            raise FileNotFoundError(path)
        return Opened(self, self.files[name])


class Opened(BytesFile):
    def __init__(self, tree, data=b"x" * 500):
        super().__init__(data)
        self.tree = tree
        tree.opened += 1

    def close(self):
        self.tree.opened -= 1


class Broken(Opened):
    def read(self, *_):
        raise OSError(5, "disk")


def request(opcode, path="", *, seq=1, session=0, offset=0, size=None):
    data = path.encode()
    return Packet(seq, session, opcode, len(data) if size is None else size, offset=offset, data=data)


def ask(server, packet, *, now=0.0, peer=GROUND):
    """Put one request; what is answered at once."""
    server.receive(packet.to_message(1, 1), now, peer)
    return taken(server)


def taken(server):
    return [Packet.of(outgoing.message) for outgoing in server.messages_to_send()]


def stream(server, limit=30.0):
    """What comes by itself, as long as something does."""
    packets = []
    while server._beat < limit:
        server.handle_timer(server._beat)
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


# The payload


@given(
    st.builds(
        Packet,
        st.integers(0, 65535),
        *[st.integers(0, 255)] * 3,
        req_opcode=st.integers(0, 255),
        burst_complete=st.integers(0, 1),
        offset=st.integers(0, 2**32 - 1),
        data=st.binary(min_size=DATA, max_size=DATA),
    )
)
def test_a_packet_survives_the_wire(packet):
    assert Packet.of(packet.to_message(1, 1)) == packet


def test_the_checksum_is_the_one_clients_compute():
    def bit_by_bit(data):  # as PX4 and ArduPilot do it: reflected polynomial, seed 0, no inversion
        crc = 0
        for byte in data:
            crc ^= byte
            for _ in range(8):
                crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
        return crc

    assert crc32(BIG[:1000]) == bit_by_bit(BIG[:1000])
    assert crc32(BIG[400:1000], crc32(BIG[:400])) == crc32(BIG[:1000])
    assert crc32(b"") == 0


# The vehicle's side


def test_opening_tells_the_size_and_the_session_asked_for():
    (answer,) = ask(FtpServer(1, 1, Tree()), request(OPEN, "/big.bin", seq=65535, session=77))
    assert (answer.seq, answer.session, answer.opcode, answer.req_opcode, answer.size) == (0, 77, ACK, OPEN, 4)
    assert int.from_bytes(answer.content, "little") == len(BIG)


def test_two_clients_may_use_one_number():
    server = FtpServer(1, 1, Tree())
    assert opened(server, "a.txt", session=3) == 3
    ask(server, request(OPEN, "big.bin", session=3), peer=OTHER)
    (own,) = ask(server, request(READ, session=3, size=5))
    (theirs,) = ask(server, request(READ, session=3, size=5), peer=OTHER)
    assert (own.content, theirs.content) == (b"hello", BIG[:5])


def test_a_number_in_use_makes_another():
    server = FtpServer(1, 1, Tree())
    first, second = opened(server, seq=1), opened(server, "a.txt", seq=2)
    assert first != second


def test_a_client_that_was_restarted_takes_its_old_number_over():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    opened(server, seq=1)
    (answer,) = ask(server, request(OPEN, "a.txt", seq=2), now=ftp_server.RESTARTED)
    assert (answer.session, tree.opened) == (0, 1)


def test_reads_are_independent_and_end_with_eof():
    server = FtpServer(1, 1, Tree())
    session = opened(server)
    for offset, size in ((300, 100), (0, DATA), (len(BIG) - 3, 50)):
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


def test_a_failing_disk_is_told_with_its_number():
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


def test_a_repeated_opening_is_answered_again_not_done_again():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    assert ask(server, request(OPEN, "a.txt")) == ask(server, request(OPEN, "a.txt"), now=1.0)
    assert (server.sessions, tree.opened) == (1, 1)


def test_a_repeated_end_is_acknowledged_again():
    server = FtpServer(1, 1, Tree())
    ending = request(TERMINATE, session=opened(server), seq=2)
    assert ask(server, ending) == ask(server, ending, now=0.5)
    assert server.sessions == 0


def test_an_opening_repeated_after_its_session_ended_opens_anew():
    server = FtpServer(1, 1, Tree())
    session = opened(server)
    ask(server, request(TERMINATE, session=session, seq=2))
    assert opened(server) == session
    assert server.sessions == 1


def test_resetting_closes_only_the_askers_sessions():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    for number in range(3):
        opened(server, session=number, seq=number)
    ask(server, request(OPEN, "a.txt"), peer=OTHER)
    assert [a.opcode for a in ask(server, request(RESET, seq=9))] == [ACK]
    assert (server.sessions, tree.opened) == (1, 1)


def test_sessions_are_bounded_per_peer_and_in_all():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    for number, system in itertools.product(range(20), range(2, 12)):
        ask(server, request(OPEN, "a.txt", session=number, seq=number), peer=Peer(system, 190, system))
    assert server.sessions == tree.opened == ftp_server.SESSIONS
    own = FtpServer(1, 1, Tree())
    codes = [ask(own, request(OPEN, "a.txt", session=n, seq=n))[0].opcode for n in range(20)]
    assert codes == [ACK] * ftp_server.SESSIONS_OF_PEER + [NAK] * (20 - ftp_server.SESSIONS_OF_PEER)
    assert error(ask(own, request(OPEN, "a.txt", seq=99))) == FULL


def test_a_session_nobody_uses_is_closed():
    tree = Tree()
    server = FtpServer(1, 1, tree)
    session = opened(server)
    assert server.next_deadline() == ftp_server.IDLE
    ask(server, request(READ, session=session, size=1), now=10.0)
    server.handle_timer(ftp_server.IDLE)
    assert tree.opened == 1
    server.handle_timer(10.0 + ftp_server.IDLE)
    assert (tree.opened, server.next_deadline()) == (0, math.inf)
    assert error(ask(server, request(READ, session=session, size=1), now=30.0)) == SESSION


def test_a_burst_is_paced_numbered_and_ended():
    server = FtpServer(1, 1, Tree())
    session = opened(server, session=4)
    assert ask(server, request(BURST, session=session, size=200, offset=1000, seq=65530)) == []
    server.handle_timer(server._beat)
    first = taken(server)
    assert len(first) == ftp_server.PACKETS
    packets = first + stream(server)
    assert b"".join(p.content for p in packets) == BIG[1000 : 1000 + len(packets) * 200]
    assert [p.seq for p in packets[:8]] == [65531, 65532, 65533, 65534, 65535, 0, 1, 2]
    assert [p.burst_complete for p in packets] == [0] * (len(packets) - 1) + [1]
    assert {p.session for p in packets} == {4}


def test_a_burst_that_reaches_the_end_says_so_and_beyond_it_is_eof():
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


def test_checksums_take_turns_with_the_flight():
    data = random.Random(1).randbytes(5 * ftp_server.SLICE + 7)
    tree = Tree(large=data)
    server = FtpServer(1, 1, tree)
    ask(server, request(CRC, "large"))
    ask(server, request(CRC, "large"))
    beats = 0
    while not (answers := taken(server)):
        server.handle_timer(server._beat)
        beats += 1
    assert [int.from_bytes(a.content, "little") for a in answers] == [crc32(data)]
    assert (beats, tree.opened) == (6, 0)


def test_answers_and_other_targets_are_left_alone():
    server = FtpServer(1, 1, Tree())
    server.receive(request(ACK).to_message(1, 1), 0.0, GROUND)
    server.receive(request(OPEN, "a.txt").to_message(2, 1), 0.0, GROUND)
    assert taken(server) == []


@given(st.lists(st.tuples(st.binary(min_size=251, max_size=251), st.integers(0, 40), st.floats(0, 1))))
def test_whatever_arrives_the_server_stays_bounded_and_silent_about_it(garbage):
    tree, now = Tree(), 0.0
    server = FtpServer(1, 1, tree)
    for payload, system, step in garbage:
        now += step
        packet = Packet.of(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, list(payload)))
        short = packet._replace(opcode=packet.opcode % 18, size=packet.size % 250, data=b"big.bin")
        ask(server, short, now=now, peer=Peer(system, 1, system))
        server.handle_timer(now)
    assert server.sessions <= ftp_server.SESSIONS
    assert len(server._known) <= ftp_server.PEERS
    assert tree.opened <= ftp_server.SESSIONS + ftp_server.CHECKSUMS


# The ground's side


def answer(packet, opcode=ACK, data=b"", **changes):
    """A server's answer to a client's request."""
    made = Packet(packet.seq + 1 & 0xFFFF, packet.session, opcode, len(data), packet.opcode, 0, packet.offset, data)
    return made._replace(**changes).to_message(255, 190)


def sent(client):
    return [Packet.of(message) for message in client.messages_to_send()]


def reading(size=1000):
    """A client that has opened a file of that size, and its burst request."""
    client = FtpClient(255, 190)
    client.read(VEHICLE, "f", 0.0)
    client.receive(answer(sent(client)[0], data=size.to_bytes(4, "little")), 0.1)
    return client, sent(client)[-1]


def outcome(client):
    return [event for event in client.events() if not isinstance(event, FileProgress)]


def test_a_silent_vehicle_ends_the_operation():
    client = FtpClient(255, 190)
    client.read(VEHICLE, "f", 0.0)
    while (now := client.next_deadline()) < math.inf:
        client.handle_timer(now)
    packets = sent(client)
    assert len(packets) == 7
    assert len(set(packets)) == 1
    assert outcome(client) == [FileFailed("f", None, "no answer")]
    assert not client.is_busy


def test_a_refusal_is_told_by_name():
    client = FtpClient(255, 190)
    client.read(VEHICLE, "f", 0.0)
    client.receive(answer(sent(client)[0], NAK, bytes([MISSING])), 0.1)
    assert outcome(client) == [FileFailed("f", MISSING, "FILENOTFOUND")]


def test_answers_out_of_turn_are_ignored():
    client = FtpClient(255, 190)
    client.read(VEHICLE, "f", 0.0)
    (packet,) = sent(client)
    for message in (
        answer(packet._replace(seq=packet.seq + 5), data=bytes(4)),
        answer(packet, opcode=OPEN),
        answer(packet, req_opcode=LIST),
        answer(packet, data=bytes(4)).__class__(0, 254, 190, [0] * 251),
    ):
        client.receive(message, 0.1)
    assert (outcome(client), sent(client), client.is_busy) == ([], [], True)


def test_pieces_of_another_session_or_size_are_not_taken():
    client, burst = reading(300)
    client.receive(answer(burst, data=bytes(239), session=burst.session + 1), 0.1)
    client.receive(answer(burst, data=bytes(100)), 0.1)
    client.receive(answer(burst, data=bytes(61), offset=7), 0.1)
    client.receive(answer(burst, data=bytes(239), offset=239), 0.1)
    assert client.events() == []


def test_the_end_of_an_earlier_burst_does_not_end_a_later_one():
    client, burst = reading(239 * 300)
    end = answer(burst, data=bytes(239), offset=239, seq=burst.seq + 2, burst_complete=1)
    client.receive(end, 0.1)
    (again,) = sent(client)
    assert again.seq == burst.seq + 3  # both ends count on
    client.receive(end, 0.2)
    assert sent(client) == []


def test_a_piece_counts_though_it_answers_an_earlier_request():
    client, _ = reading(300)
    client.handle_timer(client.next_deadline())
    pieces = sent(client)
    client.handle_timer(client.next_deadline())
    assert {p.offset for p in sent(client)} == {p.offset for p in pieces} == {0, 239}
    for piece in pieces:
        client.receive(answer(piece, data=bytes(piece.size)), 4.0)
    assert outcome(client) == [FileReceived("f", bytes(300))]


def test_a_listing_that_does_not_end_is_ended():
    client = FtpClient(255, 190)
    client.request_list(VEHICLE, "/", 0.0)
    for _ in range(1000):
        for packet in sent(client):
            client.receive(answer(packet, data=b"Fx\t1\0" * 40), 0.1)
    assert outcome(client) == [FileFailed("/", None, "the listing does not end")]


def test_a_file_too_large_to_be_kept_is_not_fetched():
    client, _ = reading(0xFFFFFFFF)
    assert outcome(client) == [FileFailed("f", None, "4294967295 bytes are too many")]


def test_a_path_that_does_not_fit_is_a_mistake():
    for path in ("x" * 240, "é", "a\0b"):
        with pytest.raises(LocalProtocolError):
            FtpClient(255, 190).read(VEHICLE, path, 0.0)


def test_cancelling_ends_all_that_wait():
    client = FtpClient(255, 190)
    client.read(VEHICLE, "a", 0.0)
    client.checksum(VEHICLE, "b", 0.0)
    client.cancel("closed")
    assert outcome(client) == [FileFailed("a", None, "closed"), FileFailed("b", None, "closed")]
    assert (client.is_busy, client.next_deadline()) == (False, math.inf)


# Both together


def converse(operations, *, seed=0, limit=120.0, **losses):
    """Work through a client's operations on a link; events, the server, and when all was over."""
    tree = Tree()
    server, client = FtpServer(1, 1, tree), FtpClient(255, 190)
    up, down = LossyPipe(seed, **losses), LossyPipe(seed + 1000, **losses)
    now, events = 0.0, []
    for name, path in operations:
        getattr(client, name)(VEHICLE, path, now)
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


OPERATIONS = [("request_list", "many"), ("read", "big.bin"), ("read", "empty"), ("checksum", "big.bin"), ("read", "no")]


def check(events):
    listing, file, empty, summed, failed = events
    assert listing == FileListed("many", tuple((f"log{n:04}.tlog", n) for n in range(100)))
    assert file == FileReceived("big.bin", BIG)
    assert empty == FileReceived("empty", b"")
    assert summed == FileSummed("big.bin", crc32(BIG))
    assert failed == FileFailed("no", MISSING, "FILENOTFOUND")


def test_everything_works_on_a_good_link_and_leaves_nothing_open():
    events, server, now = converse(OPERATIONS)
    check(events)
    assert server.sessions == 0
    assert now < 1.0


@pytest.mark.parametrize("seed", range(6))
def test_everything_works_through_30_percent_loss(seed):
    events, server, now = converse(OPERATIONS, seed=seed, drop=0.3, duplicate=0.1, reorder=0.3, delay=0.05)
    check(events)
    server.handle_timer(now + ftp_server.IDLE)
    assert server.sessions == 0
