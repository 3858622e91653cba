"""Boundaries of MAVLink frames by their length alone (https://mavlink.io/en/guide/serialization.html)."""

import pytest

from protocol.dialect import mavlink
from protocol.wire.framing import EVERYONE, frame_length, message_id, split_frames, target_systems
from tests.support.logs import bare, unknown_frame

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


COMMAND = mavlink.MAVLink_command_long_message(7, 1, 400, 0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize(
    ("message", "target"),
    [
        (COMMAND, 7),
        (mavlink.MAVLink_param_request_read_message(9, 1, b"MPC_XY_CRUISE", -1), 9),  # an array before it
        (mavlink.MAVLink_manual_control_message(5, 0, 0, 500, 0, 0), 5),  # its field is named target
        (mavlink.MAVLink_command_long_message(0, 0, 0, 0, *[0.0] * 7), EVERYONE),  # left out with the zeros at its end
        (HEARTBEAT, EVERYONE),
    ],
)
def test_a_frame_names_its_target(message, target, version):
    assert target_systems(bare(message, version=version)) == {target}


def test_every_message_with_a_target_is_read_as_the_decoder_reads_it():
    for kind in mavlink.mavlink_map.values():
        if "target_system" in kind.ordered_fieldnames and not any(kind.array_lengths):
            message = kind(**{name: 42 if name == "target_system" else 0 for name in kind.fieldnames})
            assert target_systems(bare(message)) == {42}, kind.msgname


def test_a_datagram_of_several_frames_names_all_their_targets():
    assert target_systems(bare(COMMAND) + bare(HEARTBEAT)) == {7, EVERYONE}


def test_what_is_unknown_is_for_everyone_and_garbage_for_nobody():
    assert target_systems(unknown_frame(12345, b"abcdef")) == {EVERYONE}
    assert target_systems(b"") == target_systems(b"nonsense") == frozenset()
