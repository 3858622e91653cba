"""Faults that last after the pilot has seen their alerts: instruments that do not work, failures not healed yet.

They stay in the header in a quiet form until the vehicle tells their end.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import RESTARTED, sensor_names
from darko_gcs.state.values import Alert, LogLine
from protocol.dialect import mavlink

INJECTED = re.compile(r"Failure injected: (?P<unit>.+) (?P<how>\w+)$")
LEFT_OUT = re.compile(r"Flying without (?P<unit>.+)$")
HEALED = re.compile(r"Healed: (?P<unit>.+)$")
ENDS = (HEALED, re.compile(r"(?P<unit>.+) is back$"))
UNTOLD = frozenset({"estimator"})  # watched kinds that no other sign of the header shows
INSTRUMENTS = {  # short names, as the vehicle's texts have them
    mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE: "pitot",
    mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE: "barometer",
    mavlink.MAV_SYS_STATUS_SENSOR_GPS: "GNSS",
    mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG: "magnetometer",
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO: "gyroscope",
    mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL: "accelerometer",
}
SHORT = {"pitot tube": "pitot"}


def lasting_faults(s: Snapshot) -> tuple[str, ...]:
    """Names of what does not work though no alert calls: ("pitot off", "motor 1 off", "!ahrs"); the seen ones first."""
    faults: dict[str, str] = {}
    for alert in s.session.seen:
        unit, how = _fault(alert)
        faults.setdefault(unit, how)
    for bit in (1 << k for k in range(32) if s.status.unhealthy >> k & 1):
        if bit in INSTRUMENTS:
            faults.setdefault(INSTRUMENTS[bit], "off")
        else:
            faults.setdefault(f"!{sensor_names(bit)[0]}", "")
    return tuple(f"{unit} {how}".rstrip() for unit, how in faults.items())


def can_last(alert: Alert) -> bool:
    """Whether an alert that the pilot has seen has an end that will be noticed, and no other sign till then."""
    is_told = INJECTED.match(alert.text) or LEFT_OUT.match(alert.text)
    return alert.over is None and (alert.kind in UNTOLD or (alert.kind == "failure" and bool(is_told)))


def without_ended(seen: Sequence[Alert], news: Iterable[LogLine]) -> tuple[Alert, ...]:
    """The seen alerts whose end newer lines of the log do not tell."""
    lasting = tuple(seen)
    for line in news:
        if line.text.lower() == RESTARTED:
            lasting = tuple(alert for alert in lasting if alert.kind in UNTOLD)
        ended = next(filter(None, (end.match(line.text) for end in ENDS)), None)
        if ended is not None:
            lasting = tuple(alert for alert in lasting if not _is_of(alert, ended["unit"]))
    return lasting


def _is_of(alert: Alert, unit: str) -> bool:
    """Whether an alert is about a unit; "motors" are all of them."""
    name, mine = unit.lower(), _unit(alert).lower()
    return mine == name or (name.endswith("s") and mine.startswith(name[:-1] + " "))


def _unit(alert: Alert) -> str:
    found = INJECTED.match(alert.text) or LEFT_OUT.match(alert.text)
    return alert.kind if found is None else found["unit"]


def _fault(alert: Alert) -> tuple[str, str]:
    """Short name of the unit, and how it fails; of a watched kind its name alone."""
    unit, injected = _unit(alert), INJECTED.match(alert.text)
    how = "" if alert.kind in UNTOLD else injected["how"] if injected is not None else "off"
    return SHORT.get(unit, unit), how
