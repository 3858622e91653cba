"""Instruments whose single errors are switched on one by one, and a filter beside them, as plain Python takes them."""

from typing import Any

import numpy as np

from sitl.design.gains import wind_gains
from sitl.estimation.filter import MAX_HORIZON, Step, filter_settings, new_filter
from sitl.model.airframe_files import load
from sitl.model.vectors import Vector
from sitl.sensors.draws import Timing
from sitl.sensors.instruments import HiddenErrors, SensorSet, instruments
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.sensed import Aboard
from sitl.storage import record_of, record_type, zero

ZERO = Vector(0.0, 0.0, 0.0)
NO_ERRORS = zero(HiddenErrors)
SHIPPED, WANDERING = load_sensors(), load_sensors("truthful")
NOMINAL = load("nominal").parameters
FINE = 1e-9  # of what is not rounded
KEPT = {
    "timing", "range", "field_north", "field_west", "field_up", "drift_time", "noise_time", "lag", "imu_attitude",
}  # fmt: skip
AT_CENTRE = {"imu": ZERO, "antenna": ZERO}
OFTEN = {"step": FINE, "servo_rate": 1000.0, "motor_rate": 1000.0}


def ideal(timing=None):
    """Instruments without any error, which read as often as the shipped ones or as is given."""
    parts = {}
    for name, part in SHIPPED._asdict().items():
        changed: dict[str, Any] = {key: (OFTEN | AT_CENTRE).get(key, 0.0) for key in part._fields if key not in KEPT}
        if "timing" in part._fields:
            changed["timing"] = timing or Timing(part.timing.rate, 0.0, 0.0, 0.0)
        parts[name] = part._replace(**changed)
    return SensorSet(**parts)


def aboard(specification=None, errors=NO_ERRORS, *, arena=False, assumed=None):
    """A vehicle's instruments, filter, and the steps that the filter keeps, as plain Python takes them for records.

    Args:
        specification: Of the instruments; ideal by default.
        errors: Hidden ones.
        arena: Whether motion capture aids it.
        assumed: What the filter assumes of the instruments; as shipped by default.
    """
    settings = filter_settings(assumed or SHIPPED, wind_gains(), arena=arena)
    read = instruments(specification or ideal(), errors)
    kept = _folders(record_of(Aboard, Aboard(read, new_filter(settings, NOMINAL)))[0])
    return kept["instruments"], kept["filter"], [_folders(step) for step in np.zeros(MAX_HORIZON, record_type(Step))]


class Folder(dict[str, Any]):
    """A record that plain Python reads and writes much faster; its arrays are the record's own."""

    __slots__ = ("dtype",)
    dtype: np.dtype[Any]

    def __getattr__(self, name):
        return self[name]


def _folders(record):
    """A record as folders."""
    if isinstance(record, np.void):
        folder = Folder({name: _folders(record[name]) for name in record.dtype.names or ()})
        folder.dtype = record.dtype
        return folder
    return record if isinstance(record, np.ndarray) else record.item()


def numbers(folder):
    """All numbers of a vector or the like in dictionaries, in order."""
    return [number for part in folder.values() for number in (numbers(part) if isinstance(part, dict) else [part])]
