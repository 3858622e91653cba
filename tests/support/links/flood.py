"""A hostile sender: seeded datagrams for the port of a vehicle or a ground station."""

import random
from collections import Counter
from collections.abc import Callable

from pymavlink.generator.mavcrc import x25crc

from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from protocol.wire.message import Message, source_of

VEHICLE, ELSEWHERE = (1, 1), (7, 1)  # the vehicle, and one that does not exist
STATION = (255, 190)
_CRC = 2
_NAN = float("nan")


def orders(system: int, component: int) -> list[Message]:
    """Messages that would each have an effect if they arrived intact at the vehicle they address."""
    to = (system, component)
    cmd, mission = mavlink.MAVLink_command_long_message, mavlink.MAV_MISSION_TYPE_MISSION
    return [
        cmd(*to, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, 21196, 0, 0, 0, 0, 0),
        cmd(*to, mavlink.MAV_CMD_NAV_LAND, 0, *[_NAN] * 7),
        cmd(*to, mavlink.MAV_CMD_DO_SET_MODE, 0, 1, 4, 5, 0, 0, 0, 0),
        cmd(*to, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, 30, -1, 0, 0, 0, 0, 0),
        mavlink.MAVLink_command_int_message(
            *to, 6, mavlink.MAV_CMD_DO_REPOSITION, 0, 0, -1, 1, 0, _NAN, 435648100, 14811000, 9.0
        ),
        mavlink.MAVLink_param_set_message(*to, b"SIM_WIND_SPD", 9.0, mavlink.MAV_PARAM_TYPE_REAL32),
        mavlink.MAVLink_mission_count_message(*to, 2, mission),
        mavlink.MAVLink_mission_count_message(*to, 0, mission),
        mavlink.MAVLink_mission_item_int_message(*to, 0, 6, 16, 0, 1, 0, 1, 0, _NAN, 435648100, 14811000, 4.0),
        mavlink.MAVLink_mission_clear_all_message(*to, mavlink.MAV_MISSION_TYPE_ALL),
        mavlink.MAVLink_mission_set_current_message(*to, 3),
        mavlink.MAVLink_set_position_target_local_ned_message(
            0, *to, mavlink.MAV_FRAME_LOCAL_NED, 0b1101_1111_1000, 8, 0, -3, 0, 0, 0, 0, 0, 0, 0, 0
        ),
        mavlink.MAVLink_manual_control_message(system, 1000, 0, 500, 0, 0),
        mavlink.MAVLink_setup_signing_message(*to, list(range(32)), 1),
        mavlink.MAVLink_log_erase_message(*to),
        mavlink.MAVLink_file_transfer_protocol_message(0, *to, [0, 0, 0, 4, *[0] * 247]),
    ]


def claims() -> list[Message]:
    """Messages that would each be shown by a ground station if they arrived intact from its vehicle."""
    position = (9_000_000, 99.0, 99.0, -99.0, 9.0, 9.0, 9.0)
    return [
        mavlink.MAVLink_heartbeat_message(19, 12, 0x81, 4 << 16 | 6 << 24, 4, 3),
        mavlink.MAVLink_statustext_message(0, b"a stranger says so", 0, 0),
        mavlink.MAVLink_local_position_ned_message(*position),
        mavlink.MAVLink_attitude_message(9_000_000, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0),
        mavlink.MAVLink_home_position_message(0, 0, 0, 0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0),
        mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 9000, 0, 1, *[0] * 6),
        mavlink.MAVLink_mission_current_message(77, 99, 3),
        mavlink.MAVLink_mission_item_reached_message(3),
        mavlink.MAVLink_mission_count_message(255, 190, 0, 0),
        mavlink.MAVLink_mission_item_int_message(255, 190, 0, 6, 16, 0, 1, 0, 1, 0, _NAN, 0, 0, 4.0),
        mavlink.MAVLink_mission_ack_message(255, 190, mavlink.MAV_MISSION_ACCEPTED, 0),
        mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, 0, 255, 190),
        mavlink.MAVLink_param_value_message(b"DRK_VF_ENTER", 1e6, mavlink.MAV_PARAM_TYPE_REAL32, 1, 0),
        mavlink.MAVLink_darko_jump_message(9_000_000_000, 99, 1.0, 1, 2, 1, b"never"),
        mavlink.MAVLink_file_transfer_protocol_message(0, 255, 190, [0, 0, 0, 128, *[0] * 247]),
    ]


def random_payload(draw: random.Random, known: type[Message]) -> bytearray:
    """A random payload for a message of the dialect, with numbers that are often NaN, infinite, zero or all ones."""
    words = (b"\0\0\0\0", b"\0\0\xc0\x7f", b"\0\0\x80\x7f", b"\0\0\x80\x3f", b"\0\0\x80\xff", b"\xff\xff\xff\xff")
    payload = bytearray(draw.choice((draw.randbytes(4), *words))[k % 4] for k in range(known.unpacker.size))
    for k in range(0, known.unpacker.size - 3, 4):
        payload[k : k + 4] = draw.choice((draw.randbytes(4), *words))
    return payload


def framed(known: type[Message], payload: bytes, sequence: int, source: tuple[int, int]) -> bytes:
    """A version 2 frame with a right checksum."""
    head: bytes = bytes([0xFD, len(payload), 0, 0, sequence, *source]) + known.id.to_bytes(3, "little")
    crc: int = x25crc(head[1:] + payload + bytes([known.crc_extra])).crc
    return head + bytes(payload) + crc.to_bytes(2, "little")


class Flood:
    """Hostile datagrams, one after the other; ``counts`` says how many of which kind there were.

    One damaged frame in 65,536 has the right checksum by chance, and is an order like any other: whoever wants more
    than a checksum signs. Such datagrams are counted as "right by chance" and left out.

    Args:
        seed: One seed is one flood, byte for byte.
        whole: Whether well-formed frames are among them: orders for another vehicle, claims of another one.
        upwards: Whether it is made for a vehicle, of orders from a ground station; else for a ground station.
    """

    def __init__(self, seed: int, *, whole: bool = True, upwards: bool = True) -> None:
        self._random = random.Random(seed)
        self._codec = Codec(*(STATION if upwards else VEHICLE))
        self._elsewhere_codec = Codec(*(STATION if upwards else ELSEWHERE))
        self._upwards = upwards
        self._here = orders(*VEHICLE) if upwards else claims()
        self._elsewhere = orders(*ELSEWHERE) if upwards else claims()
        self.counts: Counter[str] = Counter()
        self._kinds: dict[str, Callable[[], bytes]] = {
            "garbage": self._garbage,
            "truncated": self._truncated,
            "bit-flipped": self._flipped,
            "wrong checksum": self._wrong_checksum,
            "unknown id": self._unknown,
            "other version": self._other_version,
            "wrong length": self._wrong_length,
        } | ({"wrong target": self._wrong_target} if whole else {})

    def datagram(self) -> bytes:
        """The next datagram: mostly one frame, sometimes several, rarely far too large."""
        while not all(map(self._is_elsewhere, Codec(0, 0).decode(data := self._datagram()))):
            self.counts["right by chance"] += 1
        return data

    def _is_elsewhere(self, message: Message) -> bool:
        if not self._upwards:
            return source_of(message) == ELSEWHERE
        return getattr(message, "target_system", getattr(message, "target", 0)) == ELSEWHERE[0]

    def _datagram(self) -> bytes:
        size = self._random.random()
        if size < 0.002:
            self.counts["oversized"] += 1
            return self._random.randbytes(self._random.choice((4097, 20_000, 65_507)))
        return b"".join(self._frame() for _ in range(1 if size < 0.8 else self._random.randint(2, 6)))

    def _frame(self) -> bytes:
        kind = self._random.choice(tuple(self._kinds))
        self.counts[kind] += 1
        return self._kinds[kind]()

    def _good(self) -> bytes:
        return self._codec.encode(self._random.choice(self._here))

    def _garbage(self) -> bytes:
        data = bytearray(self._random.randbytes(self._random.randint(0, 300)))
        if data and self._random.random() < 0.5:
            data[0] = self._random.choice((0xFD, 0xFE, 0x55))
        return bytes(data)

    def _truncated(self) -> bytes:
        frame = self._good()
        return frame[: self._random.randrange(1, len(frame))]

    def _flipped(self) -> bytes:
        frame = bytearray(self._good())
        for bit in self._random.sample(range(8 * len(frame)), self._random.randint(1, 8)):
            frame[bit // 8] ^= 1 << bit % 8
        return bytes(frame)

    def _wrong_checksum(self) -> bytes:
        frame = self._good()
        return frame[:-1] + bytes([frame[-1] ^ self._random.randint(1, 255)])

    def _unknown(self) -> bytes:
        payload = self._random.randbytes(self._random.randint(0, 255))
        number = self._random.choice((0xFFFFFF, 0xABCDE, 59_999)).to_bytes(3, "little")
        head = bytes([0xFD, len(payload), 0, 0, self._random.randrange(256), 255, 190]) + number
        return head + payload + self._random.randbytes(_CRC)

    def _other_version(self) -> bytes:
        frame = bytearray(self._good())
        way = self._random.randrange(4)
        if way == 0:
            frame[0] = self._random.choice((0x55, 0xFC, 0xFF))  # version 0.9, and future versions
        elif way == 1:
            frame[2] = 1 << self._random.randint(1, 7)  # future incompatibility flags
        elif way == 2:
            frame[0] = 0xFE
        else:
            frame[2] = 1  # claims a signature that is missing
        return bytes(frame)

    def _wrong_length(self) -> bytes:
        frame = bytearray(self._good())
        frame[1] = self._random.choice([n for n in (0, 1, 254, 255, frame[1] ^ 3) if n != frame[1]])
        return bytes(frame)

    def _wrong_target(self) -> bytes:
        return self._elsewhere_codec.encode(self._random.choice(self._elsewhere))
