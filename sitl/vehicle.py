"""The vehicle in flight: plant, laws and supervisor on integer time.

One control tick is ``TICK``; commands computed from the state at tick k are in force during tick k + 1, as on a
real autopilot. Between jumps the compiled flow runs many ticks in one call; where it leaves the flow set of the
present law, the supervisor's table decides the jump. The same class flies the live process, the scenarios and
the tests, and how many ticks are flown per call never changes the flight.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sitl.autopilot.guidance import Setpoint, Vector
from sitl.design.attitude import attitude_gains, full_force
from sitl.design.forward import air_gains, can_fly_forward, sight_gains
from sitl.design.forward_linear import forward_gains
from sitl.design.lmi import lmi_gains
from sitl.design.lqr import hover_gains
from sitl.design.zero_moment import zero_moment_gains
from sitl.errors import SitlError
from sitl.flow import TICK, Laws, Surroundings, flow
from sitl.hybrid.automaton import settle
from sitl.hybrid.conditions import Condition
from sitl.hybrid.supervisor import TABLE, JumpRecord, Law, Reason, jump_sets
from sitl.kernels import state
from sitl.kernels.ground import FEET, STIFFNESS
from sitl.kernels.integrate import plant_step
from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import from_euler, hover
from sitl.laws import air as air_filter
from sitl.laws import hover_attitude, hover_linear, hover_zero_moment, line_of_sight, report_forward
from sitl.laws.air import AirSensors
from sitl.laws.forward_guidance import stopping_distance
from sitl.laws.forward_linear import ForwardGains
from sitl.laws.governor import VELOCITY
from sitl.laws.hover_linear import LinearGains
from sitl.laws.path import LEG, Path
from sitl.laws.report_forward import LineOfSightGains
from sitl.memory_layout import (
    AIR,
    AT_REST,
    ATTITUDE,
    BUMP,
    COMMAND,
    COURSE,
    CROSS_TRACK,
    ENERGY,
    GIVEN_UP,
    GOVERNOR,
    GUST,
    HOLD,
    INTEGRAL,
    LAW,
    LYAPUNOV,
    LYAPUNOV_ATTITUDE,
    LYAPUNOV_FORWARD,
    MEMORY,
    REPORT,
    SIGHT,
    SINCE,
)
from sitl.watch import Orders, watch

__all__ = ["TICK", "DivergedError", "Start", "Tuning", "Vehicle"]

BLOCK = 500  # ticks of gust noise drawn at once: one second
GUST_LENGTH = 30.0  # [m]
STOP_SPEED = 12.0  # airspeed of an approach nobody gave one for [m/s]
SENSORS = AirSensors(accelerometer=0.3, velocity=0.03, pitot=0.3, has_pitot=True)
# The laws that share the line of sight's state.
SIGHTED = frozenset({Law.TO_FORWARD, Law.FORWARD_LINE_OF_SIGHT, Law.TO_HOVER, Law.FAILSAFE})
SETTLE_TIME = 0.3  # at rest on the ground this long is landed [s]
LET_GO_TIME = 1.0  # a tilt that was commanded is flown off by the zero-moment law so long [s]


class DivergedError(SitlError):
    """The simulation left the finite numbers."""


class Start(NamedTuple):
    """Where and how the vehicle begins, world NWU."""

    north: float = 0.0  # [m]
    west: float = 0.0  # [m]
    up: float = 0.0  # of the centre of mass above where it stands on the ground [m]
    heading: float = 0.0  # [rad]
    attitude: Vector | None = None  # roll, pitch, yaw [rad] (ZYX, NWU); None: nose up at the heading
    airborne: bool = False


class Tuning(NamedTuple):
    """What of the hybrid controller can be chosen."""

    v_enter: float = 20.0  # DRK_V_ENTER
    v_leave: float = 50.0  # DRK_V_LEAVE
    integral: int = 1  # DRK_LQI
    governor: int = VELOCITY  # DRK_GOVERNOR
    nu_prime: int = 0  # DRK_NU_PRIME
    kpp: float = 1.5  # DRK_KPP [N/m]
    kpd: float = 1.5  # DRK_KPD [N s/m]
    k_delta: float = 5.0  # DRK_KDELTA [1/s]
    lam: float = 10.0  # DRK_LAMBDA [rad/s]
    zeta: float = 0.8  # DRK_ZETA
    k_q: float = 1.0  # DRK_KQ [rad/s]
    forward_linear: int = 1  # DRK_FWD_LIN
    v_forward_enter: float = 5.0  # DRK_VF_ENTER
    v_forward_leave: float = 20.0  # DRK_VF_LEAVE
    forward_law: int = 0  # DRK_FWD_LAW: 0 ours, 1 the report's
    pitot: int = 1  # DRK_PITOT
    design: int = 0  # DRK_LIN_DESIGN: 0 LQR or LQI, 1 LMI


class Vehicle:
    """One simulated DarkO. ``advance`` flies it; everything else looks at it or tells it what to do."""

    def __init__(
        self,
        airframe: Airframe,
        *,
        seed: int = 1,
        start: Start | None = None,
        tuning: Tuning | None = None,
        believed: Airframe | None = None,
    ) -> None:
        self.airframe = airframe
        self.believed = believed or airframe  # what the laws are designed for
        self.step = 0  # control ticks flown
        self.law = Law.LANDED
        self.jumps: list[JumpRecord] = []
        self._conditions = 0  # the supervisor's, after the last tick
        self._attitude, self._rates, self._force = hover(0.0), np.zeros(3), 0.0  # of the last attitude set-point
        self.limits = 0  # DARKO_LIMIT bits seen in the last advance
        self.armed = self.flying = self.landing = False
        self.energy_by_law = dict.fromkeys(Law, 0.0)
        self.given_up = 0  # DARKO_GIVEN_UP bits of the last tick
        self._random = np.random.default_rng(seed)
        self._sensor_random = np.random.default_rng((seed, 1))  # apart, so that sensors do not change the gusts
        self._draw_noise()
        self._wind, self._gust_rms = np.zeros(3), 0.0
        self.plant = np.zeros(state.SIZE)
        self.memory = np.zeros(MEMORY)
        self._jump_sets = jump_sets()
        air_filter.reset(self.memory[AIR : AIR + air_filter.SIZE], air_gains())
        self.begin(start or Start())
        self.retune(tuning or Tuning())

    # Setting up

    def begin(self, start: Start) -> None:
        """Put the vehicle somewhere, at rest."""
        self.plant[:] = 0.0
        self.plant[state.ANCHOR :] = math.nan
        height = start.up + (0.0 if start.airborne else standing_height(self.airframe))
        self.plant[state.P : state.P + 3] = start.north, start.west, height
        q = hover(start.heading) if start.attitude is None else from_euler(*start.attitude)
        self.plant[state.Q : state.Q + 4] = q
        self.memory[COURSE] = start.heading
        self.set_target(Setpoint((start.north, start.west, height), start.heading, 3.0))

    def retune(self, tuning: Tuning) -> None:
        """Take other gains and thresholds, in flight or not."""
        self.tuning = tuning
        a = self.believed
        self.can_fly_forward = can_fly_forward(a)
        self._sensors = SENSORS._replace(has_pitot=bool(tuning.pitot))
        self._laws = Laws(
            linear=_hover_gains(a, bool(tuning.integral), tuning.design),
            zero_moment=zero_moment_gains(
                a,
                k_pp=tuning.kpp,
                k_pd=tuning.kpd,
                k_delta=tuning.k_delta,
                lam=tuning.lam,
                zeta=tuning.zeta,
                k_q=tuning.k_q,
                nu_prime=bool(tuning.nu_prime),
                governor=tuning.governor,
            ),
            attitude=attitude_gains(),
            sight=sight_gains(),
            forward=_forward_gains(a),
            report=LineOfSightGains(a),
            report_flies=bool(tuning.forward_law),
            air=air_gains(),
            airframe=a,
        )
        self._measure()

    def begin_flight(self, law: Law) -> None:
        """Start in the air under a law, motors at hover speed: scenarios begin so."""
        w = math.sqrt(self._laws.linear.u_bar[0] / self.believed.k_f)
        self.plant[state.ACTUATOR : state.ACTUATOR + 2] = self.memory[COMMAND : COMMAND + 2] = w
        self.armed = self.flying = True
        self.law = law
        self._enter(law)

    def warm_up(self, say: Callable[[str], None] = lambda text: None) -> None:  # noqa: ARG005 - silence is the default
        """Compile every path, so that the first flown tick is as quick as any; nothing moves.

        Args:
            say: Told what is being compiled before each step.
        """
        kept = self.plant.copy(), self.memory.copy()
        plant_step_arguments = (self.plant, self.memory[COMMAND : COMMAND + 4], np.zeros(3), False, self.airframe, TICK)
        steps: tuple[tuple[str, Callable[[], object]], ...] = (
            ("flight model", lambda: plant_step(*plant_step_arguments)),
            ("hover laws", lambda: self._enter(Law.HOVER_ZERO_MOMENT)),
            ("attitude law", lambda: self._enter(Law.HOVER_ATTITUDE)),
            ("forward laws", lambda: self._enter(Law.TO_HOVER)),
            ("closed loop", lambda: self._flow(Law.LANDED, 0)),
            ("supervisor", lambda: self.conditions(Law.LANDED)),
        )
        for number, (name, compile_it) in enumerate(steps, 1):
            say(f"compiling {number}/{len(steps)}: {name}")
            compile_it()
        self.plant[:], self.memory[:] = kept

    # Telling it what to do

    def set_target(self, setpoint: Setpoint) -> None:
        """Where the laws shall bring it, from the next tick on."""
        self.setpoint = setpoint
        self._target = np.array(setpoint.p)
        attitude, route = setpoint.attitude, setpoint.route
        if attitude is not None:
            self._attitude, self._rates = np.array(attitude.q), np.array(attitude.rates)
            self._force = attitude.thrust * full_force(self.believed)
        if route is None:
            self._path = Path(LEG, self._target, self._target, 0.0, STOP_SPEED, stop=True, level=0.0, low=0.0)
        else:
            self._path = Path(
                route.kind,
                np.array(route.start),
                np.array(route.end),
                route.radius,
                route.airspeed,
                route.stop,
                route.level,
                route.low,
            )

    def set_wind(self, wind: Vector, gust_rms: float | None = None) -> None:
        """Velocity of the air, world NWU [m/s], and the gusts' deviation per axis [m/s]."""
        self._wind = np.array(wind, dtype=float)  # of whole numbers, another kernel would be compiled in flight
        if gust_rms is not None:
            self._gust_rms = gust_rms

    # Looking at it

    @property
    def time(self) -> float:
        """Simulated time since boot [s]."""
        return self.step * TICK

    @property
    def lyapunov(self) -> float:
        """V of the linear hover law about the present target."""
        return float(self.memory[LYAPUNOV])

    @property
    def lyapunov_forward(self) -> float:
        """V of the linear forward law about the leg that is flown; NaN where there is none."""
        return float(self.memory[LYAPUNOV_FORWARD])

    @property
    def lyapunov_attitude(self) -> float:
        """V of the attitude law [rad2]; NaN while it does not fly."""
        return float(self.memory[LYAPUNOV_ATTITUDE])

    @property
    def cross_track(self) -> float:
        """Distance to the left of the path flown forward [m]; 0 in the hover."""
        return float(self.memory[CROSS_TRACK])

    @property
    def wind_estimate(self) -> Array:
        """Velocity of the air as the laws see it, world NWU [m/s]."""
        return self.memory[AIR : AIR + 3]

    @property
    def wind_deviation(self) -> Vector:
        """Standard deviations of the wind estimate, per axis [m/s]."""
        at = AIR + air_filter.COVARIANCE
        x, y, z = (math.sqrt(max(float(self.memory[at + 4 * i]), 0.0)) for i in range(3))
        return x, y, z

    @property
    def governor(self) -> float:
        """Share of the position loop's force that the governor takes away, 0..1."""
        return float(self.memory[GOVERNOR])

    @property
    def energy(self) -> float:
        """Shaft energy since boot [J]."""
        return float(self.memory[ENERGY])

    @property
    def command(self) -> Array:
        """Actuator commands in force: w1, w2 [rad/s], d1, d2 [rad]."""
        return self.memory[COMMAND : COMMAND + 4]

    @property
    def wind(self) -> Array:
        """Velocity of the air now, steady and gust, world NWU [m/s]."""
        return np.asarray(self._wind + self.memory[GUST : GUST + 3])

    @property
    def stands(self) -> bool:
        """Whether the transition to the hover is over but for the handing over, which may wait for the wind to fall."""
        done = Condition.STANDING | Condition.NEAR
        return self.law is Law.TO_HOVER and self._conditions & done == done

    def stopping_distance(self) -> float:
        """Distance over the ground that braking from the present velocity takes [m]."""
        v, wind = self.plant[state.V : state.V + 3], self.wind_estimate
        speed = math.hypot(v[0], v[1])
        ux, uy = (v[0] / speed, v[1] / speed) if speed > 0.1 else (1.0, 0.0)
        along, across = wind[0] * ux + wind[1] * uy, wind[0] * uy - wind[1] * ux
        return float(stopping_distance(speed, along, across, self._laws.sight.guidance))

    @property
    def power(self) -> float:
        """Shaft power now [W]."""
        w1, w2 = self.plant[state.ACTUATOR : state.ACTUATOR + 2]
        return float(self.airframe.k_m * (w1**3 + w2**3))

    # Flying

    def advance(self, ticks: int) -> None:
        """Fly ``ticks`` control ticks, taking every jump that falls due.

        Raises:
            DivergedError: If the state is no longer finite.
            ZenoError: If the supervisor jumps without end.
        """
        self.limits = 0
        left = ticks
        self._measure()
        self._jump(self.conditions(self.law))  # what is ordered may have changed since
        while left > 0:
            row = self.step % BLOCK
            flown, conditions = self._flow(self.law, min(left, BLOCK - row))
            left -= flown
            self.step += flown
            if self.step % BLOCK == 0:
                self._draw_noise()
            self._jump(conditions)
        if not np.isfinite(self.plant[: state.ANCHOR]).all():
            raise DivergedError(f"the flight diverged under {self.law.name} at step {self.step}: {self.plant[:17]}")

    def _draw_noise(self) -> None:
        self._noise = self._random.standard_normal((BLOCK, 3))
        self._readings = self._sensor_random.standard_normal((BLOCK, 5))

    def _orders(self, law: Law) -> Orders:
        tuning = self.tuning
        return Orders(
            law=int(law),
            target=self._target,
            heading=self.setpoint.heading,
            speed=self.setpoint.speed,
            armed=self.armed,
            flying=self.flying,
            landing=self.landing,
            forward=self.setpoint.route is not None and self.can_fly_forward,
            path=self._path,
            v_enter=tuning.v_enter,
            v_leave=tuning.v_leave,
            v_forward_enter=tuning.v_forward_enter if tuning.forward_linear else 0.0,
            v_forward_leave=tuning.v_forward_leave,
            settle_time=SETTLE_TIME,
            steered=self.setpoint.attitude is not None,
            attitude=self._attitude,
            rates=self._rates,
            force=self._force,
        )

    def _flow(self, law: Law, ticks: int) -> tuple[int, int]:
        air = Surroundings(self._wind, self._gust_rms, GUST_LENGTH, self._noise, self._readings, self._sensors)
        before = self.memory[ENERGY]
        flown, flags, conditions = flow(
            self.plant, self.memory, self._orders(law), air, self._laws, self._jump_sets, self.airframe, ticks,
            self.step % BLOCK,
        )  # fmt: skip
        self.limits |= flags
        self.given_up = int(self.memory[GIVEN_UP])
        self.energy_by_law[law] += self.memory[ENERGY] - before
        return int(flown), int(conditions)

    def conditions(self, law: Law) -> int:
        """What holds now of the supervisor's conditions (bits of Condition), under a law."""
        limits = self._laws.sight.guidance
        return int(watch(self.plant, self.memory, self._orders(law), limits, self.airframe, 0.0))

    def _jump(self, conditions: int) -> None:
        self._conditions = conditions
        law = self.law
        _, taken = settle(TABLE, law, conditions)
        for jump in taken:
            record = JumpRecord(
                self.time,
                len(self.jumps) + 1,
                law,
                jump.target,
                jump.name,
                Reason(jump.reason),
                self.lyapunov_forward if Law.FORWARD_LINEAR in {law, jump.target} else self.lyapunov,
            )
            self.jumps.append(record)
            self._enter(jump.target, law)
            law = jump.target
        self.law = law

    def _enter(self, law: Law, source: Law = Law.LANDED) -> None:
        """Jump maps: the state of the law that takes over starts without a step in what it commands."""
        self.memory[AT_REST] = self.memory[SINCE] = 0.0
        if law is Law.LANDED:
            self.flying = False  # landing fulfils the wish to fly; taking off again needs a new one
            # What the integral had learnt of the wind would push a standing vehicle over.
            self.memory[INTEGRAL : INTEGRAL + 3] = 0.0
        if law in {Law.HOVER_ZERO_MOMENT, Law.ALIGN} and source not in {Law.HOVER_ZERO_MOMENT, Law.ALIGN}:
            law_state = self.memory[LAW : LAW + hover_zero_moment.SIZE]
            hover_zero_moment.reset(self.plant, self._force_given(), law_state, self._laws.zero_moment)
        self.memory[BUMP : BUMP + 4] = 0.0
        if law is Law.HOVER_ZERO_MOMENT and source is Law.HOVER_ATTITUDE:
            self.memory[BUMP] = math.nan
            self.memory[SINCE] = -LET_GO_TIME
        if law is Law.HOVER_ATTITUDE:
            self.memory[BUMP] = math.nan
            law_state = self.memory[ATTITUDE : ATTITUDE + hover_attitude.SIZE]
            hover_attitude.reset(self.plant, self._force_given(), law_state, self._laws.zero_moment, self.believed)
        if law is Law.ALIGN:
            p, v = self.plant[state.P : state.P + 3], self.plant[state.V : state.V + 3]
            self.memory[HOLD : HOLD + 3] = p + 0.5 * v
        if law is Law.FORWARD_LINE_OF_SIGHT:
            report_forward.reset(self.plant, self.memory[REPORT : REPORT + report_forward.SIZE], self._laws.report)
        if law in SIGHTED and source not in SIGHTED:
            sight = self.memory[SIGHT : SIGHT + line_of_sight.SIZE]
            line_of_sight.reset(self.plant, sight, self.believed)

    def _force_given(self) -> float:
        """What the motors give along the nose now, as the laws believe [N]."""
        w1, w2 = self.plant[state.ACTUATOR : state.ACTUATOR + 2]
        return float((1.0 - self.believed.S_ratio * self.believed.C_d0) * self.believed.k_f * (w1 * w1 + w2 * w2))

    def _measure(self) -> None:
        x = np.empty(12)
        hover_linear.error(self.plant, self._target, self.setpoint.heading, x)
        self.memory[LYAPUNOV] = hover_linear.lyapunov(x, self._laws.linear)


@lru_cache(maxsize=8)
def _hover_gains(a: Airframe, integral: bool, design: int) -> LinearGains:
    return lmi_gains(a) if design else hover_gains(a, integral=integral)


@lru_cache(maxsize=8)
def _forward_gains(a: Airframe) -> ForwardGains:
    try:
        return forward_gains(a)
    except SitlError:  # nothing balances it in level flight at some speed: it hovers, and never asks for these
        none, grid = np.zeros((2, 2)), np.array((0.0, 1.0))
        return ForwardGains(grid, grid, np.zeros((2, 4, 11)), np.zeros((2, 11, 11)), none, none, none)


def standing_height(a: Airframe) -> float:
    """Height of the centre of mass of a vehicle standing on its tail [m]."""
    return a.foot_x - a.m * a.g / (FEET * STIFFNESS)
