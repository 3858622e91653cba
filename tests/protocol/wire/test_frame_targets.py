"""Whom a datagram is for, read from its bytes, is what the decoder says."""

import pytest

from protocol.dialect import mavlink
from protocol.wire.framing import EVERYONE, target_systems
from tests.support.logs import bare, unknown_frame

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
