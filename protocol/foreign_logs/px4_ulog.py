"""PX4's ULog files (https://docs.px4.io/main/en/dev_log/ulog_file_format): decoded by pyulog, once they are sound.

pyulog neither says where a file is damaged nor bounds what a damaged definition asks for. So the messages are walked
here first, and it gets those that are whole, known and wanted.
"""

from __future__ import annotations

import struct
from contextlib import redirect_stdout
from io import BytesIO, StringIO
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.foreign_logs.log_tables import EMPTY_TABLE, DamageList, ForeignFlight, LogTable, cleaned, plausible_start
from protocol.foreign_logs.vehicle_messages import VehicleKind, VehicleMessages

_FILE_HEADER = 16  # magic, version, time [bytes]
_HEADER = struct.Struct("<HB")  # size of what follows, type
_LEAST = {"B": 40, "F": 3, "I": 3, "M": 4, "P": 3, "Q": 4, "A": 4, "R": 2, "D": 10, "S": 8, "O": 2, "L": 9, "C": 11}
_FLAGS = struct.Struct("<8s8s3Q")  # that a reader may ignore, that it must know, offsets of appended data
_APPENDED = 1  # of the flags that it must know
_SYNC = b"\x08\x00S" + bytes.fromhex("2f731320250cbb12")  # a whole message, at which a reader finds its way again
_LARGEST = 0xFFFF  # message [bytes]
_DEEPEST = 8  # of formats in formats
PLAIN_TYPES = frozenset(
    {
        *("int8_t", "uint8_t", "int16_t", "uint16_t", "int32_t", "uint32_t", "int64_t", "uint64_t"),
        *("float", "double", "bool", "char"),
    }
)

TOPICS = frozenset(
    {
        "vehicle_attitude", "vehicle_local_position", "vehicle_global_position", "sensor_combined",
        "vehicle_angular_velocity", "vehicle_acceleration", "actuator_motors", "actuator_servos", "actuator_outputs",
        "battery_status", "vehicle_status", "airspeed", "airspeed_validated", "vtol_vehicle_status",
        "vehicle_gps_position", "sensor_gps",
    }
)  # fmt: skip

# vehicle_status.nav_state to PX4's custom mode: main mode, and sub-mode of AUTO.
NAV_STATES = {
    0: (1, 0), 1: (2, 0), 2: (3, 0), 3: (4, 4), 4: (4, 3), 5: (4, 5), 10: (5, 0), 12: (4, 6), 13: (4, 6), 14: (6, 0),
    15: (7, 0), 17: (4, 2), 18: (4, 6), 19: (4, 8), 20: (4, 9), 21: (3, 1), 22: (4, 10),
}  # fmt: skip
ARMED = 2  # vehicle_status.arming_state


class _Sound(NamedTuple):
    """The whole messages of a file."""

    data: bytes  # a ULog file of it
    texts: list[tuple[float, int, str]]  # time [s], MAV_SEVERITY, text


class _Walk:
    """Goes through the messages of a file up to its damage."""

    def __init__(self, data: bytes, damage: DamageList) -> None:
        self._data, self._damage = data, damage
        self._formats: dict[str, list[tuple[str, int, str]]] = {}
        self._sizes: dict[int, range] = {}  # of the data of topics that are wanted, by message id
        self._kept = {"F": bytearray(), "A": bytearray(), "D": bytearray()}
        self._texts: list[tuple[float, int, str]] = []

    def run(self) -> _Sound:
        """Walk; data that were appended after a crash begin where the flags say, whatever was being written.

        Raises:
            FileError: The file needs more than is known here.
        """
        begin = _FILE_HEADER
        for end in (*self._appended(), len(self._data)):
            at = begin
            while at < end:
                fault, after = self._next(at, end)
                if fault:
                    self._damage.add(at, after - at, fault)
                at = after
            begin = end
        whole = self._data[:_FILE_HEADER] + b"".join(bytes(part) for part in self._kept.values())
        return _Sound(whole, self._texts)

    def _appended(self) -> list[int]:
        """Offsets at which appended data begin, by the flags, which are the first message."""
        body = self._data[_FILE_HEADER + _HEADER.size :][: _FLAGS.size]
        if self._data[_FILE_HEADER + 2 : _FILE_HEADER + 3] != b"B" or len(body) < _FLAGS.size:
            return []
        _, needed, *offsets = _FLAGS.unpack(body)
        if needed[0] & ~_APPENDED or any(needed[1:]):
            raise FileError(f"{self._damage.name}: a ULog file that needs what is not known here: {needed.hex()}")
        inside = [offset for offset in offsets if _FILE_HEADER < offset < len(self._data)]
        return sorted(inside) if needed[0] & _APPENDED else []

    def _next(self, at: int, limit: int) -> tuple[str, int]:
        """Fault of the message at an offset, empty if there is none, and where to go on."""
        if limit - at < _HEADER.size:
            return "the file was cut", limit
        size, code = _HEADER.unpack_from(self._data, at)
        end, letter = at + _HEADER.size + size, chr(code)
        is_message = "A" <= letter <= "Z" and size >= _LEAST.get(letter, 0)
        if is_message and end <= limit:
            return self._take(letter, at, end), end
        found = self._data.find(_SYNC, at + 1, limit)
        if found >= 0:
            return "no message begins here", found
        return "the file was cut" if is_message else "no message begins here; what follows is not read", limit

    def _take(self, letter: str, at: int, end: int) -> str:
        """Keep a message; what is wrong with it, empty if nothing."""
        body = self._data[at + _HEADER.size : end]
        fault = ""
        if letter == "F":
            fault = self._define(body)
        elif letter == "A":
            fault = self._subscribe(body)
        elif letter == "D":
            expected = self._sizes.get(int.from_bytes(body[:2], "little"))
            if expected is None:
                return ""  # not wanted
            fault = "" if len(body) - 2 in expected else "data of another size than defined"
        else:
            self._read_text(letter, body)
            return ""
        if letter == "D" and not fault:
            body = body[: 2 + self._sizes[int.from_bytes(body[:2], "little")].start]  # pyulog expects no padding
        if not fault and (letter != "A" or int.from_bytes(body[1:3], "little") in self._sizes):
            self._kept[letter] += _HEADER.pack(len(body), ord(letter)) + body
        return fault

    def _define(self, body: bytes) -> str:
        try:
            known = ULog.MessageFormat(body, None)
        except (ValueError, IndexError):
            return "a format that cannot be read"
        names = [name for _, _, name in known.fields]
        if len(set(names)) < len(names):
            return "a format that cannot be read"
        self._formats[known.name] = known.fields
        return ""

    def _subscribe(self, body: bytes) -> str:
        name, number = body[3:].decode("utf-8", "replace"), int.from_bytes(body[1:3], "little")
        self._sizes.pop(number, None)
        if name not in TOPICS:
            return ""
        whole = self._size(name)
        fields = self._formats.get(name, [])
        if not 0 < whole <= _LARGEST or ("uint64_t", 0, "timestamp") not in fields:
            return f"no sound format of {name}"
        padding = 0
        for kind, count, field in reversed(fields):
            if not field.startswith("_padding"):
                break
            padding += ULog.get_field_size(kind) * max(count, 1)
        self._sizes[number] = range(whole - padding, whole + 1)
        return ""

    def _size(self, name: str, depth: int = 0) -> int:
        """Size of a format [bytes]; beyond the largest one if it is not sound."""
        total = 0
        if name not in self._formats or depth > _DEEPEST:
            return _LARGEST + 1
        for kind, count, _ in self._formats[name]:
            one = ULog.get_field_size(kind) if kind in PLAIN_TYPES else self._size(kind, depth + 1)
            total += one * max(count, 1)
            if total > _LARGEST:
                return _LARGEST + 1
        return total

    def _read_text(self, letter: str, body: bytes) -> None:
        if letter in "LC":
            skipped = 1 if letter == "L" else 3  # level, and a tag
            time = int.from_bytes(body[skipped : skipped + 8], "little") * 1e-6
            severity = body[0] - ord("0") if ord("0") <= body[0] <= ord("7") else int(mavlink.MAV_SEVERITY_INFO)
            self._texts.append((time, severity, body[skipped + 8 :].decode("utf-8", "replace")))


def read_ulog(data: bytes, name: str) -> ForeignFlight:
    """The flight in a ULog file.

    Args:
        data: The file.
        name: What errors call it.

    Raises:
        FileError: There is nothing in it, or it is damaged throughout.
    """
    damage = DamageList(name)
    if len(data) < _FILE_HEADER:
        raise FileError(f"{name}: a ULog file that ends at byte {len(data)}, in its header")
    sound = _Walk(data, damage).run()
    found = _decoded(sound.data, name)
    severities = np.array([severity for _, severity, _ in sound.texts], np.int64)
    words = np.array([text for *_, text in sound.texts], np.object_)
    found["texts", 0] = LogTable(np.array([time for time, *_ in sound.texts]), {"severity": severities, "text": words})
    tables = cleaned(found, damage, len(data))
    vehicle = _told(tables)
    return ForeignFlight("PX4 ULog", [vehicle], len(data), damage.pieces, _switched_on(tables))


def _decoded(data: bytes, name: str) -> dict[tuple[str, int], LogTable]:
    """Tables by topic and instance."""
    try:
        with redirect_stdout(StringIO()):
            log = ULog(BytesIO(data))
    except Exception as error:  # pyulog says by many kinds of exception that it cannot read a file
        raise FileError(f"{name}: a ULog file that cannot be read: {error}") from error
    tables = {}
    for topic in log.data_list:
        columns = dict(topic.data)
        sampled = columns.get("timestamp_sample", np.zeros(0))
        times = sampled if len(sampled) and sampled.all() else columns["timestamp"]
        tables[topic.name, int(topic.multi_id)] = LogTable(times * 1e-6, columns)
    return tables


def _told(tables: dict[tuple[str, int], LogTable]) -> VehicleMessages:
    def table(*names: str) -> LogTable:
        return next((found for name in names if (found := _first(tables, name)).has()), EMPTY_TABLE)

    status = table("vehicle_status")
    vehicle = VehicleMessages(1, _vehicle_kind(status))
    _tell_imu(vehicle, table("sensor_combined"), table("vehicle_angular_velocity"), table("vehicle_acceleration"))
    attitude, local, globe = (
        table("vehicle_attitude"),
        table("vehicle_local_position"),
        table("vehicle_global_position"),
    )
    if attitude.has("q[0]", "q[1]", "q[2]", "q[3]"):
        vehicle.attitude(attitude.times, attitude.stack("q[0]", "q[1]", "q[2]", "q[3]"))
    if local.has("x", "y", "z", "vx", "vy", "vz"):
        vehicle.motion(local.times, local.stack("x", "y", "z"), local.stack("vx", "vy", "vz"))
    if globe.has("lat", "lon", "alt"):
        places = globe.stack("lat", "lon", "alt")
        vehicle.place(globe.times, places, places[:, 2] - places[0, 2])
    _tell_outputs(vehicle, table("actuator_motors"), table("actuator_servos"), table("actuator_outputs"))
    battery, air = table("battery_status"), table("airspeed_validated", "airspeed")
    if battery.has("voltage_v"):
        vehicle.battery(battery.times, *(_column(battery, name) for name in ("voltage_v", "current_a", "remaining")))
    speed = next((n for n in ("calibrated_airspeed_m_s", "indicated_airspeed_m_s") if air.has(n)), None)
    if speed:
        vehicle.airspeed(air.times, air.columns[speed].astype(np.float64))
    if status.has("nav_state", "arming_state"):
        modes = np.array([_custom_mode(number) for number in status.columns["nav_state"].tolist()], np.int64)
        vehicle.state(status.times, modes, status.columns["arming_state"] == ARMED)
    vtol = table("vtol_vehicle_status")
    for field in ("vehicle_vtol_state", "vtol_state"):
        if vtol.has(field):
            vehicle.vtol(vtol.times, vtol.columns[field])
            break
    texts = tables["texts", 0]
    vehicle.texts(texts.times, texts.columns["severity"].tolist(), texts.columns["text"].tolist())
    return vehicle


def _first(tables: dict[tuple[str, int], LogTable], name: str) -> LogTable:
    """Samples of the first instance of a topic: of several sensors the one with the least number."""
    numbers = [number for topic, number in tables if topic == name]
    return tables[name, min(numbers)] if numbers else EMPTY_TABLE


def _column(table: LogTable, name: str) -> NDArray[np.float64]:
    if name not in table.columns:
        return np.full(len(table.times), np.nan)
    return np.asarray(table.columns[name], np.float64)


def _vehicle_kind(status: LogTable) -> VehicleKind:
    """PX4's vehicle_type: 1 rotary wing, 2 fixed wing; whether it is a tail-sitter it says, too."""
    kind = int(mavlink.MAV_TYPE_GENERIC)
    if status.has("is_vtol") and status.columns["is_vtol"].any():
        tail = status.has("is_vtol_tailsitter") and status.columns["is_vtol_tailsitter"].any()
        kind = int(mavlink.MAV_TYPE_VTOL_DUOROTOR if tail else mavlink.MAV_TYPE_VTOL_TILTROTOR)
    elif status.has("vehicle_type"):
        kinds = {1: int(mavlink.MAV_TYPE_QUADROTOR), 2: int(mavlink.MAV_TYPE_FIXED_WING)}
        kind = kinds.get(int(status.columns["vehicle_type"][-1]), kind)
    return VehicleKind(int(mavlink.MAV_AUTOPILOT_PX4), kind)


def _custom_mode(nav_state: int) -> int:
    main, sub = NAV_STATES.get(nav_state, (0, 0))
    return main << 16 | sub << 24


def _tell_imu(vehicle: VehicleMessages, combined: LogTable, rates: LogTable, force: LogTable) -> None:
    gyro, accelerometer = ([f"{name}[{axis}]" for axis in range(3)] for name in ("gyro_rad", "accelerometer_m_s2"))
    xyz = [f"xyz[{axis}]" for axis in range(3)]
    if combined.has(*gyro, *accelerometer):
        vehicle.imu(combined.times, combined.stack(*gyro), combined.stack(*accelerometer))
    elif rates.has(*xyz) and force.has(*xyz):
        at = [np.interp(rates.times, force.times, column) for column in force.stack(*xyz).T]
        vehicle.imu(rates.times, rates.stack(*xyz), np.stack(at, axis=1))


def _tell_outputs(vehicle: VehicleMessages, motors: LogTable, servos: LogTable, pulses: LogTable) -> None:
    """Motors first, then servos: those that PX4 uses, the others are NaN."""
    used_motors, used_servos = _used(motors), _used(servos)
    if used_motors:
        outputs = motors.stack(*used_motors)
        if used_servos:
            held = np.clip(np.searchsorted(servos.times, motors.times, side="right") - 1, 0, None)
            outputs = np.hstack([outputs, servos.stack(*used_servos)[held]])
        vehicle.outputs(motors.times, outputs)
    widths = [name for name in (f"output[{number}]" for number in range(16)) if pulses.has(name)]
    if widths:
        vehicle.pulses(pulses.times, pulses.stack(*widths))


def _used(table: LogTable) -> list[str]:
    names = [f"control[{number}]" for number in range(16)]
    return [name for name in names if table.has(name) and np.isfinite(table.columns[name]).any()]


def _switched_on(tables: dict[tuple[str, int], LogTable]) -> int:
    """Switching on, by the date of the satellite receiver [us since 1970]; 0 if that does not say."""
    for name in ("vehicle_gps_position", "sensor_gps"):
        table = _first(tables, name)
        if table.has("time_utc_usec") and (known := table.columns["time_utc_usec"] > 0).any():
            return plausible_start(table.columns["time_utc_usec"][known].astype(np.float64), table.times[known])
    return 0
