"""Checksums that the FTP server works on at the same time."""

import pytest

from protocol.dialect import mavlink
from protocol.engines.file_transfer import BytesFile, FtpPacket, crc32
from protocol.engines.server.ftp_server import FtpServer
from protocol.wire.message import Peer
from tests.support.links.ftp_tree import BIG, Tree

GROUND, OTHER = Peer(255, 190, "ground"), Peer(245, 190, "other")
CRC, ACK = mavlink.MAV_FTP_OPCODE_CALCFILECRC, mavlink.MAV_FTP_OPCODE_ACK


def ask(server, path, peer, seq=1):
    server.receive(FtpPacket(seq, 0, CRC, len(path), data=path.encode()).to_message(1, 1), 0.0, peer)


def checksums(server):
    """Checksums sent, each with its peer, in this order."""
    found = []
    for _ in range(100):
        server.handle_timer(server.next_deadline())
        for out in server.messages_to_send():
            packet = FtpPacket.of(out.message)
            assert (packet.opcode, packet.req_opcode) == (ACK, CRC)
            found.append((out.peer, int.from_bytes(packet.content, "little")))
    return found


def test_one_client_gets_the_checksums_of_two_files():
    server = FtpServer(1, 1, Tree())
    ask(server, "a.txt", GROUND)
    ask(server, "big.bin", GROUND, seq=2)
    assert checksums(server) == [(GROUND, crc32(b"hello")), (GROUND, crc32(BIG))]


def test_two_clients_get_the_checksum_of_the_same_file_by_the_same_request():
    server = FtpServer(1, 1, Tree())
    ask(server, "big.bin", GROUND)
    ask(server, "big.bin", OTHER)
    assert checksums(server) == [(GROUND, crc32(BIG)), (OTHER, crc32(BIG))]


def test_a_repeated_request_is_answered_once():
    server = FtpServer(1, 1, Tree())
    for _ in range(3):
        ask(server, "big.bin", GROUND)
    assert checksums(server) == [(GROUND, crc32(BIG))]


class Grown(BytesFile):
    """A file that has become longer since it was opened."""

    size = 300

    def __init__(self):
        super().__init__(BIG)


def test_a_file_that_grows_is_summed_as_it_was_when_it_was_opened():
    tree = Tree()
    tree.open = lambda _path: Grown()
    server = FtpServer(1, 1, tree)
    ask(server, "a.txt", GROUND)
    assert checksums(server) == [(GROUND, crc32(BIG[:300]))]


@pytest.mark.parametrize(("error", "number"), [(OSError(13, "denied"), 13), (OSError("who knows"), 0)])
def test_an_error_of_the_disk_is_answered_with_its_number(error, number):
    def fail(_path):
        raise error

    tree = Tree()
    tree.open = fail
    server = FtpServer(1, 1, tree)
    ask(server, "a.txt", GROUND)
    (out,) = server.messages_to_send()
    packet = FtpPacket.of(out.message)
    assert (packet.opcode, packet.content) == (
        mavlink.MAV_FTP_OPCODE_NAK,
        bytes([mavlink.MAV_FTP_ERR_FAILERRNO, number]),
    )
