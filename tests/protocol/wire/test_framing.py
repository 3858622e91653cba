"""Boundaries of frames: by version, payload and signature, and only for complete frames."""

import pytest

from protocol.wire.framing import frame_length, message_id, split_frames

V1 = bytes([0xFE, 3, 0, 1, 1, 77, *b"abc", 0, 0])
V1_EMPTY = bytes([0xFE, 0, 0, 1, 1, 77, 0, 0])
V2 = bytes([0xFD, 3, 0, 0, 0, 1, 1, 77, 1, 2, *b"abc", 0, 0])
V2_EMPTY = bytes([0xFD, 0, 0, 0, 0, 1, 1, 77, 1, 2, 0, 0])
SIGNED = bytes([0xFD, 3, 1, 0, 0, 1, 1, 77, 1, 2, *b"abc", 0, 0, *bytes(13)])
FRAMES = {"1": V1, "1, empty": V1_EMPTY, "2": V2, "2, empty": V2_EMPTY, "2, signed": SIGNED}


@pytest.mark.parametrize("frame", FRAMES.values(), ids=FRAMES)
def test_a_frame_has_its_length_only_when_it_is_whole(frame):
    assert frame_length(frame) == len(frame)
    assert frame_length(b"ab" + frame + b"cd", 2) == len(frame)
    assert [frame_length(frame[:end]) for end in range(len(frame))] == [0] * len(frame)


def test_other_bytes_begin_no_frame():
    assert frame_length(bytes(20)) == 0
    assert frame_length(b"\xfc" + V2[1:]) == 0
    assert frame_length(V2, 1) == 0


def test_other_flags_add_no_signature():
    assert frame_length(V2[:2] + b"\x02" + V2[3:]) == len(V2)


def test_the_message_id_has_one_byte_in_version_1_and_three_in_version_2():
    assert message_id(V1) == message_id(b"ab" + V1, 2) == 77
    assert message_id(V2) == message_id(b"ab" + V2, 2) == 77 + (1 << 8) + (2 << 16)


def test_a_datagram_is_split_until_something_else_follows():
    assert split_frames(V1 + SIGNED + V2 + b"junk" + V2) == [V1, SIGNED, V2]
    assert split_frames(V1 + V2[:-1]) == [V1]
    assert split_frames(b"") == []
