"""NatNet packets, written as Motive sends them and read as they come: bit-streams 3.0 to 4.1, little-endian.

Each packet is uint16 message, uint16 size of what follows, payload. Since 4.0 a description names its markers; since
4.1 every section is preceded by its size in bytes, a section of assets follows the skeletons, and the time of a network
clock the other times.
https://docs.optitrack.com/developer-tools/natnet-sdk

The library ``natnet`` reads as many elements as a packet claims and strings without an end; its own client ends with
the first damaged packet. Its parser is kept, on a buffer that never leaves the packet; what cannot be read is None.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable
from enum import IntEnum
from typing import Any, NamedTuple, Protocol, TypeVar

from natnet import DataDescriptions, DataFrame, NatNetError, ServerInfo, Version
from natnet.packet_buffer import PacketBuffer

from protocol.frames import Quaternion, Vector

BitStream = tuple[int, int]  # major and minor version
BIT_STREAMS: tuple[BitStream, ...] = ((3, 0), (3, 1), (4, 0), (4, 1))
SIZED: BitStream = (4, 1)  # the first whose sections tell their size
NAMED_MARKERS: BitStream = (4, 0)
APPLICATION_NAME = "Motive"
APPLICATION_VERSIONS = {3: (2, 1, 0, 0), 4: (3, 1, 0, 0)}  # of Motive, by the major version of its bit-stream
NAME_SIZE = 256
MARKER_DIAMETER = 0.014  # [m]
POINT_CLOUD_SOLVED, HAS_MODEL = 0x02, 0x08  # of a labelled marker's parameters
CLOCK = 10_000_000  # ticks of Motive's clock in a second
TRACKING_VALID = 0x01  # of a rigid body's
MARKER_SET, RIGID_BODY = 0, 1  # kinds of descriptions
NO_PARENT = -1
MAX_PACKET = 65535  # [bytes]
MAX_PLACE = 1e4  # [m]
MAX_NORM_ERROR = 0.1  # of a quaternion
_HEADER = struct.Struct("<HH")
_CLOCK_AND_DATA = struct.Struct("<QHB4s")
_FIXED_INFO = NAME_SIZE + 8  # bytes of name and versions

Place = tuple[float, float, float]
Read = TypeVar("Read")


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


class StreamedBody(Protocol):
    """A rigid body as it is described."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def number(self) -> int: ...  # noqa: D102
    @property
    def marker_names(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def streamed_markers(self) -> tuple[Place, ...]:
        """In the stream's axes, as the body was made [m]."""


class BodyPose(NamedTuple):
    """The rigid body in a frame to be sent, in Motive's axes."""

    position: Place
    attitude: Quaternion  # x, y, z, w
    marker_error: float  # mean distance of the markers from where the pose puts them [m]
    is_tracked: bool


class CaptureFrame(NamedTuple):
    """A frame to be sent; its times are ticks of :data:`CLOCK`."""

    number: int
    exposed: int  # in the middle of the exposure
    received: int  # by Motive from the cameras
    transmitted: int
    body: BodyPose
    markers: tuple[tuple[int, Place], ...]  # number from 1 on, and position, of those seen


class ServerReading(NamedTuple):
    """Description of the server."""

    name: str
    application: str  # its version
    version: BitStream  # of the bit-stream
    clock: int  # ticks of its clock in a second; 0: not told
    data_port: int  # 0: not told
    group: str  # multicast group; empty: each client is served


class BodyReading(NamedTuple):
    """A rigid body in a frame that was read, in Motive's axes."""

    number: int
    position: Vector  # [m]
    attitude: Quaternion  # (w, x, y, z)
    marker_error: float  # [m]
    is_tracked: bool


class FrameReading(NamedTuple):
    """A frame that was read; times on Motive's clock [s], None where it tells none."""

    number: int
    bodies: tuple[BodyReading, ...]
    exposed: float | None
    transmitted: float | None
    models_changed: bool


def packet(kind: Packet, payload: bytes = b"") -> bytes:
    """A packet with its header."""
    return _HEADER.pack(kind, len(payload)) + payload


def request(kind: Packet, text: str = "") -> bytes:
    """A packet of a client."""
    return packet(kind, text.encode() + b"\0")


def read_packet(data: bytes) -> tuple[int, bytes] | None:
    """Kind and payload; None if it is no packet. The size that it tells is not judged."""
    if len(data) < _HEADER.size:
        return None
    return _HEADER.unpack_from(data)[0], data[_HEADER.size :]


def packet_kind(data: bytes) -> int | None:
    """NatNet message id of a packet; None if it is too short to have one."""
    read = read_packet(data)
    return None if read is None else read[0]


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
        + _CLOCK_AND_DATA.pack(CLOCK, address.port, bool(address.group), group),
    )


def descriptions(body: StreamedBody, version: BitStream) -> bytes:
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


def frame_packet(frame: CaptureFrame, body: StreamedBody, version: BitStream) -> bytes:
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


class _CheckedBuffer(PacketBuffer):  # type: ignore[misc]
    """A buffer that fails at its end instead of reading on."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data)
        self.pointer: int = 0
        self._bytes = data

    def read_string(self, max_length: int | None = None, static_length: bool = False) -> str:
        """Text up to a zero byte."""
        end = len(self._bytes) if max_length is None else self.pointer + max_length
        stop = self._bytes.find(b"\0", self.pointer, end)
        if stop < 0:
            raise ValueError("text without an end")
        text = self._bytes[self.pointer : stop].decode("utf-8", "replace")
        self.pointer = end if static_length else stop + 1
        return text

    def read_float32_array(self, count: int) -> tuple[float, ...]:
        """So many numbers."""
        if count > (len(self._bytes) - self.pointer) // 4:
            raise ValueError("more numbers than bytes")
        return tuple(super().read_float32_array(count))


def read_server(data: bytes) -> ServerReading | None:
    """The answer to CONNECT."""
    info = _attempt(data, Packet.SERVER_INFO, lambda payload: ServerInfo.read_from_buffer(payload, None))
    if info is None:
        return None
    clock, port, is_multicast, group = 0, 0, 0, b""
    if len(data) >= _HEADER.size + _FIXED_INFO + _CLOCK_AND_DATA.size:
        clock, port, is_multicast, group = _CLOCK_AND_DATA.unpack_from(data, _HEADER.size + _FIXED_INFO)
    version = (info.nat_net_protocol_version.major, info.nat_net_protocol_version.minor)
    application = str(info.server_version.truncate(2))
    name = "".join(c for c in info.application_name if c.isprintable())[:64]
    return ServerReading(name, application, version, clock, port, ".".join(map(str, group)) if is_multicast else "")


def is_readable(version: BitStream) -> bool:
    """Whether frames of a bit-stream can be read: later minor versions, too."""
    return version >= BIT_STREAMS[0] and version[0] <= BIT_STREAMS[-1][0]


def read_body_names(data: bytes, version: BitStream) -> dict[str, int] | None:
    """Numbers of the rigid bodies that are described, by name."""
    bit_stream = Version(*version)
    read = _attempt(data, Packet.DESCRIPTIONS, lambda payload: DataDescriptions.read_from_buffer(payload, bit_stream))
    return None if read is None else {str(body.name): _signed(body.id_num) for body in read.rigid_bodies}


def read_frame(data: bytes, version: BitStream, clock: int) -> FrameReading | None:
    """A frame.

    Args:
        data: The packet.
        version: Of the bit-stream.
        clock: Ticks of the server's clock in a second; 0: unknown.
    """
    frame = _attempt(data, Packet.FRAME, lambda payload: DataFrame.read_from_buffer(payload, Version(*version)))
    if frame is None:
        return None
    bodies = tuple(body for body in map(_body, frame.rigid_bodies) if body is not None)
    suffix = frame.suffix
    exposed = transmitted = None
    if clock and suffix.stamp_camera_mid_exposure and suffix.stamp_transmit >= suffix.stamp_camera_mid_exposure:
        exposed, transmitted = suffix.stamp_camera_mid_exposure / clock, suffix.stamp_transmit / clock
    return FrameReading(frame.prefix.frame_number, bodies, exposed, transmitted, suffix.tracked_models_changed)


def _body(body: Any) -> BodyReading | None:  # noqa: ANN401 - of a library without types
    """A rigid body; None if it is not of numbers."""
    x, y, z, w = body.rot
    numbers = (*body.pos, x, y, z, w, body.marker_error)
    if not all(map(math.isfinite, numbers)) or max(map(abs, body.pos)) > MAX_PLACE:
        return None
    norm = math.hypot(x, y, z, w)
    if abs(norm - 1.0) > MAX_NORM_ERROR:
        if body.tracking_valid:
            return None
        x, y, z, w, norm = 0.0, 0.0, 0.0, 1.0, 1.0  # of a body that was never seen
    attitude = (w / norm, x / norm, y / norm, z / norm)
    return BodyReading(_signed(body.id_num), tuple(body.pos), attitude, abs(body.marker_error), body.tracking_valid)


def _signed(number: int) -> int:
    """A number that the library reads without a sign."""
    return number - 2**32 if number >= 2**31 else number


def _attempt(data: bytes, kind: Packet, parse: Callable[[_CheckedBuffer], Read]) -> Read | None:
    """The payload of a packet of this kind; None if it is another or cannot be read."""
    read = read_packet(data)
    if read is None or read[0] != kind:
        return None
    try:
        return parse(_CheckedBuffer(read[1]))
    except (struct.error, ValueError, IndexError, OverflowError, AssertionError, NatNetError):
        return None
