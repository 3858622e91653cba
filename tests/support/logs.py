"""Frames and logs for tests."""

import os
import struct
from pathlib import Path

import pytest

from protocol.dialect import mavlink
from protocol.wire.message_frames import checksum, make_frame

T0 = 1_760_000_000_000_000  # [us] a plausible time of a log


def bare(message, *, version=2, system=1, component=1, sequence=0):
    """Raw frame of one message; version 1 has its extensions, too, as pymavlink sends them."""
    if version == 2:
        return make_frame(message, system, component, sequence)
    payload = message.pack_fields()
    head = bytes([0xFE, len(payload), sequence, system, component, message.get_msgId()])
    return head + payload + checksum(head[1:] + payload, message.crc_extra).to_bytes(2, "little")


def unknown_frame(number, payload):
    """Well-formed version 2 frame of a message outside the dialect; its checksum is arbitrary."""
    return (
        struct.pack("<BBBBBBBHB", 0xFD, len(payload), 0, 0, 0, 1, 1, number & 0xFFFF, number >> 16)
        + payload
        + b"\xaa\x55"
    )


def record(time_usec, frame):
    """One record of a log."""
    return struct.pack(">Q", time_usec) + frame


def log_of(frames, *, start=T0, step=10_000):
    """Log with one frame every ``step`` microseconds."""
    return b"".join(record(start + step * k, frame) for k, frame in enumerate(frames))


def flight(count):
    """Frames of several types and lengths: trimmed, full, with text and arrays."""
    frames = []
    for k in range(count):
        message = (
            mavlink.MAVLink_attitude_message(100 * k, 0.1 * k, -0.2, 0.3, 0.0, 0.0, 0.0),
            mavlink.MAVLink_heartbeat_message(19, 12, 129, 0x30000 + k, 4, 3),
            mavlink.MAVLink_statustext_message(6, f"text {k}".encode()),
            mavlink.MAVLink_actuator_output_status_message(k, 4, [0.5 * i for i in range(32)]),
            mavlink.MAVLink_named_value_float_message(100 * k, b"v_hover", 1.5 * k),
        )[k % 5]
        frames.append(bare(message, sequence=k & 0xFF))
    return frames


def quadplane_path():
    """Another autopilot's log: ``DARKO_TLOG``, or a file beside the repository; skips the test without one."""
    beside = Path(__file__).parents[3] / "shared" / "data" / "quadplane-vtol.tlog"
    path = Path(os.environ.get("DARKO_TLOG", beside))
    if not path.is_file():
        pytest.skip(f"no log at {path}")
    return path


def quadplane_log():
    """Its bytes."""
    return quadplane_path().read_bytes()
