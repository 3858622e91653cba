"""ArduPilot's DataFlash files (.bin): formats, units and multipliers as FMT, FMTU, UNIT and MULT tell them.

pymavlink knows what the letters of a format mean. Its reader is not used: a definition of length 0 holds it for ever,
and it does not say what it left out.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymavlink.DFReader import FORMAT_TO_STRUCT, DFFormat

from protocol.dialect import mavlink
from protocol.foreign_logs.log_tables import (
    EMPTY_TABLE,
    SI_FACTORS,
    DamageList,
    ForeignFlight,
    LogTable,
    cleaned,
    plausible_start,
)
from protocol.foreign_logs.vehicle_messages import VehicleKind, VehicleMessages, quaternions_of

_HEAD = b"\xa3\x95"  # of every record
_FMT = 0x80
_FMT_BODY = struct.Struct("<BB4s16s64s")  # type, length, name, letters, columns
_FMT_LENGTH = 3 + _FMT_BODY.size
_NUMPY_CODES = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "q": "<i8", "Q": "<u8"}
_NUMPY_CODES |= {"e": "<f2", "f": "<f4", "d": "<f8", "4s": "S4", "16s": "S16", "64s": "S64"}

# Units of fields where FMTU, which is younger, does not tell them.
OLD_UNITS = {
    **{f"C{number}": "us" for number in range(1, 17)},
    **dict.fromkeys(("Roll", "Pitch", "Yaw", "GCrs", "Lat", "Lng"), "deg"),
    "TimeUS": "us", "TimeMS": "ms", "RemPct": "%",
}  # fmt: skip
GPS_EPOCH = 315_964_800  # 1980-01-06 [s since 1970]
WEEK = 604_800  # [s]
LEAP_SECONDS = 18  # of GPS time before UTC, since 2017 [s]
ARMED_EVENTS = {10: True, 11: False, 15: True}  # EV.Id: armed, disarmed, armed by itself
FIRMWARES = {
    "ArduPlane": int(mavlink.MAV_TYPE_FIXED_WING),
    "ArduCopter": int(mavlink.MAV_TYPE_QUADROTOR),
    "ArduRover": int(mavlink.MAV_TYPE_GROUND_ROVER),
    "ArduSub": int(mavlink.MAV_TYPE_SUBMARINE),
}


class _Records:
    """Records of a file by their definitions."""

    def __init__(self, data: bytes, damage: DamageList) -> None:
        self._data, self._damage = data, damage
        first = DFFormat(_FMT, "FMT", _FMT_LENGTH, "BBnNZ", "Type,Length,Name,Format,Columns")
        self._formats: dict[int, DFFormat] = {_FMT: first}
        self._places: dict[int, array[int]] = {}

    def walk(self) -> None:
        """Find every record; after damage go on at the next one."""
        data, at = self._data, 0
        while at < len(data):
            known = self._formats.get(data[at + 2]) if data.startswith(_HEAD, at) and at + 2 < len(data) else None
            if known is None:
                begin, at = at, self._next(at + 1)
                self._damage.add(begin, at - begin, "no record begins here")
            elif at + known.len > len(data):
                self._damage.add(at, len(data) - at, "the file was cut")
                break
            else:
                if known.type == _FMT:
                    self._define(at)
                self._places.setdefault(known.type, array("q")).append(at)
                at += known.len

    def _next(self, at: int) -> int:
        """Offset at which the next record may begin."""
        while 0 <= (at := self._data.find(_HEAD, at)) < len(self._data) - 2:
            if self._data[at + 2] in self._formats:
                return at
            at += 1
        return len(self._data)

    def _define(self, at: int) -> None:
        number, length, *texts = _FMT_BODY.unpack_from(self._data, at + 3)
        name, letters, columns = (text.split(b"\0")[0].decode("latin-1") for text in texts)
        names = columns.split(",") if columns else []
        sound = set(letters) <= set(FORMAT_TO_STRUCT) and len(letters) == len(names) == len(set(names))
        if sound and number != _FMT:
            sound = length == 3 + struct.calcsize("<" + "".join(FORMAT_TO_STRUCT[letter][0] for letter in letters))
        if not sound or not name.isidentifier():
            self._damage.add(at, _FMT_LENGTH, "a definition that cannot be read")
        elif number != _FMT:
            known = DFFormat(number, name, length, letters, columns)
            before = self._formats.get(number)
            if before is not None and _layout(before) != _layout(known) and self._places.pop(number, False):
                self._damage.add(at, _FMT_LENGTH, f"{before.name} is defined anew; what was logged of it is not read")
            self._formats[number] = known

    def raw(self) -> Iterator[tuple[DFFormat, NDArray[np.void]]]:
        """Records of each kind as a structured array, as they stand in the file."""
        whole = np.frombuffer(self._data, np.uint8)
        for number, places in self._places.items():
            known = self._formats[number]
            codes = [_NUMPY_CODES[FORMAT_TO_STRUCT[letter][0]] for letter in known.format]
            kind = np.dtype(list(zip(known.columns, codes, strict=True)))
            starts = np.frombuffer(places, np.int64)[:, np.newaxis] + 3
            yield known, whole[starts + np.arange(kind.itemsize)].view(kind).reshape(-1)


def _layout(known: DFFormat) -> tuple[str, str, list[str]]:
    return known.name, known.format, known.columns


def read_dataflash(data: bytes, name: str) -> ForeignFlight:
    """The flight in a DataFlash file.

    Args:
        data: The file.
        name: What errors call it.

    Raises:
        FileError: It is damaged throughout.
    """
    damage = DamageList(name)
    records = _Records(data, damage)
    records.walk()
    raw = {known.name: (known, rows) for known, rows in records.raw()}
    factors = _factors(raw)
    found = {kind: _table(known, rows, factors.get(kind, {})) for kind, (known, rows) in raw.items()}
    tables = cleaned({kind: table for kind, table in found.items() if len(table.times)}, damage, len(data))
    return ForeignFlight("ArduPilot DataFlash log", [_told(tables)], len(data), damage.pieces, _switched_on(tables))


def _factors(raw: Mapping[str, tuple[DFFormat, NDArray[np.void]]]) -> dict[str, dict[str, float]]:
    """Factors to SI units, by message and field, as the log tells them."""
    if not {"FMTU", "UNIT", "MULT"} <= raw.keys():
        return {}
    units = {chr(int(row["Id"]) & 0xFF): row["Label"].decode("latin-1") for row in _rows(raw["UNIT"], "Id", "Label")}
    scales = {chr(int(row["Id"]) & 0xFF): float(row["Mult"]) for row in _rows(raw["MULT"], "Id", "Mult")}
    kinds = {known.type: known for known, _ in raw.values()}
    found: dict[str, dict[str, float]] = {}
    for row in _rows(raw["FMTU"], "FmtType", "UnitIds", "MultIds"):
        known = kinds.get(int(row["FmtType"]))
        if known is None:
            continue
        marks = zip(known.columns, row["UnitIds"].decode("latin-1"), row["MultIds"].decode("latin-1"), strict=False)
        found[known.name] = {
            column: _unit(column, units.get(unit, "")) * _scale(known, column, scales.get(scale, 1.0))
            for column, unit, scale in marks
        }
    return found


def _unit(column: str, told: str) -> float:
    """Factor of a field's unit; where the log tells none, of the one that it has always had."""
    return SI_FACTORS.get(told) or SI_FACTORS.get(OLD_UNITS.get(column, ""), 1.0)


def _rows(table: tuple[DFFormat, NDArray[np.void]], *names: str) -> NDArray[np.void]:
    known, rows = table
    return rows if set(names) <= set(known.columns) else rows[:0]


def _scale(known: DFFormat, column: str, told: float) -> float:
    """Factor of a field; a letter that has one of its own is not scaled again, and 0 stands for no number."""
    own = known.msg_mults[known.colhash[column]]
    if own is not None:
        return float(own)
    return told if np.isfinite(told) and told != 0.0 else 1.0


def _table(known: DFFormat, rows: NDArray[np.void], factors: Mapping[str, float]) -> LogTable:
    """Records in SI units; without times if they have none."""
    columns: dict[str, NDArray[Any]] = {}
    for name in known.columns:
        values = rows[name]
        if values.dtype.kind != "S":
            factor = factors.get(name, _unit(name, "") * _scale(known, name, 1.0))
            with np.errstate(invalid="ignore", over="ignore"):
                values = values.astype(np.float64) * factor
        columns[name] = values
    time = next((columns[name] for name in ("TimeUS", "TimeMS") if name in columns), None)
    return LogTable(np.zeros(0), {}) if time is None or time.dtype.kind == "S" else LogTable(time, columns)


def _told(tables: Mapping[str, LogTable]) -> VehicleMessages:
    def table(*names: str) -> LogTable:
        return next((_first_instance(tables[name]) for name in names if name in tables), EMPTY_TABLE)

    texts = table("MSG")
    words = [text.decode("latin-1") for text in texts.columns.get("Message", np.zeros(0, "S1")).tolist()]
    vehicle = VehicleMessages(1, VehicleKind(int(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA), _vehicle_kind(words)))
    vehicle.texts(texts.times[: len(words)], [int(mavlink.MAV_SEVERITY_INFO)] * len(words), words)
    imu, attitude, filtered = table("IMU"), table("XKQ", "NKQ1", "NKQ"), table("XKF1", "NKF1")
    if imu.has("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"):
        vehicle.imu(imu.times, imu.stack("GyrX", "GyrY", "GyrZ"), imu.stack("AccX", "AccY", "AccZ"))
    angles = table("ATT")
    if attitude.has("Q1", "Q2", "Q3", "Q4"):
        vehicle.attitude(attitude.times, attitude.stack("Q1", "Q2", "Q3", "Q4"))
    elif angles.has("Roll", "Pitch", "Yaw"):
        vehicle.attitude(angles.times, quaternions_of(angles.stack("Roll", "Pitch", "Yaw")))
    if filtered.has("PN", "PE", "PD", "VN", "VE", "VD"):
        vehicle.motion(filtered.times, filtered.stack("PN", "PE", "PD"), filtered.stack("VN", "VE", "VD"))
    _tell_place(vehicle, table("POS"), table("GPS"))
    _tell_electrics(vehicle, table("RCOU"), table("BAT", "CURR"))
    air = table("ARSP")
    if air.has("Airspeed"):
        vehicle.airspeed(air.times, air.columns["Airspeed"])
    _tell_state(vehicle, table("MODE"), table("ARM"), table("EV"))
    return vehicle


def _first_instance(table: LogTable) -> LogTable:
    """Samples of the first sensor or filter core: those are numbered by one of these fields."""
    number = next((table.columns[name] for name in ("I", "C", "Inst", "Instance") if name in table.columns), None)
    if number is None or number.dtype.kind == "S" or not len(number):
        return table
    return table.where(number == np.nanmin(number))


def _vehicle_kind(texts: list[str]) -> int:
    for text in texts:
        for firmware, kind in FIRMWARES.items():
            if text.startswith(firmware):
                return kind
    return int(mavlink.MAV_TYPE_GENERIC)


def _tell_place(vehicle: VehicleMessages, place: LogTable, receiver: LogTable) -> None:
    if not place.has("Lat", "Lng", "Alt"):
        return
    places = place.stack("Lat", "Lng", "Alt")
    places[:, :2] = np.degrees(places[:, :2])
    height = place.columns["RelHomeAlt"] if place.has("RelHomeAlt") else places[:, 2] - places[0, 2]
    velocity = None
    if receiver.has("Spd", "GCrs", "VZ"):
        speed, course, down = receiver.stack("Spd", "GCrs", "VZ").T
        columns = (speed * np.cos(course), speed * np.sin(course), down)
        velocity = np.stack([np.interp(place.times, receiver.times, column) for column in columns], axis=1)
    vehicle.place(place.times, places, height, velocity)


def _tell_electrics(vehicle: VehicleMessages, outputs: LogTable, battery: LogTable) -> None:
    widths = [name for name in (f"C{number}" for number in range(1, 17)) if outputs.has(name)]
    if widths:
        vehicle.pulses(outputs.times, 1e6 * outputs.stack(*widths))
    if battery.has("Volt", "Curr"):
        left = battery.columns["RemPct"] if battery.has("RemPct") else None
        vehicle.battery(battery.times, battery.columns["Volt"], battery.columns["Curr"], left)


def _tell_state(vehicle: VehicleMessages, modes: LogTable, arming: LogTable, events: LogTable) -> None:
    """Modes by MODE; arming by ARM, in older logs by EV."""
    changes: list[tuple[float, int | None, bool | None]] = []
    number = next((name for name in ("ModeNum", "Mode") if modes.has(name)), None)
    if number and modes.columns[number].dtype.kind != "S":
        told = np.nan_to_num(modes.columns[number]).astype(int).tolist()
        changes += [(time, mode, None) for time, mode in zip(modes.times.tolist(), told, strict=True)]
    if arming.has("ArmState"):
        states = (arming.columns["ArmState"] != 0).tolist()
        changes += [(time, None, state) for time, state in zip(arming.times.tolist(), states, strict=True)]
    elif events.has("Id"):
        pairs = zip(events.times.tolist(), events.columns["Id"].tolist(), strict=True)
        changes += [(time, None, ARMED_EVENTS[int(event)]) for time, event in pairs if event in ARMED_EVENTS]
    mode, armed, rows = 0, False, []
    for time, new_mode, new_armed in sorted(changes, key=lambda change: change[0]):
        mode, armed = mode if new_mode is None else new_mode, armed if new_armed is None else new_armed
        rows.append((time, mode, armed))
    times, numbers, motors = (list(column) for column in zip(*rows, strict=True)) if rows else ([], [], [])
    vehicle.state(np.array(times, np.float64), np.array(numbers, np.int64), np.array(motors, np.bool_))


def _switched_on(tables: Mapping[str, LogTable]) -> int:
    """Switching on, by the date of the satellite receiver [us since 1970]; 0 if that does not say."""
    receiver = tables.get("GPS", EMPTY_TABLE)
    if not receiver.has("GWk", "GMS"):
        return 0
    weeks, within = receiver.columns["GWk"], receiver.columns["GMS"]
    known = weeks > 0
    # A log that tells units has GMS in seconds by now, an older one in milliseconds.
    seconds = within if np.nanmax(within, initial=0.0) <= WEEK else within * 1e-3
    if not known.any():
        return 0
    utc = GPS_EPOCH + weeks * WEEK + seconds - LEAP_SECONDS
    return plausible_start(utc[known] * 1e6, receiver.times[known])
