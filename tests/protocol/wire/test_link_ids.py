"""Link ids: each link of a keyring signs with its own."""

from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from protocol.wire.signing import Keyring, signature_of

HEARTBEAT = mavlink.MAVLink_heartbeat_message(19, 12, 81, 0, 4, 3)


def test_links_are_numbered_from_zero_and_share_a_byte():
    keyring = Keyring({None: bytes(range(32))}, timestamp=36_000_000_000_000)
    codecs = [Codec(1, 1, keyring.link(name)) for name in range(258)]
    assert [signature_of(codec.encode(HEARTBEAT)).link for codec in codecs] == [*range(256), 0, 1]
