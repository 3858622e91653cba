"""A flight of three seconds as PX4, ArduPilot and Paparazzi would have logged it, written byte by byte."""

import math
import struct

import numpy as np

RATE, SECONDS = 50, 3.0
BOOT = 12.0  # when the log begins, since the vehicle was switched on [s]
HOME = (43.5, 1.5, 150.0)  # [deg, deg, m]
UTC = 1_790_000_000  # at the log's begin [s since 1970]
RADIUS, TURN = 20.0, 0.4  # of the circle flown [m], [rad/s]
RATES, FORCE = (0.1, -0.2, 0.4), (0.5, -1.0, -9.5)  # body FRD [rad/s], [m/s2]
ROLL, PITCH = 0.2, -0.1  # [rad]
PULSES = (1100.0, 1200.0, 1500.0, 1600.0)  # [us]
OUTPUTS = (0.25, 0.5, -0.25, 0.75)
VOLTAGE, CURRENT = 11.5, 7.25


def instants():
    return np.arange(round(SECONDS * RATE)) / RATE


def place(t):
    """Position and velocity NED."""
    a = TURN * t
    return (
        (RADIUS * math.cos(a), RADIUS * math.sin(a), -30.0),
        (-RADIUS * TURN * math.sin(a), RADIUS * TURN * math.cos(a), 0.0),
    )


def yaw(t):
    return 0.5 + TURN * t


def quaternion(roll, pitch, heading):
    """ZYX, by rotation of one axis after the other."""
    w, x, y, z = 1.0, 0.0, 0.0, 0.0
    for axis, angle in ((3, heading), (2, pitch), (1, roll)):
        c, s = math.cos(angle / 2), math.sin(angle / 2)
        q = [c, 0.0, 0.0, 0.0]
        q[axis] = s
        w, x, y, z = (
            w * q[0] - x * q[1] - y * q[2] - z * q[3],
            w * q[1] + x * q[0] + y * q[3] - z * q[2],
            w * q[2] - x * q[3] + y * q[0] + z * q[1],
            w * q[3] + x * q[2] - y * q[1] + z * q[0],
        )
    return w, x, y, z


# ULog


ULOG_TOPICS = {  # fields, letters of struct
    "vehicle_attitude": ("uint64_t timestamp;float[4] q;uint8_t[4] _padding0;", "4f4x"),
    "sensor_combined": ("uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;", "6f"),
    "vehicle_local_position": (
        "uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;uint8_t[2] _padding0;", "6f2x",
    ),
    "actuator_motors": ("uint64_t timestamp;float[12] control;", "12f"),
    "actuator_servos": ("uint64_t timestamp;float[8] control;", "8f"),
    "battery_status": ("uint64_t timestamp;float voltage_v;float current_a;float remaining;", "3f"),
    "vehicle_status": (
        "uint64_t timestamp;uint8_t arming_state;uint8_t nav_state;bool is_vtol;bool is_vtol_tailsitter;", "4B",
    ),
    "vehicle_gps_position": ("uint64_t timestamp;uint64_t time_utc_usec;", "Q"),
    "airspeed_validated": ("uint64_t timestamp;float calibrated_airspeed_m_s;", "f"),
}  # fmt: skip


def ulog_message(letter, body):
    return struct.pack("<HB", len(body), ord(letter)) + body


def ulog(topics=ULOG_TOPICS):
    """The flight as a ULog file."""
    parts = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", round(BOOT * 1e6)), ulog_message("B", bytes(40))]
    parts.append(ulog_message("I", b"\x10char[3] sys_name" + b"PX4"))
    parts += [ulog_message("F", f"{name}:{fields}".encode()) for name, (fields, _) in topics.items()]
    parts.append(ulog_message("F", b"cpuload:uint64_t timestamp;float load;"))
    names = [*topics, "cpuload"]
    parts += [ulog_message("A", struct.pack("<BH", 0, number) + name.encode()) for number, name in enumerate(names)]
    parts.append(ulog_message("L", b"4" + struct.pack("<Q", round(BOOT * 1e6)) + b"gentle breeze"))
    for k, t in enumerate(instants().tolist()):
        position, velocity = place(t)
        rows = {
            "vehicle_attitude": quaternion(ROLL, PITCH, yaw(t)),
            "sensor_combined": (*RATES, *FORCE),
            "vehicle_local_position": (*position, *velocity),
            "actuator_motors": (*OUTPUTS[:2], *[math.nan] * 10),
            "actuator_servos": (*OUTPUTS[2:], *[math.nan] * 6),
        }
        if k % RATE == 0:
            rows |= {
                "battery_status": (VOLTAGE, CURRENT, 0.5),
                "vehicle_status": (2 if t >= 1.0 else 1, 4, 1, 1),
                "vehicle_gps_position": (round((UTC + t) * 1e6),),
                "airspeed_validated": (8.0,),
            }
        parts.append(ulog_message("D", struct.pack("<HQf", len(topics), round((BOOT + t) * 1e6), 0.5)))
        for name, values in rows.items():
            if name in topics:
                body = _ulog_data(names.index(name), t, topics[name][1], values)
                parts.append(ulog_message("D", body))
    parts.append(ulog_message("S", bytes.fromhex("2f731320250cbb12")))
    return b"".join(parts)


def _ulog_data(number, t, letters, values):
    return struct.pack("<HQ" + letters, number, round((BOOT + t) * 1e6), *values)


# DataFlash


DATAFLASH_KINDS = {  # by type: name, letters, columns, units, multipliers
    1: ("UNIT", "QbZ", "TimeUS,Id,Label", "s--", "F--"),
    2: ("MULT", "Qbd", "TimeUS,Id,Mult", "s--", "F--"),
    3: ("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "s---", "F---"),
    4: ("ATT", "QccccC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,Yaw", "sddddh", "FBBBBB"),
    5: ("IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "s#EEEooo", "F-000000"),
    6: ("XKF1", "QBffffff", "TimeUS,C,PN,PE,PD,VN,VE,VD", "s#mmmnnn", "F-000000"),
    7: ("POS", "QLLff", "TimeUS,Lat,Lng,Alt,RelHomeAlt", "sDUmm", "FGG00"),
    8: ("RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4", "sYYYY", "F----"),
    9: ("BAT", "QffB", "TimeUS,Volt,Curr,RemPct", "svA%", "F00-"),
    10: ("MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn", "s---", "F---"),
    11: ("ARM", "QB", "TimeUS,ArmState", "s-", "F-"),
    12: ("MSG", "QZ", "TimeUS,Message", "s-", "F-"),
    13: ("GPS", "QBIHfff", "TimeUS,I,GMS,GWk,Spd,GCrs,VZ", "s#s-nhn", "F-C-000"),
}
DATAFLASH_UNITS = {"s": "s", "d": "deg", "h": "degheading", "E": "rad/s", "o": "m/s/s", "m": "m", "n": "m/s",
                   "D": "deglatitude", "U": "deglongitude", "Y": "us", "v": "V", "A": "A", "%": "%"}  # fmt: skip
DATAFLASH_SCALES = {"-": 0.0, "?": 1.0, "0": 1.0, "B": 1e-2, "C": 1e-3, "F": 1e-6, "G": 1e-7}
LETTERS = {"n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "L": "i", "M": "b"}


def dataflash_record(number, letters, *values):
    packed = [value.encode() if isinstance(value, str) else value for value in values]
    return bytes([0xA3, 0x95, number]) + struct.pack("<" + "".join(LETTERS.get(c, c) for c in letters), *packed)


def dataflash_format(number, name, letters, columns):
    length = 3 + struct.calcsize("<" + "".join(LETTERS.get(c, c) for c in letters))
    return dataflash_record(0x80, "BBnNZ", number, length, name, letters, columns)


def dataflash(*, units=True):
    """The flight as a DataFlash file; without units as it was written before 2018."""
    kinds = {number: kind for number, kind in DATAFLASH_KINDS.items() if units or number > 3}
    parts = [dataflash_format(0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")]
    parts += [dataflash_format(number, *kind[:3]) for number, kind in kinds.items()]
    if units:
        parts += [dataflash_record(1, "QbZ", 0, ord(mark), unit) for mark, unit in DATAFLASH_UNITS.items()]
        parts += [dataflash_record(2, "Qbd", 0, ord(mark), scale) for mark, scale in DATAFLASH_SCALES.items()]
        parts += [dataflash_record(3, "QBNN", 0, number, kind[3], kind[4]) for number, kind in kinds.items()]

    def add(number, t, *values):
        parts.append(dataflash_record(number, DATAFLASH_KINDS[number][1], round((BOOT + t) * 1e6), *values))

    add(12, 0.0, "ArduPlane V4.5.0")
    for k, t in enumerate(instants().tolist()):
        (north, east, down), velocity = place(t)
        roll, pitch, heading = (round(100 * math.degrees(angle)) for angle in (ROLL, PITCH, yaw(t) % math.tau))
        add(4, t, 0, roll, 0, pitch, heading)
        add(5, t, 0, *RATES, *FORCE)
        add(5, t, 1, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0)  # another sensor
        add(6, t, 0, north, east, down, *velocity)
        lat = HOME[0] + math.degrees(north / 6_371_000.0)
        add(7, t, round(1e7 * lat), round(1e7 * HOME[1]), HOME[2] - down, -down)
        add(8, t, *map(round, PULSES))
        if k % RATE == 0:
            add(9, t, VOLTAGE, CURRENT, 50)
            add(11, t, int(t >= 1.0))
            add(10, t, 10, 10, 1)
            gps = UTC + t - 315_964_800 + 18
            speed, course = math.hypot(*velocity[:2]), math.degrees(math.atan2(velocity[1], velocity[0]))
            add(13, t, 0, round(1e3 * (gps % 604_800)), int(gps // 604_800), speed, course, velocity[2])
    return b"".join(parts)


# Paparazzi


ANGLE = 'alt_unit="deg" alt_unit_coef="0.0139882"'
PLACE, SPEED = 'alt_unit="m" alt_unit_coef="0.0039063"', 'alt_unit="m/s" alt_unit_coef="0.0000019"'
TURNING, PULL = 'alt_unit="deg/s" alt_unit_coef="0.0139882"', 'alt_unit="m/s2" alt_unit_coef="0.0009766"'
PAPARAZZI_MESSAGES = {
    "IMU_GYRO_SCALED": [("id", "uint8", ""), *((n, "int32", TURNING) for n in ("gp", "gq", "gr"))],
    "IMU_ACCEL_SCALED": [("id", "uint8", ""), *((n, "int32", PULL) for n in ("ax", "ay", "az"))],
    "AHRS_REF_QUAT": [(f"{a}_q{b}", "int32", "") for a in ("ref", "body") for b in "ixyz"],
    "ROTORCRAFT_FP": [
        *((n, "int32", PLACE) for n in ("east", "north", "up")),
        *((n, "int32", SPEED) for n in ("veast", "vnorth", "vup")),
        *((n, "int32", ANGLE) for n in ("phi", "theta", "psi")),
    ],
    "ACTUATORS": [("values", "int16[]", "")],
    "ENERGY": [("throttle", "uint8", 'unit="%"'), ("voltage", "float", 'unit="V"'), ("current", "float", 'unit="A"')],
    "ROTORCRAFT_STATUS": [("ap_mode", "uint8", 'values="KILL|FAILSAFE|HOME|NAV"'), ("ap_motors_on", "uint8", "")],
    "INFO_MSG": [("msg", "char[]", "")],
    "GPS_INT": [("lat", "int32", 'unit="1e7deg"'), ("lon", "int32", 'unit="1e7deg"'), ("hmsl", "int32", 'unit="mm"')],
}  # fmt: skip


def paparazzi_log(data_file="flight.data", messages=PAPARAZZI_MESSAGES):
    """The .log: definitions."""
    lines = [
        f'<configuration time_of_day="{UTC}.5" data_file="{data_file}">',
        ' <conf><aircraft name="Darko" ac_id="12"/></conf>',
    ]
    lines += [
        " <protocol>",
        '  <msg_class name="ground" id="2"><message name="INFO_MSG" id="1"/></msg_class>',
        '  <msg_class name="telemetry" id="1">',
    ]
    for name, fields in messages.items():
        lines.append(f'   <message name="{name}" id="1">')
        lines += [f'    <field name="{field}" type="{kind}" {rest}/>' for field, kind, rest in fields]
        lines.append("   </message>")
    return "\n".join([*lines, "  </msg_class>", " </protocol>", "</configuration>", ""]).encode()


def paparazzi_data():
    """The .data: lines."""
    lines = []

    def add(t, name, *values):
        words = [",".join(map(str, value)) if isinstance(value, tuple) else str(value) for value in values]
        lines.append(f"{BOOT + t:.4f} 12 {name} {' '.join(words)}")

    lines.append("11.9000 ground WORLD_ENV 0 0 0")
    lines.append("11.9500 12 ALIVE 1,2,3")
    add(0.0, "INFO_MSG", '"gentle breeze"')
    for k, t in enumerate(instants().tolist()):
        (north, east, down), (vn, ve, vd) = place(t)
        add(t, "IMU_GYRO_SCALED", 0, *(round(x * 4096) for x in RATES))
        add(t, "IMU_ACCEL_SCALED", 0, *(round(x * 1024) for x in FORCE))
        q = [round(x * 32768) for x in quaternion(ROLL, PITCH, yaw(t))]
        add(t, "AHRS_REF_QUAT", 0, 0, 0, 0, *q)
        places = [round(x * 256) for x in (east, north, -down)]
        speeds = [round(x * 2**19) for x in (ve, vn, -vd)]
        if k % 2 == 0:
            add(t, "ROTORCRAFT_FP", *places, *speeds, *(round(x * 4096) for x in (ROLL, PITCH, yaw(t))))
        add(t, "ACTUATORS", tuple(map(round, PULSES)))
        if k % RATE == 0:
            add(t, "ENERGY", 50, VOLTAGE, CURRENT)
            add(t, "ROTORCRAFT_STATUS", 3, int(t >= 1.0))
            add(t, "GPS_INT", round(HOME[0] * 1e7), round(HOME[1] * 1e7), round(1e3 * (HOME[2] + 30.0)))
    return ("\n".join(lines) + "\n").encode()


def write_pair(folder, log=None, data=None):
    """Both files of Paparazzi, and the path of the .log."""
    (folder / "flight.data").write_bytes(paparazzi_data() if data is None else data)
    path = folder / "flight.log"
    path.write_bytes(paparazzi_log() if log is None else log)
    return path
