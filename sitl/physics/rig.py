"""One driven vehicle in its world: failures that fall due, restarts of its autopilot, and orders of a person."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from protocol.tools.option_values import finite_number, nonnegative_number
from sitl.errors import SitlError
from sitl.physics.driven_vehicle import DrivenVehicle, Seen
from sitl.physics.journal import Journal
from sitl.physics.outputs import OutputMap
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import HEALTHY
from sitl.simulation.actuator_faults import ACTUATOR_FAILURES
from sitl.simulation.flight_errors import DivergedError
from sitl.vehicle.injected_failures import (
    ACTUATOR_UNITS,
    FAILURE_NAMES,
    GARBAGE_SEED,
    INSTRUMENT_UNITS,
)

INSTRUMENT_NAMES = {
    unit.name.lower().removesuffix(" tube").replace(" ", "-"): unit for unit in INSTRUMENT_UNITS.values()
}
ACTUATOR_NAMES = [f"{side}-{unit.name}" for unit in ACTUATOR_UNITS.values() for side in ("left", "right")]


class Failure(NamedTuple):
    """A failure of an instrument or actuator, from a time on, for a while or for ever."""

    unit: str
    way: int  # HEALTHY heals
    start: float  # simulated [s]
    end: float = math.inf


def read_failure(text: str, now: float | None = None) -> Failure:
    """A failure as a person writes it: ``UNIT:WAY@START+SECONDS``.

    Args:
        text: Without ``+SECONDS`` it lasts.
        now: When a failure without ``@START`` begins [s]; None: it must name one.

    Raises:
        SitlError: If it is none; the message says what there is.
    """
    begun, plus, duration = text.partition("+")
    what, at, start = begun.partition("@")
    unit, _, way = what.partition(":")
    known = [*INSTRUMENT_NAMES, *ACTUATOR_NAMES]
    if unit not in known:
        raise SitlError(f"{text!r}: there is no unit {unit!r}; there is {', '.join(known)}")
    ways = INSTRUMENT_NAMES[unit].failures if unit in INSTRUMENT_NAMES else ACTUATOR_FAILURES
    names = [FAILURE_NAMES[number] for number in sorted(ways)]
    if way not in names:
        raise SitlError(f"{text!r}: {unit} cannot be {way!r}; it can be {', '.join(names)}")
    if not at and now is None:
        raise SitlError(f"{text!r} does not say when: {what}@20 is from 20 s on, {what}@20+5 for 5 s")
    try:
        begins = nonnegative_number(start) if at else float(now or 0.0)
        lasts = nonnegative_number(duration) if plus else math.inf
    except Exception as error:
        raise SitlError(f"{text!r}: {error}") from error
    return Failure(unit, FAILURE_NAMES.index(way), begins, begins + lasts)


class Rig:
    """One vehicle on a link.

    Args:
        vehicle: What flies.
        outputs: What moves its actuators.
        failures: To come.
        journal: Takes what happens.
        keeps: Whether a restart of the autopilot leaves the vehicle where it is; else it goes back to its start.
    """

    def __init__(
        self,
        vehicle: DrivenVehicle,
        outputs: OutputMap,
        journal: Journal,
        *,
        failures: Iterable[Failure] = (),
        keeps: bool = False,
    ) -> None:
        self.vehicle, self.outputs, self.journal = vehicle, outputs, journal
        self._due = sorted(failures, key=lambda failure: failure.start)
        self._keeps, self._was_whole = keeps, True
        self._values: tuple[float, ...] | None = None  # in force

    def take(self, values: Sequence[float]) -> None:
        """Have output values in force from now on; those that are not all finite are counted and not taken."""
        if self.outputs.is_finite(values):
            self._values = tuple(values)
        else:
            self.journal.note("bad outputs", "an output is no number, or missing: the commands before stay in force")

    def disarm(self) -> None:
        """Have no outputs in force: the motors stop."""
        self._values = None

    def fly(self, periods: int) -> Seen:
        """Fly under the outputs in force for control periods."""
        self._fail()
        command = None if self._values is None else self.outputs.command(self._values, self.vehicle.airframe)
        try:
            seen = self.vehicle.drive(command, periods)
        except DivergedError as error:
            self.journal.note("diverged flights", f"{error}; it is put back to its start")
            self.vehicle.restart()
            seen = self.vehicle.drive(None, periods)
        if self._was_whole and self.vehicle.crash is not None:
            crash, what = self.vehicle.crash, self.vehicle.surroundings.touched or "the ground"
            self.journal.tell("crashes", f"crashed into {what} at {crash.speed:.1f} m/s, {seen.time:.1f} s: motors off")
        self._was_whole = self.vehicle.crash is None
        return seen

    def restarted(self, why: str) -> None:
        """The autopilot has begun anew."""
        self.disarm()
        where = "stays where it is" if self._keeps else "is put back to its start"
        self.journal.tell("restarts", f"{why}: the vehicle {where}")
        if not self._keeps:
            self.vehicle.restart()

    def order(self, words: str) -> str:
        """Do what a person typed; gives what was done.

        Raises:
            SitlError: If it is no order.
        """
        order, _, rest = words.partition(" ")
        if order == "reset" and not rest:
            self.vehicle.restart()
            return "the vehicle is put back to its start"
        if order == "fail" and rest:
            failure = read_failure(rest, self.vehicle.time)
            self._due = sorted([*self._due, failure], key=lambda failure: failure.start)
            return f"will fail: {rest}"
        if order == "wind" and rest:
            speed, _, direction = rest.partition("@")
            try:
                self.set_wind(nonnegative_number(speed), finite_number(direction or "0"))
            except Exception as error:
                raise SitlError(f"{words!r}: {error}") from error
            return f"wind {rest}"
        raise SitlError(f"{words!r} is none of pause, go, reset, counts, wind M/S@DEG, fail UNIT:WAY[@START][+SECONDS]")

    def set_wind(self, speed: float, azimuth: float, gusts: float | None = None) -> None:
        """Set a steady wind [m/s], the direction it comes from [deg], and gusts [m/s rms]."""
        angle = math.radians(azimuth)
        self.vehicle.set_wind((-speed * math.cos(angle), speed * math.sin(angle), 0.0), gusts)

    def _fail(self) -> None:
        while self._due and self._due[0].start <= self.vehicle.time + 0.5 * PERIOD:
            failure = self._due.pop(0)
            self._put(failure.unit, failure.way)
            self.journal.say(f"{failure.unit} {FAILURE_NAMES[failure.way]} at {self.vehicle.time:.1f} s")
            if math.isfinite(failure.end):
                healed = Failure(failure.unit, HEALTHY, failure.end)
                self._due = sorted([*self._due, healed], key=lambda failure: failure.start)

    def _put(self, unit: str, way: int) -> None:
        vehicle = self.vehicle
        if unit in INSTRUMENT_NAMES:
            instruments, number = vehicle.avionics.instruments, INSTRUMENT_NAMES[unit].number
            instruments.failures[number], instruments.sizes[number] = way, 1.0
            instruments.failed_at[number] = vehicle.periods
            return
        vehicle.faults = vehicle.faults._replace(**{unit.replace("-", "_"): way}, seed=GARBAGE_SEED)
