"""Paparazzi's pairs of files: ``.log`` defines the messages, ``.data`` has one a line: time, aircraft, name, fields.

Units are those of the definitions (``unit``; else ``alt_unit`` by ``alt_unit_coef``); a coefficient that was rounded in
print is the power of two that it stands for. What the definitions do not say are the axes: INS has NED, ROTORCRAFT_FP
east, north, up; bodies are FRD (https://github.com/paparazzi/pprzlink, message_definitions).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal, InvalidOperation
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import ParseError

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml.ElementTree import iterparse
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.foreign_logs.log_tables import (
    EARLIEST,
    EMPTY_TABLE,
    LATEST,
    MAX_FOREIGN_SIZE,
    SI_FACTORS,
    DamageList,
    ForeignFlight,
    LogTable,
    cleaned,
)
from protocol.foreign_logs.utm import from_utm
from protocol.foreign_logs.vehicle_messages import VehicleKind, VehicleMessages, quaternions_of

_BEGINNING = re.compile(  # the recorder puts comments first: the versions of Paparazzi that it ran and flew
    rb"(?s)(?:\xef\xbb\xbf)?\s*(?:<\?xml[^>]*>\s*)?(?>(?:<!--.*?-->\s*)*)<configuration[\s>]"
)
_DATA_LINE = re.compile(rb"\s*[0-9]+\.[0-9]+ [\w.-]+ [A-Z][A-Z0-9_]*(?: |\r?\n)")
FULL_SCALE = 9600.0  # of a command [pprz]
FIX_3D = 3  # of GPS_INT.fix and GPS.mode
MAX_LINE = 1 << 16  # [bytes]

QUATERNIONS, EULER_ANGLES = ("AHRS_REF_QUAT", "AHRS_QUAT_INT"), ("AHRS_EULER_INT", "AHRS_EULER", "ATTITUDE")
COMMANDED = ("STAB_ATTITUDE_INDI", "STAB_ATTITUDE_FULL_INDI", "STAB_ATTITUDE")  # with the actuators' commands as u
GYROS, ACCELEROMETERS = ("IMU_GYRO_SCALED", "IMU_GYRO"), ("IMU_ACCEL_SCALED", "IMU_ACCEL")
MODES = ("ROTORCRAFT_STATUS", "PPRZ_MODE")
RECEIVERS = ("GPS_INT", "GPS_LLA")
WANTED = frozenset(
    {
        *QUATERNIONS, *EULER_ANGLES, *COMMANDED, *GYROS, *ACCELEROMETERS, *MODES, *RECEIVERS, "INS", "ROTORCRAFT_FP",
        "GPS", "ACTUATORS", "ENERGY", "BAT", "AIRSPEED", "AIR_DATA", "INFO_MSG",
    }
)  # fmt: skip


def is_paparazzi_log(beginning: bytes) -> bool:
    """Whether a file begins as a .log does."""
    return _BEGINNING.match(beginning) is not None


def is_paparazzi_data(beginning: bytes) -> bool:
    """Whether a file begins as a .data does."""
    return _DATA_LINE.match(beginning) is not None


class _Field(NamedTuple):
    name: str
    is_text: bool
    is_array: bool
    factor: float  # to SI units
    values: tuple[str, ...]  # names of the numbers


class _Definitions(NamedTuple):
    """Content of a .log."""

    messages: dict[str, list[_Field]]
    data_file: str
    start_usec: int


def read_paparazzi(path: Path, data: bytes) -> ForeignFlight:
    """The flight in a pair of files, of which one is given and the other lies beside it.

    Args:
        path: Either file.
        data: Its content.

    Raises:
        FileError: The other one is not there, nothing is defined, or the data are damaged throughout.
    """
    if is_paparazzi_data(data[:MAX_LINE]):
        log = path.with_suffix(".log")
        if log == path or not _is_there(log):
            raise FileError(f"{path}: Paparazzi data without {log.name}, which defines its messages")
        definitions, damage = _defined(log)
        return _read_pair(definitions, damage, path, data)
    definitions, damage = _defined(path, data)
    beside = [path.parent / Path(definitions.data_file.replace("\\", "/")).name, path.with_suffix(".data")]
    found = next((one for one in beside if one != path and _is_there(one)), None)
    if found is None:
        raise FileError(f"{path}: a Paparazzi log without its data, {beside[-1].name}")
    return _read_pair(definitions, damage, found, _content(found))


def _is_there(path: Path) -> bool:
    """Whether there is such a file; there is none with a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _content(path: Path) -> bytes:
    try:
        if path.stat().st_size > MAX_FOREIGN_SIZE:
            raise FileError(f"{path}: larger than {MAX_FOREIGN_SIZE >> 20} MiB")
        return path.read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error


def _defined(path: Path, content: bytes | None = None) -> tuple[_Definitions, DamageList]:
    data, damage = _content(path) if content is None else content, DamageList(str(path))
    messages: dict[str, list[_Field]] = {}
    head: dict[str, str] = {}
    within = ""
    try:
        for event, element in iterparse(BytesIO(data), events=("start", "end")):
            tag, attributes = element.tag, _attributes(element)
            if event == "start" and tag == "configuration":
                head = attributes
            elif event == "start" and tag in {"msg_class", "class"}:
                within = attributes.get("name", "")
            elif event == "end" and tag == "message":
                if within.startswith("telemetry") and attributes.get("name") in WANTED:
                    messages[attributes["name"]] = [_field(_attributes(child)) for child in element.iter("field")]
                element.clear()
    except ParseError as error:
        offset = _offset(data, *error.position)
        damage.add(offset, len(data) - offset, f"{path.name}: what follows is not read: {error.msg}")
    except (DefusedXmlException, ValueError) as error:
        raise FileError(f"{path}: cannot be read: {error}") from error
    if not messages:
        at = f" before the damage at byte {damage.pieces[0].offset}" if damage.pieces else ""
        raise FileError(f"{path}: a Paparazzi log that defines no message of a flight{at}")
    return _Definitions(messages, head.get("data_file", ""), _date(head.get("time_of_day", ""))), damage


def _attributes(element: Any) -> dict[str, str]:  # noqa: ANN401 - an element of defusedxml, which has no types
    """Attributes; logs before 2010 have some of their names in capitals."""
    return {name.lower(): value for name, value in element.attrib.items()}


def _offset(data: bytes, line: int, column: int) -> int:
    at = 0
    for _ in range(line - 1):
        at = data.find(b"\n", at) + 1
    return min(at + column, len(data))


def _date(text: str) -> int:
    try:
        start = float(text) * 1e6
    except ValueError:
        return 0
    return round(start) if EARLIEST < start < LATEST else 0


def _field(attributes: Mapping[str, str]) -> _Field:
    kind = attributes.get("type", "")
    return _Field(
        name=attributes.get("name", ""),
        is_text=kind in {"char[]", "string"} or kind.startswith("char["),
        is_array=kind.endswith("]"),
        factor=factor_of(attributes),
        values=tuple(attributes.get("values", "").split("|")),
    )


def factor_of(attributes: Mapping[str, str]) -> float:
    """Factor from what is in the data to SI units.

    Args:
        attributes: Of the field's definition.
    """
    unit, other = attributes.get("unit", ""), attributes.get("alt_unit", "")
    if unit in SI_FACTORS:
        return SI_FACTORS[unit]
    return _exact(attributes.get("alt_unit_coef", "1")) * SI_FACTORS.get(other, 1.0)


def _exact(text: str) -> float:
    """A coefficient; one that was rounded to two digits or more is the power of two that it was, also of a radian."""
    try:
        printed = Decimal(text)
        value, (_, digits, exponent) = float(printed), printed.as_tuple()
    except (InvalidOperation, OverflowError):
        return 1.0
    if not math.isfinite(value) or value <= 0.0 or not isinstance(exponent, int):
        return 1.0
    for base in (1.0, math.degrees(1.0)):
        near = base * 2.0 ** round(math.log2(value / base))
        if len(digits) > 1 and abs(near - value) <= 0.5 * 10.0**exponent:
            return near
    return value


class _Columns:
    """Samples of one message of one aircraft, as they come."""

    def __init__(self, fields: list[_Field]) -> None:
        self.fields = fields
        self.times: list[float] = []
        self.rows: list[list[Any]] = []

    def table(self) -> LogTable:
        """All of them, in SI units."""
        columns: dict[str, NDArray[Any]] = {}
        for field, column in zip(self.fields, zip(*self.rows, strict=True), strict=True):
            if field.is_text:
                columns[field.name] = np.array(column, np.object_)
            elif field.is_array:
                width = max(map(len, column))
                padded = np.array([one + [math.nan] * (width - len(one)) for one in column], np.float64)
                columns[field.name] = padded * field.factor
            else:
                with np.errstate(over="ignore"):
                    columns[field.name] = np.array(column, np.float64) * field.factor
        return LogTable(np.array(self.times, np.float64), columns)


def _read_pair(definitions: _Definitions, damage: DamageList, path: Path, data: bytes) -> ForeignFlight:
    damage.name = str(path)
    collected: dict[tuple[int, str], _Columns] = {}
    undefined: dict[str, int] = {}
    for at, line in _lines(data):
        words = line.split(None, 3)
        if len(words) < 3 or not words[1].isdigit():
            if line.strip() and not _DATA_LINE.match(line):
                damage.add(at, len(line), "a line that is no message")
            continue
        name = words[2].decode("latin-1")
        if name not in definitions.messages:
            if name in WANTED:
                undefined.setdefault(name, at)
            continue
        fields = definitions.messages[name]
        sample = _sample(fields, words[3] if len(words) > 3 else b"") if line.endswith(b"\n") else None
        time = _number(words[0])
        if sample is None or time is None:
            damage.add(at, len(line), "a line that is not as defined" if line.endswith(b"\n") else "the file was cut")
            continue
        columns = collected.setdefault((int(words[1]), name), _Columns(fields))
        columns.times.append(time)
        columns.rows.append(sample)
    for name, at in undefined.items():
        damage.add(at, 0, f"{name} is not defined in the .log")
    tables = cleaned({key: columns.table() for key, columns in collected.items()}, damage, len(data))
    aircraft = sorted({number for number, _ in tables})
    told = [
        _told(
            min(max(number, 1), 255),
            {name: table for (one, name), table in tables.items() if one == number},
            definitions,
        )
        for number in aircraft
    ]
    return ForeignFlight("Paparazzi log", told, len(data), damage.pieces, definitions.start_usec)


def _lines(data: bytes) -> Iterator[tuple[int, bytes]]:
    at, file = 0, BytesIO(data)
    while line := file.readline(MAX_LINE):
        yield at, line
        at += len(line)


def _number(text: bytes) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _sample(fields: Sequence[_Field], text: bytes) -> list[Any] | None:
    """Values of a line's fields; None if they are not as defined."""
    words = text.split(None, len(fields) - 1) if fields and fields[-1].is_text else text.split()
    if len(words) != len(fields):
        return None
    sample: list[Any] = []
    for field, word in zip(fields, words, strict=True):
        if field.is_text:
            sample.append(word.decode("latin-1").strip().strip('"'))
            continue
        try:
            sample.append([float(one) for one in word.split(b",")] if field.is_array else float(word))
        except ValueError:
            return None
    return sample


def _told(system: int, tables: Mapping[str, LogTable], definitions: _Definitions) -> VehicleMessages:
    def most(names: Sequence[str], *fields: str) -> LogTable:
        """The table with the most samples of those that have some fields."""
        having = [tables[name] for name in names if name in tables and tables[name].has(*fields)]
        return max(having, key=lambda table: len(table.times), default=EMPTY_TABLE)

    vehicle = VehicleMessages(system, VehicleKind(int(mavlink.MAV_AUTOPILOT_PPZ), int(mavlink.MAV_TYPE_GENERIC)))
    _tell_imu(vehicle, most(GYROS, "gp", "gq", "gr"), most(ACCELEROMETERS, "ax", "ay", "az"))
    hover = most(["ROTORCRAFT_FP"], "east", "north", "up", "veast", "vnorth", "vup", "phi", "theta", "psi")
    _tell_attitude(vehicle, tables, hover)
    filtered = most(["INS"], "ins_x", "ins_y", "ins_z", "ins_xd", "ins_yd", "ins_zd")
    if len(filtered.times) >= len(hover.times) > 0 or (len(filtered.times) and not len(hover.times)):
        positions = filtered.stack("ins_x", "ins_y", "ins_z")
        vehicle.motion(filtered.times, positions, filtered.stack("ins_xd", "ins_yd", "ins_zd"))
    elif len(hover.times):
        down = np.array([1.0, 1.0, -1.0])
        positions, velocities = hover.stack("north", "east", "up"), hover.stack("vnorth", "veast", "vup")
        vehicle.motion(hover.times, positions * down, velocities * down)
    _tell_place(vehicle, most(RECEIVERS, "lat", "lon", "hmsl"), most(["GPS"], "utm_east", "utm_north", "utm_zone"))
    commanded, pulses = most(COMMANDED, "u"), most(["ACTUATORS"], "values")
    if len(commanded.times) and commanded.columns["u"].ndim == 2:
        vehicle.outputs(commanded.times, commanded.columns["u"] / FULL_SCALE)
    if len(pulses.times) and pulses.columns["values"].ndim == 2:
        vehicle.pulses(pulses.times, pulses.columns["values"])
    battery, air = most(["ENERGY", "BAT"], "voltage"), most(["AIRSPEED", "AIR_DATA"], "airspeed")
    if len(battery.times):
        vehicle.battery(battery.times, battery.columns["voltage"], battery.columns.get("current"))
    if len(air.times):
        known = air.where(air.columns["airspeed"] >= 0.0)  # -1 without a tube
        vehicle.airspeed(known.times, known.columns["airspeed"])
    _tell_state_and_texts(vehicle, tables, definitions)
    return vehicle


def _tell_place(vehicle: VehicleMessages, receiver: LogTable, projected: LogTable) -> None:
    """Places by satellites: rotorcraft send GPS_INT, fixed wings GPS, in UTM; without a fix they hold any numbers."""
    receiver, projected = _fixed(receiver), _fixed(projected)
    if len(receiver.times):
        places = receiver.stack("lat", "lon", "hmsl")
        places[:, :2] = np.degrees(places[:, :2])
        vehicle.place(receiver.times, places, places[:, 2] - places[0, 2])
    elif projected.has("alt", "speed", "course", "climb"):
        alt, speed, course, climb = projected.stack("alt", "speed", "course", "climb").T
        lat, lon = from_utm(*projected.stack("utm_east", "utm_north", "utm_zone").T)
        velocities = np.stack([speed * np.cos(course), speed * np.sin(course), -climb], axis=1)
        vehicle.place(projected.times, np.stack([lat, lon, alt], axis=1), alt - alt[0], velocities)


def _fixed(receiver: LogTable) -> LogTable:
    """Samples with a fix in three dimensions; all if the message does not tell."""
    field = next((name for name in ("fix", "mode") if receiver.has(name)), None)
    return receiver if field is None else receiver.where(receiver.columns[field] >= FIX_3D)


def _tell_imu(vehicle: VehicleMessages, gyro: LogTable, accelerometer: LogTable) -> None:
    """Both of the sensors that were logged first, at the gyro's times."""
    gyro, accelerometer = _first_sensor(gyro), _first_sensor(accelerometer)
    if len(gyro.times) and len(accelerometer.times):
        force = accelerometer.stack("ax", "ay", "az")
        at = [np.interp(gyro.times, accelerometer.times, column) for column in force.T]
        vehicle.imu(gyro.times, gyro.stack("gp", "gq", "gr"), np.stack(at, axis=1))


def _first_sensor(table: LogTable) -> LogTable:
    return table.where(table.columns["id"] == table.columns["id"][0]) if table.has("id") else table


def _tell_attitude(vehicle: VehicleMessages, tables: Mapping[str, LogTable], hover: LogTable) -> None:
    """The attitude that was logged most often."""
    parts = ("body_qi", "body_qx", "body_qy", "body_qz")
    whole = [tables[name] for name in QUATERNIONS if name in tables and tables[name].has(*parts)]
    found = [(table.times, table.stack(*parts)) for table in whole]
    for table in (*(tables.get(name, EMPTY_TABLE) for name in EULER_ANGLES), hover):
        fields = ("phi", "theta", "psi") if table.has("phi") else ("body_phi", "body_theta", "body_psi")
        if table.has(*fields):
            found.append((table.times, quaternions_of(table.stack(*fields))))
    if found:
        vehicle.attitude(*max(found, key=lambda one: len(one[0])))


def _tell_state_and_texts(vehicle: VehicleMessages, tables: Mapping[str, LogTable], definitions: _Definitions) -> None:
    """Arming, and the names of modes as texts: HEARTBEAT has but their numbers."""
    said = tables.get("INFO_MSG", EMPTY_TABLE)
    texts = list(zip(said.times.tolist(), said.columns["msg"].tolist(), strict=True)) if said.has("msg") else []
    name = next((name for name in MODES if tables.get(name, EMPTY_TABLE).has("ap_mode")), None)
    if name is not None:
        status = tables[name]
        modes = np.nan_to_num(status.columns["ap_mode"]).astype(np.int64)
        motors = status.columns.get("ap_motors_on", np.zeros(len(modes)))
        vehicle.state(status.times, modes, motors > 0.0)
        names = next(field.values for field in definitions.messages[name] if field.name == "ap_mode")
        for at in np.flatnonzero(np.diff(modes, prepend=modes[0] - 1)).tolist():
            mode = int(modes[at])
            texts.append((float(status.times[at]), f"mode {names[mode] if 0 <= mode < len(names) else mode}"))
    texts.sort(key=lambda one: one[0])
    severities = [int(mavlink.MAV_SEVERITY_INFO)] * len(texts)
    vehicle.texts(np.array([time for time, _ in texts]), severities, [text for _, text in texts])
