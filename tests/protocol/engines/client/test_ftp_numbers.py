"""The sequence numbers of the FTP client's requests: one more each time, and never behind what has come."""

from protocol.engines.client.ftp_client import FtpClient
from protocol.engines.file_transfer import MAX_DATA, FtpPacket

ACK, BURST, READ = 128, 15, 5


def sent(client):
    return [FtpPacket.of(message) for message in client.messages_to_send()]


def answer(request, **changes):
    made = request._replace(seq=request.seq + 1 & 0xFFFF, opcode=ACK, req_opcode=request.opcode, **changes)
    return made._replace(size=len(made.data)).to_message(255, 190)


def part(burst, number, seq, *, last=0):
    """One part of a burst, full."""
    data = bytes([number]) * MAX_DATA
    made = burst._replace(seq=seq, opcode=ACK, req_opcode=BURST, size=MAX_DATA, offset=number * MAX_DATA, data=data)
    return made._replace(burst_complete=last).to_message(255, 190)


def reading(parts):
    """A client that has opened a file of so many parts: what it sent to open it, and its first requests."""
    client = FtpClient(255, 190)
    client.read((1, 1), "f", 0.0)
    (opening,) = sent(client)
    client.receive(answer(opening, data=(parts * MAX_DATA).to_bytes(4, "little")), 0.1)
    return client, opening, sent(client)


def test_every_request_is_one_more_than_the_last():
    client, opening, requests = reading(5)
    assert [(packet.opcode, packet.seq) for packet in requests] == [
        (READ, opening.seq + number) for number in range(1, 6)
    ]
    assert [packet.offset for packet in requests] == [number * MAX_DATA for number in range(5)]
    client.handle_timer(client.next_deadline())
    assert [packet.seq for packet in sent(client)] == [opening.seq + number for number in range(6, 11)]


def test_eight_parts_are_read_one_by_one_and_nine_in_a_burst():
    assert [packet.opcode for packet in reading(8)[2]] == [READ] * 8
    assert [packet.opcode for packet in reading(9)[2]] == [BURST]


def test_after_a_burst_the_next_request_follows_its_greatest_number_in_whatever_order_its_parts_came():
    client, _, (burst,) = reading(20)
    client.receive(part(burst, 1, burst.seq + 2), 0.1)
    client.receive(part(burst, 0, burst.seq + 1), 0.1)
    client.receive(part(burst, 3, burst.seq + 3, last=1), 0.2)  # part 2 is missing, and most of the file
    (again,) = sent(client)
    assert (again.opcode, again.seq, again.offset) == (BURST, burst.seq + 4, 2 * MAX_DATA)
    client.receive(part(again, 2, again.seq + 5), 0.3)
    client.receive(part(again, 4, again.seq + 1), 0.3)
    client.receive(part(burst, 5, burst.seq + 1), 0.3)  # late, of the first burst
    client.handle_timer(client.next_deadline())
    assert sent(client)[0].seq == again.seq + 6


def test_every_file_has_the_next_session_number_and_its_requests_carry_no_size_of_their_own():
    client, sessions = FtpClient(255, 190), []
    for _ in range(258):
        client.read((1, 1), "f", 0.0)
        (opening,) = sent(client)
        client.receive(answer(opening, data=bytes(4)), 0.1)  # an empty file
        (closing,) = sent(client)
        assert (opening.size, opening.data.rstrip(b"\0"), closing.size) == (1, b"f", 0)
        client.receive(answer(closing), 0.2)
        sessions.append((opening.session, closing.session))
    assert sessions == [(number & 0xFF,) * 2 for number in range(1, 259)]


def test_an_end_half_the_range_of_numbers_after_its_request_is_of_an_earlier_burst():
    for distance, requests in ((0x7FFF, 1), (0x8000, 0)):
        client, _, (burst,) = reading(20)
        client.receive(part(burst, 3, burst.seq + distance & 0xFFFF, last=1), 0.1)
        assert len(sent(client)) == requests
