"""The FTP client: one file at a time, whatever the answers."""

import math

import pytest

from protocol.engines.client.ftp_client import FtpClient
from protocol.engines.file_transfer import FtpPacket
from protocol.errors import LocalProtocolError
from protocol.events import FileFailed, FileProgress, FileReceived

VEHICLE = (1, 1)


NONE, TERMINATE, RESET, LIST, OPEN, READ, CREATE, WRITE = range(8)


ACK, NAK = 128, 129


MISSING = 10


def answer(packet, opcode=ACK, data=b"", **changes):
    """A server's answer to a client's request."""
    made = FtpPacket(packet.seq + 1 & 0xFFFF, packet.session, opcode, len(data), packet.opcode, 0, packet.offset, data)
    return made._replace(**changes).to_message(255, 190)


def sent(client):
    return [FtpPacket.of(message) for message in client.messages_to_send()]


def reading(size=1000):
    """A client that has opened a file of that size, and its burst request."""
    client = FtpClient(255, 190)
    client.read(VEHICLE, "f", 0.0)
    client.receive(answer(sent(client)[0], data=size.to_bytes(4, "little")), 0.1)
    return client, sent(client)[-1]


def outcome(client):
    return [event for event in client.events() if not isinstance(event, FileProgress)]


def test_a_silent_vehicle_fails_the_download():
    client = FtpClient(255, 190)
    client.read(VEHICLE, "f", 0.0)
    while (now := client.next_deadline()) < math.inf:
        client.handle_timer(now)
    packets = sent(client)
    assert len(packets) == 7
    assert len(set(packets)) == 1
    assert outcome(client) == [FileFailed("f", None, "no answer")]
    assert not client.is_busy


def test_a_refusal_is_reported_by_name():
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


def test_parts_of_another_session_or_size_are_ignored():
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
    assert again.seq == burst.seq + 3  # both ends continue from the larger number
    client.receive(end, 0.2)
    assert sent(client) == []


def test_a_part_that_answers_an_earlier_request_is_accepted():
    client, _ = reading(300)
    client.handle_timer(client.next_deadline())
    pieces = sent(client)
    client.handle_timer(client.next_deadline())
    assert {p.offset for p in sent(client)} == {p.offset for p in pieces} == {0, 239}
    for piece in pieces:
        client.receive(answer(piece, data=bytes(piece.size)), 4.0)
    assert outcome(client) == [FileReceived("f", bytes(300))]


def test_a_too_large_file_is_not_downloaded():
    client, _ = reading(0xFFFFFFFF)
    assert outcome(client) == [FileFailed("f", None, "4294967295 bytes are too many")]


def test_a_path_that_does_not_fit_raises():
    for path in ("x" * 240, "é", "a\0b"):
        with pytest.raises(LocalProtocolError):
            FtpClient(255, 190).read(VEHICLE, path, 0.0)


def test_cancelling_ends_all_requests():
    client = FtpClient(255, 190)
    client.read(VEHICLE, "a", 0.0)
    client.read(VEHICLE, "b", 0.0)
    client.cancel("closed")
    assert outcome(client) == [FileFailed("a", None, "closed"), FileFailed("b", None, "closed")]
    assert (client.is_busy, client.next_deadline()) == (False, math.inf)


def test_progress_counts_the_bytes_of_the_parts_that_have_come():
    client, _ = reading(500)
    for offset, size in ((239, 239), (478, 22), (0, 239)):
        client.receive(answer(FtpPacket(7, 1, READ, size, offset=offset), data=bytes(size)), 0.2)
    assert [(event.done, event.total) for event in client.events() if isinstance(event, FileProgress)] == [
        (239, 500), (478, 500), (500, 500),
    ]  # fmt: skip
