"""The navigation filter as files of C: what it keeps aboard, and one control period around it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from sitl.control.estimate import Estimate
from sitl.control.wind_estimator import WindGains
from sitl.estimation.filter import (
    MAX_HORIZON,
    RUNNING,
    Filter,
    FilterSettings,
    Step,
    filter_settings,
    new_filter,
    put_ahead,
)
from sitl.estimation.navigator import navigate
from sitl.estimation.strapdown import joined, no_increment
from sitl.export.c_program import Program
from sitl.export.c_types import ArrayKind, ExportError, Kind, Types, identifier
from sitl.export.flat import copied, record_copied
from sitl.export.initial_values import initialiser
from sitl.export.templates import template
from sitl.model.airframe import Airframe, Array
from sitl.model.state import Actuators
from sitl.model.vectors import Vector
from sitl.sensors import instruments as simulated
from sitl.sensors.draws import SLOW_PERIODS
from sitl.sensors.instruments import (
    FIRST_DELAYED,
    N_DELAYED,
    QUEUE_LENGTH,
    READING_SIZE,
    Accelerometer,
    Barometer,
    Gnss,
    Gyroscope,
    Inertial,
    Magnetometer,
    Mounting,
    Pitot,
    send,
)
from sitl.sensors.sensor_files import load_sensors
from sitl.storage import Records, record_type, value_of, zero

# Aboard there are no errors to be simulated: of the instruments only what the filter looks at.


class SensorsAboard(NamedTuple):
    """Instruments as the filter takes them to be."""

    gyroscope: Gyroscope
    accelerometer: Accelerometer
    magnetometer: Magnetometer
    barometer: Barometer
    gnss: Gnss
    pitot: Pitot
    mounting: Mounting


class InstrumentsAboard(NamedTuple):
    """Readings on their way to the filter; lines are queues, by instrument less FIRST_DELAYED."""

    specification: SensorsAboard
    inertial: Inertial  # the last reading
    sampled: Array  # control period of a reading, (LINES, LINE)
    arrives: Array  # control period of its arrival, (LINES, LINE)
    readings: Array  # (LINES, LINE, READING)
    first: Array  # the oldest reading, (LINES,)
    waiting: Array  # readings in the line, (LINES,)
    last: Array  # the newest reading, (LINES, READING)


class NavigationSettings(NamedTuple):
    """Settings of the filter, and what it is told of the instruments."""

    settings: FilterSettings
    specification: SensorsAboard


INSTEAD: dict[type, type] = {simulated.SensorSet: SensorsAboard, simulated.Instruments: InstrumentsAboard}
_GIVEN = {"settings", "model", "support", "support_of_late"}  # to a new filter, by what it is told
_NUMBERS = {
    "magnetometer": simulated.MAGNETOMETER,
    "barometer": simulated.BAROMETER,
    "gnss": simulated.GNSS,
    "pitot": simulated.PITOT,
    "motion_capture": simulated.MOTION_CAPTURE,
    "external_pose": simulated.EXTERNAL_POSE,
    "first_delayed": FIRST_DELAYED,
    "reading_size": READING_SIZE,
    "queue_length": QUEUE_LENGTH,
    "max_horizon": MAX_HORIZON,
    "lines": N_DELAYED,
}


def navigation_of(sensors: simulated.SensorSet, wind: WindGains, *, arena: bool) -> NavigationSettings:
    """Settings for instruments; arguments as of :func:`sitl.estimation.filter.filter_settings`."""
    return NavigationSettings(filter_settings(sensors, wind, arena=arena), _aboard(sensors))


def _aboard(sensors: simulated.SensorSet) -> SensorsAboard:
    return SensorsAboard(*(getattr(sensors, name) for name in SensorsAboard._fields))


def record_layouts() -> dict[type, Any]:
    """Numpy's types of the simulator's records, which the exported filter reads and writes in the loop."""
    sensors = load_sensors()
    told = filter_settings(sensors, zero(WindGains), arena=False)
    carried = simulated.instruments(sensors, zero(simulated.HiddenErrors))
    return {
        Filter: record_type(Filter, new_filter(told, zero(Airframe))),
        InstrumentsAboard: record_type(simulated.Instruments, carried),
        Step: record_type(Step),
    }


def record_places(layouts: dict[type, Any]) -> dict[str, int]:
    """Places in records of what the loop hands over, and their sizes [bytes], by the template's words."""
    return {
        "@covariance_offset@": layouts[Filter].fields["covariance"][1],
        "@readings_offset@": layouts[InstrumentsAboard].fields["readings"][1],
        "@filter_bytes@": layouts[Filter].itemsize,
        "@instruments_bytes@": layouts[InstrumentsAboard].itemsize,
        "@step_bytes@": layouts[Step].itemsize,
    }


def new_instruments(navigation: NavigationSettings) -> InstrumentsAboard:
    """Instruments that have read nothing yet."""
    still, lines = Vector(0.0, 0.0, 0.0), (N_DELAYED, QUEUE_LENGTH)
    return InstrumentsAboard(
        specification=navigation.specification,
        inertial=Inertial(still, still),
        sampled=np.zeros(lines),
        arrives=np.zeros(lines),
        readings=np.zeros((*lines, READING_SIZE)),
        first=np.zeros(N_DELAYED),
        waiting=np.zeros(N_DELAYED),
        last=np.zeros((N_DELAYED, READING_SIZE)),
    )


def regather(f: Filter, steps: Records, period: int) -> None:
    """Make anew, of its steps, the stretch that leads from the horizon to now.

    It is joined and taken off again without end. In doubles that loses nothing that could be seen; in floats half an
    hour of it would be metres.

    Args:
        f: The filter, at the end of a control period.
        steps: As it keeps them.
        period: Control periods flown.
    """
    if f.phase != RUNNING or f.oldest != 0 or period % SLOW_PERIODS != 0:
        return
    ahead = no_increment()
    for k in range(f.filled):
        ahead = joined(ahead, value_of(steps[k].increment))
    put_ahead(f, ahead)


class EstimatorExport:
    """The estimator's part of an export.

    Args:
        program: What the controller's functions are translated in, with kinds ``INSTEAD``.
        types: Its structs.
        navigation: What the estimator is told of its instruments.
        model: The airframe as the vehicle knows it.
    """

    def __init__(self, program: Program, types: Types, navigation: NavigationSettings, model: Airframe) -> None:
        self._program, self._types, self._navigation = program, types, navigation
        self._start = new_filter(navigation.settings, model)
        types.learn(self._start)
        types.learn(new_instruments(navigation))
        self._layouts = record_layouts()
        steps = ArrayKind((MAX_HORIZON,), Step)
        self._navigate = program.instance(navigate, (steps,))
        self._regather = program.instance(regather, (steps,)) if types.real == "float" else None
        self._send = program.instance(send)
        types.name(NavigationSettings)

    def files(self, title: str) -> dict[str, str]:
        """Files by name, besides those of the modules and of the structs."""
        return {
            "darko_estimator.h": self._filled("darko_estimator.h"),
            "darko_estimator.c": self._program.finished(self._source()),
            "darko_estimator_flat.c": self._flat(),
            "darko_navigation.h": self._settings(title),
        }

    def _filled(self, name: str) -> str:
        text = template(name)
        for word, number in _NUMBERS.items():
            text = text.replace(f"@{word}@", str(number))
        return text

    def _source(self) -> str:
        text = self._filled("darko_estimator.c").replace("@real@", self._types.real)
        for name, made in (("navigate", self._navigate), ("send", self._send)):
            text = text.replace(f"@{name}@", made.token)
        used = [part for part in (self._navigate, self._send, self._regather) if part is not None]
        call = f"    {self._regather.token}(f, estimator->steps, estimator->period);\n" if self._regather else ""
        text = text.replace("@regather@", call)
        stems = sorted({"filter", *(part.module.stem for part in used)})
        text = text.replace("@includes@", "\n".join(f'#include "{stem}.h"' for stem in stems))
        return text.replace("@start@", "\n".join(self._beginnings(Filter, self._start, "f->")))

    def _beginnings(self, kind: Kind, value: Any, place: str) -> Iterator[str]:  # noqa: ANN401
        """Lines that set what is not zero in a new filter."""
        settings = self._navigation.settings
        for (name, part), one in zip(self._types.fields(kind).items(), value, strict=True):
            here = f"{place}{identifier(name)}"
            if name in _GIVEN and kind is Filter:
                continue
            if self._types.is_struct(part):
                yield from self._beginnings(part, one, f"{here}.")
            elif not isinstance(part, ArrayKind):
                if one:
                    yield f"    {here} = {self._types.number(one)};"
            elif np.any(one):
                given = hasattr(settings, name) and np.array_equal(one, getattr(settings, name))
                if not given and np.ptp(one) > 0.0:
                    raise ExportError(f"a new filter's {name} has numbers of many kinds")
                number = f"f->settings.{identifier(name)}[k]" if given else self._types.number(float(one[0]))
                yield f"    for (int32_t k = 0; k < {len(one)}; ++k) {{"
                yield f"        {here}[k] = {number};"
                yield "    }"

    def _flat(self) -> str:
        text, types = self._filled("darko_estimator_flat.c"), self._types
        read: tuple[type, ...] = (Filter, InstrumentsAboard, Step, Inertial, Actuators)
        told: tuple[type, ...] = (Filter, Estimate)
        copies = [line for kind in read for line in copied(types, kind, to_struct=True)]
        copies += [line for kind in told for line in copied(types, kind, to_struct=False)]
        text = text.replace("@record_copies@", "\n".join(self._record_copies()))
        for word, number in record_places(self._layouts).items():
            text = text.replace(word, str(number))
        for kind in (*read, *told):
            text = text.replace(f"@{kind.__name__}@", str(types.leaves(kind)))
        return text.replace("@copies@", "\n".join(copies))

    def _record_copies(self) -> Iterator[str]:
        """Functions that copy between the simulator's records and structs; back only what the filter writes."""
        left = {
            Filter: ("settings", "model"),
            InstrumentsAboard: tuple(set(InstrumentsAboard._fields) - {"first", "waiting"}),
        }
        for kind, layout in self._layouts.items():
            for loads in (True, False):
                skipped = () if loads else left.get(kind, ())
                yield from record_copied(self._types, kind, layout, loads=loads, skipped=skipped)

    def _settings(self, title: str) -> str:
        lines = [f"/* What the estimator is told of its instruments: {title}. */"]
        lines += ["#ifndef DARKO_NAVIGATION_H", "#define DARKO_NAVIGATION_H", "", '#include "darko_types.h"', ""]
        lines += [f"static const {self._types.name(NavigationSettings)} darko_navigation = {{"]
        lines += initialiser(self._types, NavigationSettings, self._navigation, "    ")
        return "\n".join([*lines, "};", "", "#endif", ""])
