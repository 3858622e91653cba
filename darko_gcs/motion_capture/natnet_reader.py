"""Reads NatNet packets with the library ``natnet``, whatever is in them.

The library reads as many elements as a packet claims and strings without an end; its own client ends with the first
damaged packet. Its parser is kept, on a buffer that never leaves the packet; what cannot be read is None.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from natnet import DataDescriptions, DataFrame, NatNetError, ServerInfo, Version
from natnet.packet_buffer import PacketBuffer

from protocol.frames import Quaternion, Vector

__all__ = [
    "CONNECT",
    "DISCONNECT",
    "FRAME",
    "KEEP_ALIVE",
    "MAX_PACKET",
    "REQUEST_DESCRIPTIONS",
    "SERVER_INFO",
    "BodyReading",
    "FrameReading",
    "ServerReading",
    "is_readable",
    "packet_kind",
    "read_body_names",
    "read_frame",
    "read_server",
    "request",
]

CONNECT, SERVER_INFO, REQUEST_DESCRIPTIONS, DESCRIPTIONS, FRAME, DISCONNECT, KEEP_ALIVE = 0, 1, 4, 5, 7, 9, 10
MAX_PACKET = 65535  # [bytes]
MAX_PLACE = 1e4  # [m]
MAX_NORM_ERROR = 0.1  # of a quaternion
OLDEST, NEWEST_MAJOR = Version(3, 0), 4  # bit-streams that are read
_HEADER = struct.Struct("<HH")
_CLOCK_AND_DATA = struct.Struct("<QHB4s")
_FIXED_INFO = 264  # bytes of name and versions

Read = TypeVar("Read")


class ServerReading(NamedTuple):
    """Description of the server."""

    name: str
    application: str  # its version
    version: Version  # of the bit-stream
    clock: int  # ticks of its clock in a second; 0: not told
    data_port: int  # 0: not told
    group: str  # multicast group; empty: each client is served


class BodyReading(NamedTuple):
    """A rigid body in a frame, in Motive's axes."""

    number: int
    position: Vector  # [m]
    attitude: Quaternion  # (w, x, y, z)
    marker_error: float  # [m]
    is_tracked: bool


class FrameReading(NamedTuple):
    """A frame; times on Motive's clock [s], None where it tells none."""

    number: int
    bodies: tuple[BodyReading, ...]
    exposed: float | None
    transmitted: float | None
    models_changed: bool


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


def request(kind: int, text: str = "") -> bytes:
    """A packet of a client."""
    payload = text.encode() + b"\0"
    return _HEADER.pack(kind, len(payload)) + payload


def packet_kind(data: bytes) -> int | None:
    """NatNet message id of a packet; None if it is too short to have one."""
    return int(_HEADER.unpack_from(data)[0]) if len(data) >= _HEADER.size else None


def read_server(data: bytes) -> ServerReading | None:
    """The answer to CONNECT."""
    info = _attempt(lambda: ServerInfo.read_from_buffer(_payload(data), None))
    if info is None:
        return None
    clock, port, is_multicast, group = 0, 0, 0, b""
    if len(data) >= _HEADER.size + _FIXED_INFO + _CLOCK_AND_DATA.size:
        clock, port, is_multicast, group = _CLOCK_AND_DATA.unpack_from(data, _HEADER.size + _FIXED_INFO)
    version = info.nat_net_protocol_version.truncate(2)
    application = str(info.server_version.truncate(2))
    name = "".join(c for c in info.application_name if c.isprintable())[:64]
    return ServerReading(name, application, version, clock, port, ".".join(map(str, group)) if is_multicast else "")


def is_readable(version: Version) -> bool:
    """Whether frames of a bit-stream can be read."""
    return bool(version >= OLDEST and version.major <= NEWEST_MAJOR)


def read_body_names(data: bytes, version: Version) -> dict[str, int] | None:
    """Numbers of the rigid bodies that are described, by name."""
    read = _attempt(lambda: DataDescriptions.read_from_buffer(_payload(data), version))
    if packet_kind(data) != DESCRIPTIONS or read is None:
        return None
    return {str(body.name): _signed(body.id_num) for body in read.rigid_bodies}


def read_frame(data: bytes, version: Version, clock: int) -> FrameReading | None:
    """A frame.

    Args:
        data: The packet.
        version: Of the bit-stream.
        clock: Ticks of the server's clock in a second; 0: unknown.
    """
    frame = _attempt(lambda: DataFrame.read_from_buffer(_payload(data), version))
    if packet_kind(data) != FRAME or frame is None:
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


def _payload(data: bytes) -> _CheckedBuffer:
    return _CheckedBuffer(data[_HEADER.size :])


def _attempt(read: Callable[[], Read]) -> Read | None:
    try:
        return read()
    except (struct.error, ValueError, IndexError, OverflowError, AssertionError, NatNetError):
        return None
