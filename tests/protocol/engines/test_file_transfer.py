"""Files on the wire: the payload and checksum of MAVLink FTP, and the stores that file and log servers read."""

from hypothesis import given
from hypothesis import strategies as st

from protocol.engines.file_transfer import MAX_DATA, FtpPacket, crc32
from tests.support.links.ftp_tree import BIG


@given(
    st.builds(
        FtpPacket,
        st.integers(0, 65535),
        *[st.integers(0, 255)] * 3,
        req_opcode=st.integers(0, 255),
        burst_complete=st.integers(0, 1),
        offset=st.integers(0, 2**32 - 1),
        data=st.binary(min_size=MAX_DATA, max_size=MAX_DATA),
    )
)
def test_a_packet_survives_the_wire(packet):
    assert FtpPacket.of(packet.to_message(1, 1)) == packet


def test_the_checksum_is_the_one_that_clients_compute():
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
