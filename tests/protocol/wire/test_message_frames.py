"""Frames of every message of the dialect, beside those that pymavlink makes and reads."""

import inspect
import math
import random
import struct
from itertools import islice, pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.generator.mavcrc import x25crc

from protocol.dialect import mavlink
from protocol.dialect.dialect_message import DialectMessage
from protocol.errors import LocalProtocolError
from protocol.wire.codec import Codec
from protocol.wire.message_frames import checksum, make_frame, read_frame
from protocol.wire.signing import Keyring
from tests.support.pymavlink_dialect import pymavlink_dialect

KEY = bytes(range(32))
T = 10**13  # [10 us since 2015]
LARGEST = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
EDGES = (0.0, -0.0, 1.0, math.nan, math.inf, -math.inf, 1e-45, -1e-40, LARGEST, -LARGEST)
BITS = {f"{sign}int{bits}_t": (bits, not sign) for bits in (8, 16, 32, 64) for sign in ("", "u")}
NUMBERS = sorted(mavlink.mavlink_map)


def number(kind, draw):
    """A number that a type of the wire holds: mostly at its limits."""
    if kind in {"float", "double"}:
        return draw.choice((*EDGES, draw.uniform(-1e3, 1e3)))
    bits, signed = BITS[kind.removesuffix("_mavlink_version")]
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    return draw.choice((low, high, 0, 1, draw.randint(low, high)))


def values(kind, draw):
    """Arguments of a message; often zero from some field on, as payloads are trimmed there."""
    found, zero_from = [], draw.randint(0, 2 * len(kind.fieldnames))
    for at, (name, field_type) in enumerate(zip(kind.fieldnames, kind.fieldtypes, strict=True)):
        count = kind.array_lengths[kind.ordered_fieldnames.index(name)]
        if field_type == "char":
            text = draw.randbytes(draw.randint(0, count))
            found.append(b"" if at >= zero_from else text.replace(b"\xff", b"\0"))
        elif at >= zero_from:
            found.append([0] * count if count else 0)
        else:
            found.append([number(field_type, draw) for _ in range(count)] if count else number(field_type, draw))
    return found


def pairs(seed):
    """Each message of the dialect with some values, and pymavlink's of the same."""
    draw, peer = random.Random(seed), pymavlink_dialect()
    for kind in mavlink.mavlink_map.values():
        given = values(kind, draw)
        yield kind(*given), peer.mavlink_map[kind.id](*given)


def seen(message):
    """All that can be read of a message, as text: NaN is like NaN there, -0.0 not like 0.0."""
    fields = {name: getattr(message, name) for name in message.get_fieldnames()}
    texts = {name: getattr(message, f"_{name}_raw", None) for name in fields}
    source = message.get_srcSystem(), message.get_srcComponent(), message.get_seq()
    return repr((message.get_type(), message.get_msgId(), source, fields, texts, bytes(message.get_msgbuf())))


@pytest.mark.parametrize("seed", range(4))
def test_every_message_becomes_the_frame_that_pymavlink_makes(seed):
    mav = pymavlink_dialect().MAVLink(None, srcSystem=7, srcComponent=9)
    mav.seq = 200 + seed
    wrong = [ours.get_type() for ours, peer in pairs(seed) if make_frame(ours, 7, 9, 200 + seed) != peer.pack(mav)]
    assert wrong == []


def test_signed_frames_are_those_of_pymavlink():
    keyring, mav = Keyring({None: KEY}, timestamp=T), pymavlink_dialect().MAVLink(None, srcSystem=7, srcComponent=9)
    codec = Codec(7, 9, keyring.link(None))
    mav.signing.secret_key, mav.signing.sign_outgoing, mav.signing.timestamp = KEY, True, T + 1
    for ours, peer in pairs(5):
        assert codec.encode(ours) == peer.pack(mav), ours.get_type()
        mav.seq = (mav.seq + 1) & 0xFF


def framed(kind, payload, draw, *, version=2, signed=False):
    """A frame with a payload of any length, as a sender that does not trim or knows more fields makes it."""
    head = bytes([0xFE, len(payload), draw.randrange(256), 3, 4, kind.id & 0xFF])
    if version == 2:
        head = bytes([0xFD, len(payload), signed, 0, draw.randrange(256), 3, 4]) + kind.id.to_bytes(3, "little")
    crc = x25crc(head[1:] + payload + bytes([kind.crc_extra])).crc
    return head + payload + crc.to_bytes(2, "little") + bytes(13 * signed)


@pytest.mark.parametrize(("version", "signed"), [(1, False), (2, False), (2, True)])
def test_every_payload_is_read_as_pymavlink_reads_it(version, signed):
    draw, mav = random.Random(version), pymavlink_dialect().MAVLink(None)
    for kind in mavlink.mavlink_map.values():
        size = kind.unpacker.size
        for length in {0, 1, draw.randint(0, size), max(size - 1, 0), size, min(size + 3, 255)}:
            payload = draw.randbytes(length)[: draw.randint(0, length)].ljust(length, b"\0")
            if version == 2 or kind.id < 256:
                frame = framed(kind, payload, draw, version=version, signed=signed)
                (message,) = Codec(255, 190).decode(frame)
                assert seen(message) == seen(mav.decode(bytearray(frame)))
                assert seen(read_frame(kind, frame)) == seen(message)


@settings(max_examples=150, deadline=None)
@given(number=st.sampled_from(NUMBERS), seed=st.integers(0, 99), place=st.integers(0, 400), bits=st.integers(1, 255))
def test_a_damaged_frame_is_refused_as_pymavlink_refuses_it(number, seed, place, bits):
    peer, kind, draw = pymavlink_dialect(), mavlink.mavlink_map[number], random.Random(seed)
    frame = bytearray(make_frame(kind(*values(kind, draw)), 7, 9, 1))
    frame[10 + place % (len(frame) - 10)] ^= bits
    with pytest.raises(peer.MAVError, match="invalid MAVLink CRC"):
        peer.MAVLink(None).decode(bytearray(frame))
    assert read_frame(kind, bytes(frame)) is None
    assert Codec(255, 190).decode(bytes(frame)) == []


@settings(max_examples=100, deadline=None)
@given(data=st.binary(max_size=300), extra=st.integers(0, 255))
def test_the_checksum_is_that_of_pymavlink(data, extra):
    assert checksum(data, extra) == x25crc(data + bytes([extra])).crc


DRAW = random.Random(6)
MADE = [
    make_frame(kind(*values(kind, DRAW)), 1 + k % 3, 1, k // 3)
    for k, kind in enumerate(islice(mavlink.mavlink_map.values(), 61))
]


@settings(max_examples=60, deadline=None)
@given(
    order=st.lists(st.integers(0, 60), max_size=80),
    damaged=st.sets(st.integers(0, 79), max_size=3),  # a datagram with many is not read to its end
    cuts=st.sets(st.integers(0, 80)),
)
def test_frames_one_by_one_count_as_frames_in_one_datagram(order, damaged, cuts):
    frames = [MADE[k][:-1] + bytes([MADE[k][-1] ^ (at in damaged)]) for at, k in enumerate(order)]
    single, together = Codec(255, 190), Codec(255, 190)
    one_by_one = [seen(message) for frame in frames for message in single.decode(frame)]
    bounds = [0, *sorted(cut for cut in cuts if cut < len(frames)), len(frames)]
    pieces = [b"".join(frames[a:b]) for a, b in pairwise(bounds)]
    assert [seen(message) for piece in pieces for message in together.decode(piece)] == one_by_one
    assert single.statistics.sources == together.statistics.sources
    assert single.statistics.received == together.statistics.received == len(one_by_one)


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_heartbeat_message(256, 0, 0, 0, 0, 3),
        mavlink.MAVLink_attitude_message(0, 1e39, 0, 0, 0, 0, 0),
        mavlink.MAVLink_attitude_message(0, "1", 0, 0, 0, 0, 0),
        mavlink.MAVLink_darko_energy_message(0, 0.0, 0.0, [1.0]),
        mavlink.MAVLink_control_status_message(0, 1, []),
    ],
    ids=["an integer too large", "a number too large", "a text for a number", "a short array", "an empty array"],
)
def test_what_does_not_fit_the_wire_is_refused(message):
    for refuse in (Codec(1, 1).encode, Codec(1, 1).check):
        with pytest.raises(LocalProtocolError, match=f"{message.get_type()} cannot be encoded"):
            refuse(message)


def test_classes_take_what_those_of_pymavlink_take():
    for number, peer in pymavlink_dialect().mavlink_map.items():
        ours = mavlink.mavlink_map[number]
        theirs = [(p.name, p.default) for p in inspect.signature(peer).parameters.values()]
        assert [(p.name, p.default) for p in inspect.signature(ours).parameters.values()] == theirs
        assert ours.__name__ == peer.__name__
    assert len(mavlink.mavlink_map) == len(pymavlink_dialect().mavlink_map)


def test_no_field_hides_a_method():
    """``id`` is both: what a class says of it is read from the class."""
    names = {name for name in dir(DialectMessage) if not name.startswith("__")} | {"unpacker", "WIRE"}
    hidden = {field for kind in mavlink.mavlink_map.values() for field in kind.fieldnames if field in names}
    assert hidden == set()
    assert mavlink.MAVLink_statustext_message(6, b"", id=99).get_msgId() == mavlink.MAVLINK_MSG_ID_STATUSTEXT


def test_a_message_made_here_has_no_frame_and_no_sender():
    made = mavlink.MAVLink_heartbeat_message(1, 2, 3, 4, 5, 3)
    assert (made.get_msgbuf(), made.get_srcSystem(), made.get_srcComponent(), made.get_seq()) == (b"", 0, 0, 0)
    assert (
        made
        == mavlink.MAVLink_heartbeat_message(1, 2, 3, 4, 5, 3)
        != mavlink.MAVLink_heartbeat_message(1, 2, 3, 4, 6, 3)
    )
    assert made != pymavlink_dialect().MAVLink_heartbeat_message(1, 2, 3, 4, 5, 3)
    assert str(made).startswith("HEARTBEAT {type : 1, ")
