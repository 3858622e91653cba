"""NatNet packets as Motive sends them: bit-streams 3.0 to 4.1, little-endian.

Each packet is uint16 message, uint16 size of what follows, payload. Since 4.0 a description names its markers; since
4.1 every section is preceded by its size in bytes, a section of assets follows the skeletons, and the time of a network
clock the other times.
https://docs.optitrack.com/developer-tools/natnet-sdk
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple

from sitl.motion_capture.capture_frame import CLOCK, CaptureFrame
from sitl.motion_capture.rigid_body import RigidBody

BitStream = tuple[int, int]  # major and minor version
BIT_STREAMS: tuple[BitStream, ...] = ((3, 0), (3, 1), (4, 0), (4, 1))
SIZED: BitStream = (4, 1)  # the first whose sections tell their size
NAMED_MARKERS: BitStream = (4, 0)
APPLICATION_NAME = "Motive"
APPLICATION_VERSIONS = {3: (2, 1, 0, 0), 4: (3, 1, 0, 0)}  # of Motive, by the major version of its bit-stream
NAME_SIZE = 256
MARKER_DIAMETER = 0.014  # [m]
POINT_CLOUD_SOLVED, HAS_MODEL = 0x02, 0x08  # of a labelled marker's parameters
TRACKING_VALID = 0x01  # of a rigid body's
MARKER_SET, RIGID_BODY = 0, 1  # kinds of descriptions
NO_PARENT = -1


class Packet(IntEnum):
    """Message identifier of a packet."""

    CONNECT = 0
    SERVER_INFO = 1
    REQUEST = 2
    RESPONSE = 3
    REQUEST_DESCRIPTIONS = 4
    DESCRIPTIONS = 5
    REQUEST_FRAME = 6
    FRAME = 7
    MESSAGE = 8
    DISCONNECT = 9
    KEEP_ALIVE = 10
    TIMED_OUT = 11
    UNRECOGNIZED = 100


class Address(NamedTuple):
    """Destination of the frames: a multicast group, or each client."""

    port: int  # of the data
    group: str = ""  # empty: to each client


def packet(kind: Packet, payload: bytes = b"") -> bytes:
    """A packet with its header."""
    return struct.pack("<HH", kind, len(payload)) + payload


def read_packet(data: bytes) -> tuple[int, bytes] | None:
    """Kind and payload of what a client sends; None if it is no packet. The size that it tells is not judged."""
    if len(data) < 4:
        return None
    return struct.unpack_from("<H", data)[0], data[4:]


def read_request(payload: bytes) -> str:
    """The words of a REQUEST."""
    return payload.split(b"\0", 1)[0].decode("utf-8", "replace")


def server_info(version: BitStream, address: Address) -> bytes:
    """The answer to CONNECT: who serves, in which bit-stream, and where the frames go."""
    group = bytes(map(int, address.group.split("."))) if address.group else bytes(4)
    return packet(
        Packet.SERVER_INFO,
        APPLICATION_NAME.encode().ljust(NAME_SIZE, b"\0")
        + bytes((*APPLICATION_VERSIONS[version[0]], *version, 0, 0))
        + struct.pack("<QHB4s", CLOCK, address.port, bool(address.group), group),
    )


def descriptions(body: RigidBody, version: BitStream) -> bytes:
    """Description of the streamed data: the marker set and the rigid body."""
    names = b"".join(map(_text, body.marker_names))
    count = len(body.marker_names)
    marker_set = _text(body.name) + struct.pack("<i", count) + names
    rigid_body = _text(body.name) + struct.pack("<ii3fi", body.number, NO_PARENT, 0.0, 0.0, 0.0, count)
    rigid_body += b"".join(struct.pack("<3f", *place) for place in body.streamed_markers)
    rigid_body += struct.pack(f"<{count}i", *range(1, count + 1))
    rigid_body += names if version >= NAMED_MARKERS else b""
    parts = ((MARKER_SET, marker_set), (RIGID_BODY, rigid_body))
    sections = (struct.pack("<i", kind) + _sized(part, version) for kind, part in parts)
    return packet(Packet.DESCRIPTIONS, struct.pack("<i", len(parts)) + b"".join(sections))


def frame_packet(frame: CaptureFrame, body: RigidBody, version: BitStream) -> bytes:
    """A frame of data."""
    marker_set = _text(body.name) + struct.pack("<i", len(frame.markers))
    marker_set += b"".join(struct.pack("<3f", *place) for _, place in frame.markers)
    pose = frame.body
    rigid_body = struct.pack("<i3f4f", body.number, *pose.position, *pose.attitude)
    rigid_body += struct.pack("<fh", pose.marker_error, TRACKING_VALID if pose.is_tracked else 0)
    labelled = [
        struct.pack("<i3ffhf", body.number << 16 | number, *place, MARKER_DIAMETER, POINT_CLOUD_SOLVED | HAS_MODEL, 0.0)
        for number, place in frame.markers
    ]
    sections = [_section([marker_set], version), _section([], version)]  # marker sets, unlabelled markers
    sections += [_section([rigid_body], version), _section([], version)]  # rigid bodies, skeletons
    sections += [_section([], version)] if version >= SIZED else []  # assets
    sections += [_section(labelled, version), _section([], version), _section([], version)]  # force plates, devices
    suffix = struct.pack("<IId", 0, 0, frame.exposed / CLOCK)
    suffix += struct.pack("<QQQ", frame.exposed, frame.received, frame.transmitted)
    suffix += (
        struct.pack("<II", 0, 0) if version >= SIZED else b""
    )  # the time of a network clock, of which there is none
    suffix += struct.pack("<hi", 0, 0)  # parameters, end tag
    return packet(Packet.FRAME, struct.pack("<i", frame.number) + b"".join(sections) + suffix)


def response(value: float) -> bytes:
    """The answer to a REQUEST: a number, or the code of its success (an integer)."""
    return packet(Packet.RESPONSE, struct.pack("<i" if isinstance(value, int) else "<f", value))


def _text(text: str) -> bytes:
    return text.encode() + b"\0"


def _sized(section: bytes, version: BitStream) -> bytes:
    return struct.pack("<i", len(section)) + section if version >= SIZED else section


def _section(parts: Iterable[bytes], version: BitStream) -> bytes:
    parts = list(parts)
    return struct.pack("<i", len(parts)) + _sized(b"".join(parts), version)
