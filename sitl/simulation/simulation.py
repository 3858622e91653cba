"""A simulated DarkO on integer time: plant, estimate, laws and supervisor.

One control period is ``PERIOD``; commands computed from the state at period k are in force during period k + 1, as on a
real autopilot. The same class flies the live process, the scenarios and the tests, and how many periods are flown
per call never changes the flight.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, get_type_hints

import numpy as np
import numpy.typing as npt

from protocol.dialect.vocabulary import Law, Regime
from sitl.compiled import compile_part, compiling
from sitl.control import align, handover, hover_attitude, hover_zero_moment, line_of_sight, wind_estimator
from sitl.control.estimate import Estimate
from sitl.control.forward_guidance import stopping_distance
from sitl.control.reference import LEG, Reference, cross_track, hover_at, upright
from sitl.design.forward import can_fly_forward
from sitl.errors import SitlError, UnknownLawError, ZenoError
from sitl.estimation.sensing import SensorNoise
from sitl.estimation.truth import observe
from sitl.model.airframe import Airframe
from sitl.model.ground import FEET, STIFFNESS, feet_aloft, is_touching
from sitl.model.plant import shaft_power
from sitl.model.quaternions import Quaternion, from_euler, hover
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector
from sitl.simulation import loop
from sitl.simulation.dispatch import REGISTER, Register
from sitl.simulation.flight import PERIOD, Environment, Flight, JumpEntry, Sample, sample_of
from sitl.simulation.loop import Look, Records, fly, fly_with
from sitl.simulation.noise import Draws
from sitl.simulation.recording import JumpRecord, Recording, jump_of
from sitl.simulation.storage import named_from, record_of, record_type, zero
from sitl.simulation.tuning import Tuning, design_record, designed
from sitl.supervisor import guards
from sitl.supervisor.guards import Guard

GUST_LENGTH = 30.0  # [m]
SENSORS = SensorNoise(accelerometer=0.3, velocity=0.03, pitot=0.3, has_pitot=True)
JUMPS_PER_CALL = 64
REGIMES_ON_PATH = frozenset({Regime.FRONT_TRANSITION, Regime.FORWARD, Regime.BACK_TRANSITION})
ON_LEG = frozenset({Law.FORWARD_LINE_OF_SIGHT, Law.FORWARD_LINEAR})
GOVERNED = frozenset({Law.HOVER_ZERO_MOMENT, Law.ALIGN})
MAX_PERIODS = 5000  # flown in one call of the loop

__all__ = ["PERIOD", "DivergedError", "Simulation", "Start", "Tuning"]


class DivergedError(SitlError):
    """The simulation left the finite numbers."""

    def __init__(self, text: str, kept: int = 0) -> None:
        super().__init__(text)
        self.kept = kept  # samples before it did
        self.recording: Recording | None = None  # of what was flown, where it was recorded


class Start(NamedTuple):
    """Where and how a flight begins, world NWU."""

    north: float = 0.0  # [m]
    west: float = 0.0  # [m]
    up: float = 0.0  # of the centre of mass above where it stands on the ground [m]
    heading: float = 0.0  # [rad]
    attitude: tuple[float, float, float] | None = None  # roll, pitch, yaw (ZYX, NWU) [rad]; None: nose up
    airborne: bool = False


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
    ) -> None:
        """Put a vehicle somewhere, disarmed and at rest.

        Args:
            airframe: The airframe as it is.
            seed: Of gusts and sensor noise; one seed is one flight, to the bit.
            start: Where it begins; on the ground at the origin by default.
            tuning: Parameters of the controller.
            design_model: The airframe as the controller believes it to be; as it is by default.
            register: The laws; others than the vehicle's own are compiled anew in every process.
        """
        self.airframe = airframe
        self.design_model = design_model or airframe
        self.jumps: list[JumpRecord] = []
        self._look: Look | None = None
        self.register = register
        self._fly_loop = fly if register is REGISTER else fly_with(register)
        self.energy_by_law: dict[Law, float] = dict.fromkeys(register.laws, 0.0)
        self._energy_told = 0.0
        self.draws = Draws(seed)
        self._flights = np.zeros(1, record_type(register.flight_type))
        self._controller: Any = self._flights["controller"][0]  # a view, whose fields can be assigned
        self._law = self._flights["controller"]["law"]  # likewise, (1,)
        self._samples = np.zeros(0, record_type(Sample))
        self._looks = np.zeros(1, record_type(Look))
        self._jump_log = np.zeros(JUMPS_PER_CALL, record_type(JumpEntry))
        self._airframes = record_of(Airframe, airframe)
        self._airs = np.zeros(1, record_type(Environment))
        self._references = np.zeros(1, record_type(Reference))
        self._wind, self._gust_rms = Vector(0.0, 0.0, 0.0), 0.0
        self.retune(tuning or Tuning())
        self.begin(start or Start())

    # Setting up

    def begin(self, start: Start) -> None:
        """Put the vehicle somewhere, at rest; its energy, jumps and time go on."""
        height = start.up + (0.0 if start.airborne else standing_height(self.airframe))
        at, still = Vector(float(start.north), float(start.west), float(height)), Vector(0.0, 0.0, 0.0)
        q = hover(float(start.heading)) if start.attitude is None else from_euler(*(float(x) for x in start.attitude))
        plant = Plant(Body(at, still, q, still), Actuators(0.0, 0.0, 0.0, 0.0), feet_aloft())
        self._put(plant, course=float(start.heading))
        self.reference = hover_at(at, start.heading)

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
        estimate = self._perfect(plant, flight.controller.wind.wind)
        self._write(flight._replace(plant=plant, controller=controller, estimate=estimate))

    def _put(self, plant: Plant, course: float) -> None:
        old = self.flight
        controller_type = get_type_hints(self.register.flight_type)["controller"]
        wind = wind_estimator.start(self.design.gains.wind)
        states = zero(get_type_hints(controller_type)["states"])._replace(course=course)
        controller = zero(controller_type)._replace(law=int(Law.LANDED), wind=wind, states=states)
        estimate = self._perfect(plant, wind.wind)
        self._write(Flight(plant, Vector(0.0, 0.0, 0.0), estimate, controller, old.energy, 0, old.periods))

    def retune(self, tuning: Tuning) -> None:
        """Take other gains and thresholds, in flight or not."""
        self.tuning = tuning
        self.can_fly_forward = can_fly_forward(self.design_model)
        self.design = self.register.design(designed(self.design_model, tuning))
        own = self.register is REGISTER
        self._designs = design_record(self.design_model, tuning) if own else record_of(type(self.design), self.design)
        self._look = None
        self._sensors = SENSORS._replace(has_pitot=bool(tuning.pitot))

    def begin_flight(self, law: Law) -> None:
        """Start in the air under a law, motors at hover speed: scenarios begin so."""
        w = math.sqrt(self.design.gains.hover_linear.u_bar.T1 / self.design_model.k_f)
        self.place(self.truth.body, Actuators(w, w, 0.0, 0.0))
        self.armed = self.flying = True
        self.enter(law)

    def enter(self, law: Law) -> None:
        """Put a law in force, the states of all laws beginning from the flight as it is."""
        flight, gains = self.flight, self.design.gains
        c, estimate = flight.controller, flight.estimate
        states = c.states._replace(
            guide=hover_zero_moment.start(estimate, gains.zero_moment, self.design_model),
            handover=handover.none(),
            steering=hover_attitude.start(estimate, gains.hover_attitude, self.design_model),
            hold=align.start_hold(estimate),
            sight=line_of_sight.start(estimate, self.design_model),
        )
        self._write(flight._replace(controller=c._replace(law=int(law), since=0.0, states=states)))

    # Telling it what to do

    @property
    def reference(self) -> Reference:
        """Where the laws shall bring it, from the next period on."""
        return self._reference

    @reference.setter
    def reference(self, reference: Reference) -> None:
        heading = math.remainder(reference.heading, math.tau)  # anybody may stream one that no sine is right for
        self._reference = (reference if self.can_fly_forward else upright(reference))._replace(heading=heading)
        self._references[0] = self._reference
        self._look = None

    def set_wind(self, wind: Iterable[float], gust_rms: float | None = None) -> None:
        """Velocity of the air, world NWU [m/s], and the gusts' deviation per axis [m/s]."""
        self._wind = Vector(*(float(x) for x in wind))
        if gust_rms is not None:
            self._gust_rms = float(gust_rms)

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return bool(self._controller["is_armed"])

    @armed.setter
    def armed(self, armed: bool) -> None:
        self._controller["is_armed"] = armed
        self._look = None

    @property
    def flying(self) -> bool:
        """Whether it is wanted in the air; landing fulfils the wish."""
        return bool(self._controller["is_flying"])

    @flying.setter
    def flying(self, flying: bool) -> None:
        self._controller["is_flying"] = flying
        self._look = None

    @property
    def landing(self) -> bool:
        """Whether touching the ground is wanted."""
        return bool(self._controller["is_landing"])

    @landing.setter
    def landing(self, landing: bool) -> None:
        self._controller["is_landing"] = landing
        self._look = None

    # Looking at it

    @property
    def flight(self) -> Flight:
        """The whole state by name; a copy."""
        flight: Flight = named_from(self.register.flight_type, self._flights[0].item())
        return flight

    @property
    def environment(self) -> Environment:
        """Air and sensors."""
        return Environment(self._wind, self._gust_rms, GUST_LENGTH, self._sensors)

    @property
    def design_record(self) -> npt.NDArray[Any]:
        """The controller's design as the compiled loop takes it, (1,)."""
        return self._designs

    @property
    def design_key(self) -> tuple[Any, ...]:
        """Equal for simulations that can be flown in one block."""
        return (self.periods, self.design_model, self.tuning)

    @property
    def truth(self) -> Plant:
        """The plant as it is."""
        return named_from(Plant, self._flights["plant"][0].item())

    @property
    def estimate(self) -> Estimate:
        """The state as the controller believes it to be."""
        return named_from(Estimate, self._flights["estimate"][0].item())

    @property
    def law(self) -> Law:
        """The law in force.

        Raises:
            UnknownLawError: If it is none of the vocabulary.
        """
        return self.register.law(self._law_number())  # type: ignore[no-any-return]

    @property
    def periods(self) -> int:
        """Control periods flown since boot."""
        return int(self._flights["periods"][0])

    @property
    def time(self) -> float:
        """Simulated time since boot [s]."""
        return self.periods * PERIOD

    @property
    def lyapunov(self) -> float:
        """V of the linear hover law about the present reference."""
        return self._looked().v_hover

    @property
    def lyapunov_forward(self) -> float | None:
        """V of the linear forward law about the leg that is flown; None where there is none."""
        on_leg = self.law in ON_LEG and self._reference.path.kind == LEG
        return self._looked().v_forward if on_leg else None

    @property
    def lyapunov_attitude(self) -> float | None:
        """V of the attitude law [rad2]; None while it does not fly."""
        return self._looked().v_attitude if self.law is Law.HOVER_ATTITUDE else None

    @property
    def governor(self) -> float:
        """Share of the position loop's force that the governor takes away, 0..1; 0 under laws that have none."""
        return self._looked().governor if self.law in GOVERNED else 0.0

    @property
    def cross_track(self) -> float:
        """Distance to the left of the path flown forward [m]; 0 in the hover."""
        if self.law.regime not in REGIMES_ON_PATH:
            return 0.0
        return cross_track(self._reference.path, self.estimate.position)

    @property
    def wind_estimate(self) -> Vector:
        """Velocity of the air as the laws see it, world NWU [m/s]."""
        return named_from(Vector, self._controller["wind"]["wind"].item())

    @property
    def wind_deviation(self) -> Vector:
        """Standard deviations of the wind estimate, per axis [m/s]."""
        covariance = self._controller["wind"]["covariance"]
        return Vector(*(math.sqrt(max(float(covariance[name]), 0.0)) for name in ("xx", "yy", "zz")))

    @property
    def energy(self) -> float:
        """Shaft energy since boot [J]."""
        return float(self._flights["energy"][0])

    @property
    def power(self) -> float:
        """Shaft power now [W]."""
        return shaft_power(self.truth.actuators, self.airframe)

    @property
    def command(self) -> Actuators:
        """Actuator commands in force."""
        return named_from(Actuators, self._controller["command"].item())

    @property
    def saturation(self) -> int:
        """DARKO_SATURATION bits of the last period."""
        return int(self._controller["saturation"])

    @property
    def limits(self) -> int:
        """DARKO_LIMIT bits seen in the last ``advance``."""
        return int(self._flights["limits"][0])

    @property
    def wind(self) -> Vector:
        """Velocity of the air now, steady and gust, world NWU [m/s]."""
        gust = self._flights["gust"][0].item()
        return Vector(self._wind.x + gust[0], self._wind.y + gust[1], self._wind.z + gust[2])

    def holds(self, *asked: Guard) -> bool:
        """Whether guards hold now, whatever the law in force."""
        flight, seen = self.flight, self._looked()
        given = {
            **flight.controller._asdict(),
            **flight.controller.states._asdict(),
            **seen._asdict(),
            "estimate": flight.estimate,
            "reference": self._reference,
            "thresholds": self.design.thresholds,
            "guidance": self.design.gains.line_of_sight.guidance,
        }
        return all(guard.test(*(given[name] for name in inspect.signature(guard.test).parameters)) for guard in asked)

    @property
    def stands(self) -> bool:
        """Whether it already hovers but has not yet left TO_HOVER, which may wait for the wind to drop."""
        e = self.estimate
        return (
            self.law is Law.TO_HOVER
            and guards.standing.test(e)
            and guards.near.test(self.lyapunov, e, self.design.thresholds, 0.0)
        )

    def stopping_distance(self) -> float:
        """Distance over the ground that braking from the present velocity takes [m]."""
        e = self.estimate
        speed = math.hypot(e.velocity.x, e.velocity.y)
        ux, uy = (e.velocity.x / speed, e.velocity.y / speed) if speed > 0.1 else (1.0, 0.0)
        along, across = e.wind.x * ux + e.wind.y * uy, e.wind.x * uy - e.wind.y * ux
        return stopping_distance(speed, along, across, self.design.gains.line_of_sight.guidance)

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
        self._fly(periods, 1, self._samples)

    def record(self, seconds: float, rate: float = 50.0) -> Recording:
        """Fly for a time and keep samples, the first one of now; see :meth:`advance`.

        Args:
            seconds: How long, a whole number of control periods.
            rate: Samples a second; the control rate divided by it is a whole number.

        Raises:
            DivergedError: If the state is no longer finite; ``error.recording`` is what was flown.
        """
        periods, every = whole_periods(seconds), whole_periods(1.0 / rate)
        samples = np.zeros(-(-periods // every), self._samples.dtype)
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
        rows = np.zeros(1, self._samples.dtype)
        rows[0] = sample_of(self._flights[0], 0, self._references[0], self.lyapunov)
        return Recording.of(rows, ())

    def warm_up(self) -> None:
        """Compile what flies and what looks, or read it from disk; nothing moves."""
        with compiling():
            self._looked()

    def warm_up_parts(self, parts: Iterable[Callable[..., Any]]) -> None:
        """Compile parts of the loop, or read them from disk; nothing moves.

        Args:
            parts: ``loop.MOTION`` or ``loop.JUMPS``: several processes can share the work.
        """
        like = {
            "flight": self._flights[0],
            "reference": self._references[0],
            "air": self._airs[0],
            "design": self._designs[0],
            "a": self._airframes[0],
            "entry": self._jump_log[0],
            "seen": self._looks[0],
            "gusts": np.zeros((0, 3, 1)),
            "draws": np.zeros((0, 5, 1)),
            "column": 0,
            "row": 0,
        }
        with compiling():
            for part in parts:
                compile_part(part, like)

    def _fly(self, periods: int, every: int, samples: Records) -> int:
        self._flights["limits"] = 0
        self._look = None
        self._airs[0] = self.environment
        kept = 0
        while True:
            gusts, draws = self.draws.rows(self.periods, gusts=self._gust_rms > 0.0)
            now = min(periods, len(draws), MAX_PERIODS)
            flown, sampled, noted, end = self._fly_loop(
                self._flights, self._references, self._airs, self._designs, self._airframes, gusts, draws, now, every,
                samples[kept:], self._jump_log, self._looks,
            )  # fmt: skip
            periods -= flown
            kept += sampled
            self._note(self._jump_log[:noted])
            if end not in {loop.FLOWN, loop.JUMPS_FULL}:
                raise self.failure(end, kept)
            if periods == 0 and end == loop.FLOWN:
                return kept

    def continue_from(self, flight: Flight, entries: npt.NDArray[Any]) -> tuple[JumpRecord, ...]:
        """Go on from where the flight was flown to elsewhere, by the jumps noted there; gives those."""
        self._write(flight)
        before = len(self.jumps)
        self._note(entries)
        return tuple(self.jumps[before:])

    def _note(self, entries: npt.NDArray[Any]) -> None:
        for entry in entries:
            record = jump_of(entry, len(self.jumps) + 1, self.register)
            self.jumps.append(record)
            self._account(record.source, float(entry["energy"]))
        self._account(self._law_number(), self.energy)

    def _account(self, law: int, energy: float) -> None:
        if law in self.energy_by_law:
            self.energy_by_law[self.register.law(law)] += energy - self._energy_told
        self._energy_told = energy

    def failure(self, end: int, kept: int = 0) -> SitlError:
        """What a call of the loop that ended so has to say."""
        at = f"at {self.time:.3f} s"
        if end == loop.UNKNOWN_LAW:
            names = ", ".join(law.name for law in self.register.laws)
            return UnknownLawError(f"law {self._law_number()} is not one of {names}")
        if end == loop.ZENO:
            chain = " -> ".join(jump.name for jump in self.jumps[-loop.MAX_CHAIN :])
            return ZenoError(f"jumps without end {at}: {chain}")
        return DivergedError(f"the flight diverged under {self.law.name} {at}: {self.truth}", kept)

    # Inside

    def _perfect(self, plant: Plant, wind: Vector) -> Estimate:
        return observe(plant, Vector(0.0, 0.0, 0.0), wind, is_touching(plant, self.airframe))

    def _law_number(self) -> int:
        return int(self._law[0])

    def _looked(self) -> Look:
        if self._look is None:
            none = np.zeros((0, 3, 1)), np.zeros((0, 5, 1))
            self._fly_loop(
                self._flights, self._references, self._airs, self._designs, self._airframes, *none, -1, 1,
                self._samples, self._jump_log, self._looks,
            )  # fmt: skip
            self._look = named_from(Look, self._looks[0].item())
        return self._look

    def _write(self, flight: Flight) -> None:
        self._flights[0] = flight
        self._look = None


def whole_periods(seconds: float) -> int:
    """A time as control periods.

    Raises:
        SitlError: If it is not a whole number of them.
    """
    periods = round(seconds / PERIOD)
    if periods < 0 or abs(periods * PERIOD - seconds) > 1e-6 * PERIOD:
        raise SitlError(f"{seconds!r} s is not a whole number of control periods of {PERIOD:g} s")
    return periods


def standing_height(a: Airframe) -> float:
    """Height of the centre of mass of a vehicle standing on its tail [m]."""
    return a.foot_x - a.m * a.g / (FEET * STIFFNESS)
