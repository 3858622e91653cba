"""DarkO simulated: model, control laws, hybrid supervisor, autopilot and its MAVLink face.

What is named here is the public API; :doc:`docs/api.md <api>` has worked examples. Loading a name loads the compiler.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sitl.tools.kernel_cache import use_source_keyed_cache

use_source_keyed_cache()

if TYPE_CHECKING:
    from protocol.dialect.vocabulary import Law, Limit, Reason, Regime, Saturation
    from sitl.autopilot.settings import Settings
    from sitl.compiled import kernel
    from sitl.control.estimate import Estimate
    from sitl.control.laws import LAWS, VALUES, LawRow, ValueRow
    from sitl.control.reference import (
        AttitudeReference,
        Path,
        Reference,
        along,
        at,
        circle,
        hover_at,
        leg,
        steer,
    )
    from sitl.errors import SitlError, UnknownLawError, ZenoError
    from sitl.model.airframe import Airframe, Array
    from sitl.model.airframe_files import load as load_airframe
    from sitl.model.quaternions import Quaternion
    from sitl.model.state import Actuators, Body, Plant
    from sitl.model.vectors import Vector
    from sitl.sensors.draws import PERIOD
    from sitl.sensors.instruments import SensorSet
    from sitl.sensors.sensor_files import load_sensors
    from sitl.simulation.avionics import Navigation
    from sitl.simulation.batch import fly_batch
    from sitl.simulation.dispatch import Register
    from sitl.simulation.flight_errors import DivergedError
    from sitl.simulation.recording import JumpRecord, Recording
    from sitl.simulation.simulation import Simulation
    from sitl.simulation.start import Start
    from sitl.simulation.tuning import Tuning
    from sitl.supervisor.guards import Guard, guard
    from sitl.supervisor.resets import Reset, reset
    from sitl.supervisor.table import TABLE, Jump
    from sitl.vehicle.aircraft import Aircraft
    from sitl.vehicle.parameters import Configuration, WorldSettings

_PLACES = {
    "protocol.dialect.vocabulary": ("Law", "Limit", "Reason", "Regime", "Saturation"),
    "sitl.model.airframe_files": ("load_airframe",),
    "sitl.autopilot.settings": ("Settings",),
    "sitl.compiled": ("kernel",),
    "sitl.control.estimate": ("Estimate",),
    "sitl.control.laws": ("LAWS", "VALUES", "LawRow", "ValueRow"),
    "sitl.control.reference": (
        "AttitudeReference",
        "Path",
        "Reference",
        "along",
        "at",
        "circle",
        "hover_at",
        "leg",
        "steer",
    ),
    "sitl.errors": ("SitlError", "UnknownLawError", "ZenoError"),
    "sitl.model.airframe": ("Airframe", "Array"),
    "sitl.model.quaternions": ("Quaternion",),
    "sitl.model.state": ("Actuators", "Body", "Plant"),
    "sitl.model.vectors": ("Vector",),
    "sitl.sensors.draws": ("PERIOD",),
    "sitl.sensors.sensor_files": ("load_sensors",),
    "sitl.sensors.instruments": ("SensorSet",),
    "sitl.simulation.avionics": ("Navigation",),
    "sitl.simulation.batch": ("fly_batch",),
    "sitl.simulation.dispatch": ("Register",),
    "sitl.simulation.recording": ("JumpRecord", "Recording"),
    "sitl.simulation.simulation": ("DivergedError", "Simulation", "Start"),
    "sitl.simulation.tuning": ("Tuning",),
    "sitl.supervisor.guards": ("Guard", "guard"),
    "sitl.supervisor.resets": ("Reset", "reset"),
    "sitl.supervisor.table": ("TABLE", "Jump"),
    "sitl.vehicle.aircraft": ("Aircraft",),
    "sitl.vehicle.parameters": ("Configuration", "WorldSettings"),
}
_NAMES = {name: module for module, names in _PLACES.items() for name in names}

__all__ = [
    "LAWS",
    "PERIOD",
    "TABLE",
    "VALUES",
    "Actuators",
    "Aircraft",
    "Airframe",
    "Array",
    "AttitudeReference",
    "Body",
    "Configuration",
    "DivergedError",
    "Estimate",
    "Guard",
    "Jump",
    "JumpRecord",
    "Law",
    "LawRow",
    "Limit",
    "Navigation",
    "Path",
    "Plant",
    "Quaternion",
    "Reason",
    "Recording",
    "Reference",
    "Regime",
    "Register",
    "Reset",
    "Saturation",
    "SensorSet",
    "Settings",
    "Simulation",
    "SitlError",
    "Start",
    "Tuning",
    "UnknownLawError",
    "ValueRow",
    "Vector",
    "WorldSettings",
    "ZenoError",
    "along",
    "at",
    "circle",
    "fly_batch",
    "guard",
    "hover_at",
    "kernel",
    "leg",
    "load_airframe",
    "load_sensors",
    "reset",
    "steer",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever is named
    if name not in _NAMES:
        raise AttributeError(f"module 'sitl' has no attribute {name!r}")
    return getattr(import_module(_NAMES[name]), "load" if name == "load_airframe" else name)


def __dir__() -> list[str]:
    return sorted((*globals(), *__all__))
