"""A simulated DarkO on integer time: plant, estimate, laws and supervisor.

One control period is ``PERIOD``; commands computed from the state at period k are in force during period k + 1, as on a
real autopilot. The same class flies the live process, the scenarios and the tests, and how many periods are flown
per call never changes the flight.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from protocol.dialect.vocabulary import Law
from sitl.compiled import compiling
from sitl.control.estimate import Estimate
from sitl.control.reference import Reference, hover_at, upright
from sitl.design.gains import can_fly_forward
from sitl.errors import SitlError
from sitl.estimation.nominal_state import WIND_ERROR
from sitl.estimation.sensing import SensorNoise
from sitl.model.airframe import Airframe
from sitl.model.battery import drawn_power
from sitl.model.ground import Crash, feet_aloft
from sitl.model.plant import inflow
from sitl.model.propeller import speed_for
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import SensorSet
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation import loop
from sitl.simulation.actuator_faults import NO_FAULTS
from sitl.simulation.arrays import ENDED_WELL, FlightArrays, Switch
from sitl.simulation.avionics import Avionics, Navigation, equipped
from sitl.simulation.dispatch import REGISTER, Register
from sitl.simulation.flight import Environment, Flight, sample_of
from sitl.simulation.flight_errors import DivergedError, diverged, unknown_law, zeno
from sitl.simulation.loop import Diagnostics
from sitl.simulation.noise import Draws
from sitl.simulation.recording import EnergyByLaw, JumpRecord, Recording, jump_of
from sitl.simulation.start import Start, entered, grounded, perfect_estimate, whole_periods
from sitl.simulation.tuning import Tuning, design_record, designed
from sitl.storage import Records, named_from, record_of

GUST_LENGTH = 30.0  # [m]
SENSORS = SensorNoise(accelerometer=0.3, velocity=0.03, pitot=0.3, has_pitot=True)


class Simulation:
    """One simulated DarkO. ``advance`` flies it; everything else looks at it or tells it what to do."""

    def __init__(
        self,
        airframe: Airframe,
        *,
        seed: int = 1,
        start: Start | None = None,
        tuning: Tuning | None = None,
        design_model: Airframe | None = None,
        register: Register = REGISTER,
        navigation: Navigation = Navigation.TRUTH,
        sensors: SensorSet | None = None,
        aligned: bool = True,
    ) -> None:
        """Put a vehicle somewhere, disarmed and at rest.

        Args:
            airframe: The airframe as it is.
            seed: Of gusts and sensor noise; one seed is one flight, to the bit.
            start: Where it begins; on the ground at the origin by default.
            tuning: Parameters of the controller.
            design_model: The airframe as the controller believes it to be; as it is by default.
            register: The laws; others than the vehicle's own are compiled anew in every process.
            navigation: What fills the estimate that the laws see.
            sensors: Specifications of the instruments; as shipped by default.
            aligned: Whether the navigation filter has already run for a while, as in the air it has always; else
                it has yet to be aligned.
        """
        self.airframe = airframe
        self.design_model = design_model or airframe
        self.jumps: list[JumpRecord] = []
        self.register = register
        self.energy_by_law = EnergyByLaw(register.laws)
        self._told: Reference | None = None  # the reference, as it was given
        avionics = equipped(navigation, sensors or load_sensors(), self.design_model, seed)
        self._arrays = FlightArrays(register, airframe, seed, avionics)
        self.surroundings = self._arrays.surroundings  # net, obstacles and wind wall: none until it is in an arena
        self.faults = NO_FAULTS  # of the actuators; may be changed at any time
        self.noise = SENSORS  # of what the wind is estimated from on the true state; likewise
        self._wind, self._gust_rms, self._is_aligned = Vector(0.0, 0.0, 0.0), 0.0, aligned
        self.retune(tuning or Tuning())
        self.begin(start or Start())

    # Setting up

    def begin(self, start: Start) -> None:
        """Put the vehicle somewhere, at rest; its energy, jumps and time go on, a crash is mended."""
        self.start, plant = start, start.plant(self.surroundings.ground, self.airframe)
        self.surroundings.reset_contact()
        estimate, course = self._seen(plant), float(start.heading)
        self._arrays.flight = grounded(self.register.flight_type, self.design, plant, estimate, course, self.flight)
        if self._is_aligned or start.airborne:
            self._converge(plant)
        else:
            self.avionics.restart(carries_on=False)
        self.reference = hover_at(plant.body.position, start.heading)

    def place(self, body: Body, actuators: Actuators | None = None) -> None:
        """Put the vehicle into any state of motion, its controller kept.

        Args:
            body: Position, velocity, attitude and body rates.
            actuators: Positions and commands in force; as they are by default.
        """
        flight = self.flight
        body = Body(Vector(*body.position), Vector(*body.velocity), Quaternion(*body.attitude), Vector(*body.rates))
        plant = Plant(body, actuators or flight.plant.actuators, feet_aloft())
        controller = flight.controller if actuators is None else flight.controller._replace(command=actuators)
        estimate = self._seen(plant)._replace(wind=flight.controller.wind.wind)
        self._arrays.flight = flight._replace(plant=plant, controller=controller, estimate=estimate)
        self._converge(plant)

    def _seen(self, plant: Plant) -> Estimate:
        return perfect_estimate(plant, self.surroundings.ground, self.airframe)

    def _converge(self, plant: Plant) -> None:
        self.avionics.converge(plant, self.periods, self.wind, self.surroundings.ground, self.airframe)

    def retune(self, tuning: Tuning) -> None:
        """Take other gains and thresholds, in flight or not."""
        self.tuning = tuning
        self.can_fly_forward = can_fly_forward(self.design_model)
        basis = (self.design_model, tuning, self.avionics.latency)
        self.design = self.register.design(designed(*basis))
        own = self.register is REGISTER
        self._arrays.designs = design_record(*basis) if own else record_of(type(self.design), self.design)
        self._arrays.invalidate_diagnostics()
        self.noise = self.noise._replace(has_pitot=bool(tuning.pitot))
        self.avionics.redesign(self.design_model, self.design.gains.wind)

    @property
    def avionics(self) -> Avionics:
        """Instruments and navigation filter."""
        return self._arrays.avionics

    def begin_flight(self, law: Law) -> None:
        """Start in the air under a law, motors at hover speed: scenarios begin so."""
        w = speed_for(self.design.gains.hover_linear.u_bar.T1, 0.0, self.design_model)
        self.place(self.truth.body, Actuators(w, w, 0.0, 0.0))
        self.armed = self.flying = True
        self.enter(law)

    def enter(self, law: Law) -> None:
        """Put a law in force, the states of all laws beginning from the flight as it is."""
        self._arrays.flight = entered(self.flight, int(law), self.design)

    # Telling it what to do

    @property
    def reference(self) -> Reference:
        """Set-point of the laws, from the next period on."""
        return self._reference

    @reference.setter
    def reference(self, reference: Reference) -> None:
        if reference == self._told:  # as at most ticks
            return
        self._told, heading = reference, math.remainder(reference.heading, math.tau)  # any number may be streamed
        self._reference = (reference if self.can_fly_forward else upright(reference))._replace(heading=heading)
        self._arrays.references[0] = self._reference
        self._arrays.invalidate_diagnostics()

    def set_wind(self, wind: Iterable[float], gust_rms: float | None = None) -> None:
        """Velocity of the air, world NWU [m/s], and the gusts' deviation per axis [m/s]."""
        self._wind = Vector(*(float(x) for x in wind))
        if gust_rms is not None:
            self._gust_rms = float(gust_rms)

    armed = Switch("is_armed", "Whether the motors may turn.")
    flying = Switch("is_flying", "Whether it is wanted in the air; landing fulfils the wish.")
    landing = Switch("is_landing", "Whether touching the ground is wanted.")

    # Looking at it

    @property
    def flight(self) -> Flight:
        """The whole state by name; a copy. One that is put back flies on from there, but for instruments and filter."""
        return self._arrays.flight

    @flight.setter
    def flight(self, flight: Flight) -> None:
        self._arrays.flight = flight

    @property
    def flight_record(self) -> Records:
        """The same as compiled functions change it, (1,)."""
        return self._arrays.flights

    @property
    def environment(self) -> Environment:
        """Air, ground and sensors."""
        ground = self.surroundings.ground
        return Environment(
            wind=self._wind,
            gust_rms=self._gust_rms,
            gust_length=GUST_LENGTH,
            ground=ground,
            sensors=self.noise,
            faults=self.faults,
        )

    @property
    def design_record(self) -> Records:
        """The controller's design as the compiled loop takes it, (1,)."""
        return self._arrays.designs

    @property
    def design_key(self) -> tuple[Any, ...]:
        """Equal for simulations that can be flown in one block."""
        return (self.periods, self.design_model, self.tuning, self.avionics.latency)

    @property
    def truth(self) -> Plant:
        """The plant as it is."""
        return named_from(Plant, self._arrays.flights["plant"][0].item())

    @property
    def estimate(self) -> Estimate:
        """The state as the controller believes it to be."""
        return self._arrays.estimate()

    @property
    def estimate_record(self) -> Records:
        """The estimate as compiled functions take it, (1,)."""
        return self._arrays.estimates

    @property
    def law(self) -> Law:
        """The law in force.

        Raises:
            UnknownLawError: If it is none of the vocabulary.
        """
        return self.register.law(self._law_number())  # type: ignore[no-any-return]

    @property
    def law_time(self) -> float:
        """Time that the law has been in force [s]."""
        return float(self._arrays.controller["law_time"])

    @property
    def periods(self) -> int:
        """Control periods flown since boot."""
        return int(self._arrays.flights["periods"][0])

    @property
    def time(self) -> float:
        """Simulated time since boot [s]."""
        return self.periods * PERIOD

    @property
    def diagnostics(self) -> Diagnostics:
        """The values that are worked out only where somebody looks."""
        return self._arrays.diagnostics()

    @property
    def v_hover(self) -> float:
        """V of the linear hover law about the present reference."""
        return self.diagnostics.v_hover

    @property
    def wind_estimate(self) -> Vector:
        """Velocity of the air as the laws see it, world NWU [m/s]."""
        return self.estimate.wind

    @property
    def wind_deviation(self) -> Vector:
        """Standard deviations of the wind estimate, per axis [m/s]."""
        if self.avionics.is_sensed:
            return self.avionics.deviation(WIND_ERROR)
        xx, _, _, yy, _, zz = self._arrays.flights["controller"]["wind"]["covariance"][0].item()
        return Vector(*(math.sqrt(max(variance, 0.0)) for variance in (xx, yy, zz)))

    @property
    def energy(self) -> float:
        """Energy since boot, of the battery or of the shafts as the airframe counts it [J]."""
        return float(self._arrays.flights["energy"][0])

    @property
    def power(self) -> float:
        """Power now, of the battery or of the shafts as the airframe counts it [W]."""
        return drawn_power(self.truth.actuators, inflow(self.truth.body, self.wind), self.airframe)

    @property
    def command(self) -> Actuators:
        """Actuator commands in force."""
        return named_from(Actuators, self._arrays.controller["command"].item())

    @property
    def saturation(self) -> int:
        """DARKO_SATURATION bits of the last period."""
        return int(self._arrays.controller["saturation"])

    @property
    def limits(self) -> int:
        """DARKO_LIMIT bits seen in the last ``advance``."""
        return int(self._arrays.flights["limits"][0])

    @property
    def crash(self) -> Crash | None:
        """The contact with the ground that broke it; None while it is whole."""
        crash = self._arrays.flights["crash"][0]
        return named_from(Crash, crash.item()) if crash["speed"] > 0.0 else None

    @property
    def wind(self) -> Vector:
        """Velocity of the air now, steady and gust, world NWU [m/s]."""
        gust = self._arrays.flights["gust"][0].item()
        return Vector(self._wind.x + gust[0], self._wind.y + gust[1], self._wind.z + gust[2])

    # Flying

    def step(self, seconds: float) -> None:
        """Fly for a time, a whole number of control periods; see :meth:`advance`."""
        self.advance(whole_periods(seconds))

    def advance(self, periods: int) -> None:
        """Fly ``periods`` control periods, taking every jump that falls due.

        Raises:
            DivergedError: If the state is no longer finite.
            ZenoError: If the supervisor jumps without end.
            UnknownLawError: If the law in force is not one of the core's.
        """
        self._fly(periods, 1, self._arrays.no_samples)

    def record(self, seconds: float, rate: float = 50.0) -> Recording:
        """Fly for a time and keep samples, the first one of now; see :meth:`advance`.

        Args:
            seconds: How long, a whole number of control periods.
            rate: Samples a second; the control rate divided by it is a whole number.

        Raises:
            DivergedError: If the state is no longer finite; ``error.recording`` is what was flown.
        """
        periods, every = whole_periods(seconds), whole_periods(1.0 / rate)
        samples = np.zeros(-(-periods // every), self._arrays.no_samples.dtype)
        before = len(self.jumps)
        offset = self.periods % every
        if offset:
            raise SitlError(f"a recording at {rate:g} Hz begins at a whole multiple of its period, not {self.time:g} s")
        try:
            kept = self._fly(periods, every, samples)
        except DivergedError as error:
            error.recording = Recording.of(samples[: error.kept], tuple(self.jumps[before:]))
            raise
        return Recording.of(samples[:kept], tuple(self.jumps[before:]))

    def sample(self) -> Recording:
        """One sample, of now."""
        rows = np.zeros(1, self._arrays.no_samples.dtype)
        rows[0] = sample_of(self._arrays.flights[0], self._arrays.references[0], self.v_hover)
        return Recording.of(rows, ())

    def warm_up(self) -> None:
        """Compile what flies and what looks, or read it from disk; nothing moves."""
        with compiling():
            self.diagnostics  # noqa: B018 - looking compiles

    def warm_up_parts(self, parts: Iterable[Callable[..., Any]]) -> None:
        """Compile parts of the loop, or read them from disk: several processes can share the work."""
        self._arrays.warm_up(parts)

    def _fly(self, periods: int, every: int, samples: Records) -> int:
        self._arrays.flights["limits"] = 0
        self._arrays.set_air(self.environment)
        kept = 0
        while True:
            stretch = self._arrays.fly(periods, every, samples[kept:])
            periods -= stretch.periods
            kept += stretch.samples
            self._note(stretch.jumps)
            if stretch.end not in ENDED_WELL:
                raise self.failure(stretch.end, kept)
            if periods == 0 and stretch.end == loop.FLOWN:
                return kept

    def _note(self, entries: npt.NDArray[Any]) -> None:
        for entry in entries:
            record = jump_of(entry, len(self.jumps) + 1, self.register)
            self.jumps.append(record)
            self.energy_by_law.add(record.source, float(entry["energy"]))
        self.energy_by_law.add(self._law_number(), self.energy)

    @property
    def draws(self) -> Draws:
        """Random draws of gusts and sensors."""
        return self._arrays.draws

    def failure(self, end: int, kept: int = 0) -> SitlError:
        """The error of a call of the loop that ended so."""
        if end == loop.UNKNOWN_LAW:
            return unknown_law(self._law_number(), self.register.laws)
        return zeno(self.jumps, self.time) if end == loop.ZENO else diverged(self.law.name, self.time, self.truth, kept)

    def _law_number(self) -> int:
        return int(self._arrays.law[0])
