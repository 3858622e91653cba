"""The records of one flight as the compiled loop takes them, and calls of the loop on them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import nullcontext
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl.compiled import compile_part, compiling, is_compiled
from sitl.control.estimate import Estimate
from sitl.control.reference import Reference
from sitl.model.airframe import Airframe, Array
from sitl.model.state import Actuators
from sitl.simulation import loop
from sitl.simulation.avionics import Avionics
from sitl.simulation.dispatch import REGISTER, Register
from sitl.simulation.flight import Environment, Flight, JumpEntry, Sample
from sitl.simulation.loop import (
    AboardRecords,
    Diagnostics,
    FlightRecords,
    LogRecords,
    Span,
    WorldArrays,
    fly,
    fly_with,
)
from sitl.simulation.noise import SWIRLS, Draws
from sitl.simulation.open_loop import Heard, drive
from sitl.simulation.sensed import Motion
from sitl.simulation.surroundings import Surroundings
from sitl.storage import Records, named_from, record_of, record_type

JUMPS_PER_CALL = 64
MAX_PERIODS = 5000  # flown in one call of the loop
NO_GUSTS, NO_DRAWS, NO_SWIRLS = np.zeros((0, 3)), np.zeros((0, 5)), np.zeros((0, SWIRLS))


class Stretch(NamedTuple):
    """Result of one call of the loop."""

    periods: int
    samples: int
    jumps: npt.NDArray[Any]  # records of JumpEntry
    end: int  # loop.FLOWN ...


class Switch:
    """A flag of the controller as a property of what has ``_arrays``."""

    def __init__(self, name: str, text: str) -> None:
        self._name = name
        self.__doc__ = text

    def __get__(self, vehicle: Any, kind: type | None = None) -> bool:  # noqa: ANN401
        return bool(vehicle._arrays.controller[self._name])  # noqa: SLF001 - a part of the vehicle

    def __set__(self, vehicle: Any, value: bool) -> None:  # noqa: ANN401
        vehicle._arrays.controller[self._name] = value  # noqa: SLF001 - likewise
        vehicle._arrays.invalidate_diagnostics()  # noqa: SLF001 - likewise


class FlightArrays:
    """The state of a flight, what it is told and what is seen of it, each a record, (1,).

    Args:
        register: The laws.
        airframe: The airframe as it is.
        seed: Of gusts and sensors.
        avionics: Instruments and navigation filter.
    """

    def __init__(self, register: Register, airframe: Airframe, seed: int, avionics: Avionics) -> None:
        self.avionics = avionics
        self._fly = fly if register is REGISTER else fly_with(register)
        self._type = register.flight_type
        self.draws = Draws(seed)
        self.flights = np.zeros(1, record_type(self._type))
        self.controller: Any = self.flights["controller"][0]  # a view, whose fields can be assigned
        self.law = self.flights["controller"]["law"]  # likewise, (1,)
        self.estimates = self.flights["estimate"]  # likewise
        self.references = np.zeros(1, record_type(Reference))
        self.airs = np.zeros(1, record_type(Environment))
        self.designs: Records = np.zeros(1)
        self.airframes = record_of(Airframe, airframe)
        self.no_samples = np.zeros(0, record_type(Sample))
        self.surroundings = Surroundings(airframe.b)
        self._looks = np.zeros(1, record_type(Diagnostics))
        self._jumps = np.zeros(JUMPS_PER_CALL, record_type(JumpEntry))
        self._look: Diagnostics | None = None
        self._estimate: Estimate | None = None
        self._air: Environment | None = None
        self._swirls = NO_SWIRLS

    @property
    def flight(self) -> Flight:
        """The whole state by name; a copy."""
        flight: Flight = named_from(self._type, self.flights[0].item())
        return flight

    @flight.setter
    def flight(self, flight: Flight) -> None:
        self.flights[0] = flight
        self._look = self._estimate = None

    def invalidate_diagnostics(self) -> None:
        """Something was changed that values are worked out of."""
        self._look = None

    def diagnostics(self) -> Diagnostics:
        """The values that are worked out only where somebody looks."""
        if self._look is None:
            self._call(NO_GUSTS, NO_DRAWS, Span(-1, 1), self.no_samples)
            self._look = named_from(Diagnostics, self._looks[0].item())
        return self._look

    def estimate(self) -> Estimate:
        """The state as the controller believes it to be; it is asked for many times between two flights."""
        if self._estimate is None:
            self._estimate = named_from(Estimate, self.flights["estimate"][0].item())
        return self._estimate

    def set_air(self, air: Environment) -> None:
        """Air and sensors from now on."""
        if air != self._air:
            self.airs[0] = self._air = air

    def fly(self, periods: int, every: int, samples: Records) -> Stretch:
        """Fly at most ``periods``, as far as random draws and room for jumps go, with a sample each ``every``."""
        self._look = self._estimate = None
        gusts, draws, now = self._drawn(periods)
        flown, sampled, noted, end = self._call(gusts, draws, Span(now, every), samples)
        return Stretch(flown, sampled, self._jumps[:noted], end)

    def drive(self, command: Actuators, periods: int, heard: Heard) -> Stretch:
        """The same without the controller, under one command of somebody else's; ``heard`` receives the readings."""
        self._look = self._estimate = None
        self.controller["command"] = command
        gusts, draws, now = self._drawn(periods)
        records, aboard, around = self._parts(gusts, draws)
        with nullcontext() if is_compiled(drive) else compiling(1):
            flown, end = drive(records, aboard, around, heard, now)
        return Stretch(flown, 0, self._jumps[:0], end)

    def _drawn(self, periods: int) -> tuple[Array, Array, int]:
        """Draws of gusts and of the sensors of the truth from now on, and how many of the periods they are for."""
        gusts, draws = self.draws.rows(int(self.flights["periods"][0]), gusts=bool(self.airs["gust_rms"][0] > 0.0))
        self.avionics.draw(int(self.flights["periods"][0]))
        self._set_wind()
        return gusts, draws, min(periods, len(draws), MAX_PERIODS)

    def _set_wind(self) -> None:
        """Draw for the wind field; where it has ended, the gust is without its part again."""
        if self.surroundings.blows:
            self._swirls = self.draws.swirl_rows(int(self.flights["periods"][0]))
        elif len(self._swirls):
            self._swirls = NO_SWIRLS
            part = self.surroundings.end()
            for axis in part.dtype.names or ():
                self.flights["gust"][axis] -= part[axis]

    def warm_up(self, parts: Iterable[Callable[..., Any]]) -> None:
        """Compile parts of the loop, or read them from disk; nothing moves."""
        aboard, flight = self.avionics.records[0], self.flight
        like = {
            "flight": self.flights[0],
            "reference": self.references[0],
            "air": self.airs[0],
            "design": self.designs[0],
            "a": self.airframes[0],
            "field": self.surroundings.fields[0],
            "wall": self.surroundings.wall,
            "solids": self.surroundings.solids,
            "normals": NO_DRAWS,
            "in_force": flight.controller.command,
            "row": 0,
            "entry": self._jumps[0],
            "seen": self._looks[0],
            "sample": np.zeros(1, self.no_samples.dtype)[0],
            "aboard": aboard,
            "steps": self.avionics.steps,
            "motion": Motion(
                before=flight.plant,
                plant=flight.plant,
                wind=flight.gust,
                command=flight.controller.command,
                may_turn=False,
                period=0,
                has_tube=False,
            ),
            "fast": self.avionics.fast,
            "slow": self.avionics.slow,
        }
        with compiling():
            for part in parts:
                compile_part(part, like)

    def _parts(self, gusts: Array, sensors: Array) -> tuple[FlightRecords, AboardRecords, WorldArrays]:
        """The records as the compiled loops take them."""
        records = FlightRecords(
            flights=self.flights,
            references=self.references,
            designs=self.designs,
            airframes=self.airframes,
            airs=self.airs,
            fields=self.surroundings.fields,
        )
        avionics, wall, solids = self.avionics, self.surroundings.wall, self.surroundings.solids
        aboard = AboardRecords(avionics.records, avionics.steps, avionics.fast, avionics.slow)
        return records, aboard, WorldArrays(wall, solids, gusts, swirls=self._swirls, sensors=sensors)

    def _call(self, gusts: Array, sensors: Array, span: Span, samples: Records) -> tuple[int, int, int, int]:
        records, aboard, around = self._parts(gusts, sensors)
        log = LogRecords(samples, self._jumps, self._looks)
        if not is_compiled(self._fly):
            has_parts = self._fly is fly  # the loop about other laws is compiled in one
            if has_parts:
                self.warm_up(loop.PARTS)
            with compiling(1 if has_parts else 2):
                return self._fly(records, aboard, around, log, span)
        return self._fly(records, aboard, around, log, span)


ENDED_WELL = frozenset({loop.FLOWN, loop.JUMPS_FULL})
