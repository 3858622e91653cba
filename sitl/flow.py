"""The flow between jumps: laws, actuators and plant, tick after tick in one compiled call.

This is the flow map of the vehicle's hybrid system, and its flow set as well: the call returns early at the
first tick after which the state is in a jump set of the supervisor's table, so that the table can jump.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from sitl.kernels.integrate import plant_step
from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import hover, rotate_inverse
from sitl.kernels.state import ACTUATOR, P, Q, V
from sitl.kernels.wind import gust_step
from sitl.laws import air as air_filter
from sitl.laws import forward_linear, hover_attitude, hover_linear, hover_zero_moment, line_of_sight, report_forward
from sitl.laws.air import AirGains, AirSensors
from sitl.laws.allocation import allocate
from sitl.laws.forward_linear import ForwardGains
from sitl.laws.governor import activity
from sitl.laws.hover_attitude import AttitudeGains
from sitl.laws.hover_linear import LinearGains
from sitl.laws.hover_zero_moment import ZeroMomentGains
from sitl.laws.line_of_sight import SightGains
from sitl.laws.path import LEG, Path, cross_track
from sitl.laws.report_forward import LineOfSightGains
from sitl.memory_layout import (
    ACCELERATION,
    AIR,
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
    REPORT,
    SIGHT,
    SINCE,
)
from sitl.watch import Orders, course_of, watch

TICK = 0.002  # control period [s]
SUBSTEPS = 2  # plant steps per tick
# The supervisor's laws, as the compiled code sees them.
(
    LANDED, LINEAR, ZERO_MOMENT, ALIGN, TO_FORWARD, LINE_OF_SIGHT, FORWARD_LINEAR, TO_HOVER, FAILSAFE, HOVER_ATTITUDE,
) = range(10)  # fmt: skip
TURN_BELOW = 3.0  # over the ground, in the transition to the hover [m/s]
TURN_RATE = 1.0  # there [rad/s]
FADE = 0.15  # of what the law before commanded more [s]


class Surroundings(NamedTuple):
    """The air of one stretch of flow, and the sensors' noise in it."""

    wind: Array  # steady, world NWU, (3,) [m/s]
    gust_rms: float  # per axis [m/s]
    gust_length: float  # [m]
    noise: Array  # unit normals of the gusts, a row per tick, (n, 3)
    readings: Array  # unit normals of the sensors, a row per tick: velocity, accelerometer, pitot, (n, 5)
    sensors: AirSensors


class Laws(NamedTuple):
    """Gains of every law, and the airframe as the laws believe it to be."""

    linear: LinearGains
    zero_moment: ZeroMomentGains
    attitude: AttitudeGains
    sight: SightGains
    forward: ForwardGains
    report: LineOfSightGains  # of the report's own law
    report_flies: bool  # in place of the line-of-sight law, between the transitions
    air: AirGains
    airframe: Airframe


@njit(cache=True)
def flow(
    plant: Array,
    memory: Array,
    orders: Orders,
    air: Surroundings,
    laws: Laws,
    jump_sets: npt.NDArray[np.int64],
    a: Airframe,
    ticks: int,
    first: int,
) -> tuple[int, int, int]:
    """Fly up to ``ticks`` control ticks; stop after the one that enters a jump set.

    Args:
        plant: Plant state, changed in place.
        memory: The flow's memory, changed in place, laid out by :mod:`sitl.memory_layout`.
        orders: What to fly.
        air: Wind, gusts and sensor noise.
        laws: Gains.
        jump_sets: The supervisor's guards, see :func:`sitl.hybrid.supervisor.jump_sets`.
        a: The airframe as it is.
        ticks: How many ticks at most.
        first: Row of the noise of the first tick.

    Returns:
        Ticks flown, the DARKO_LIMIT bits that were active in any of them, and the conditions after the last.
    """
    x, x_forward, u, staged = np.empty(12), np.empty(forward_linear.STATES), np.empty(4), np.empty(4)
    flags = conditions = 0
    hover_linear.error(plant, orders.target, orders.heading, x)
    for k in range(ticks):
        wind = _air(plant, memory, air, first + k)
        _sense(plant, memory, wind, air, laws, first + k, a)
        memory[GIVEN_UP] = _law(plant, memory, orders, laws, x, x_forward, u, staged)
        command = memory[COMMAND : COMMAND + 4]
        before = plant[V : V + 3].copy()
        for _ in range(SUBSTEPS):
            flags |= plant_step(plant, command, wind, orders.armed, a, TICK / SUBSTEPS)
        memory[ACCELERATION : ACCELERATION + 3] = (plant[V : V + 3] - before) / TICK
        command[:] = staged
        w1, w2 = plant[ACTUATOR], plant[ACTUATOR + 1]
        memory[ENERGY] += a.k_m * (w1**3 + w2**3) * TICK
        memory[SINCE] += TICK
        hover_linear.error(plant, orders.target, orders.heading, x)
        memory[LYAPUNOV] = hover_linear.lyapunov(x, laws.linear)
        _follow(plant, memory, orders, laws, x_forward)
        conditions = watch(plant, memory, orders, laws.sight.guidance, a, TICK)
        if _leaves(conditions, orders.law, jump_sets):
            return k + 1, flags, conditions
    return ticks, flags, conditions


@njit(cache=True)
def _air(plant: Array, memory: Array, air: Surroundings, row: int) -> Array:
    gust = memory[GUST : GUST + 3]
    if air.gust_rms > 0.0:
        airspeed = 0.0
        for axis in range(3):
            airspeed += (plant[V + axis] - air.wind[axis] - gust[axis]) ** 2
        gust_step(gust, air.noise[row], air.gust_rms, air.gust_length, math.sqrt(airspeed), TICK)
    return air.wind + gust


@njit(cache=True)
def _sense(plant: Array, memory: Array, wind: Array, air: Surroundings, laws: Laws, row: int, a: Airframe) -> None:
    """Read the sensors and advance the wind estimate."""
    noise, sensors = air.readings[row], air.sensors
    velocity = plant[V : V + 3] + sensors.velocity * noise[:3]
    normal = air_filter.specific_force(plant, wind, a)[2] + sensors.accelerometer * noise[3]
    pitot = math.nan
    if sensors.has_pitot:
        pitot = rotate_inverse(plant[Q : Q + 4], plant[V : V + 3] - wind)[0] + sensors.pitot * noise[4]
    filtered = memory[AIR : AIR + air_filter.SIZE]
    air_filter.update(plant, velocity, normal, pitot, filtered, laws.air, laws.airframe, TICK)


@njit(cache=True)
def _law(
    plant: Array, memory: Array, orders: Orders, laws: Laws, x: Array, x_forward: Array, u: Array, staged: Array
) -> int:
    """Commands of the law in force into ``staged`` (4,); what the allocation gave up."""
    memory[GOVERNOR] = 0.0
    a = laws.airframe
    if orders.law == LANDED:
        staged[0] = staged[1] = a.omega_min if orders.armed else 0.0
        staged[2] = staged[3] = 0.0
        return 0
    if orders.law in (LINEAR, ZERO_MOMENT, ALIGN, HOVER_ATTITUDE):
        _hover(plant, memory, orders, laws, x, u)
        if orders.law in (ZERO_MOMENT, HOVER_ATTITUDE):
            _smooth(memory, a, u)
        return int(allocate(u, a, staged))
    wind = memory[AIR : AIR + 3]
    if orders.law == FORWARD_LINEAR:
        speed = orders.path.airspeed
        steep = _forward_error(plant, wind, orders.path, laws.forward, x_forward)
        forward_linear.control(x_forward, speed, steep, laws.forward, u)
        return _deflect(u, a, staged)
    if orders.law == LINE_OF_SIGHT and laws.report_flies:
        path, state = orders.path, memory[REPORT : REPORT + report_forward.SIZE]
        report_forward.control(plant, wind, path.end, path.airspeed, laws.report, TICK, state, u)
        return _deflect(u, a, staged)
    if orders.law in (TO_FORWARD, LINE_OF_SIGHT):
        memory[COURSE] = course_of(plant, memory, orders)
    phase = line_of_sight.CRUISE
    if orders.law == TO_HOVER:
        phase = line_of_sight.BRAKE
        _turn_to_hover(plant, memory, orders)
    elif orders.law == FAILSAFE:
        phase = line_of_sight.ARREST
    return int(
        line_of_sight.control(
            plant,
            memory[SIGHT : SIGHT + line_of_sight.SIZE],
            orders.path,
            wind,
            memory[COURSE],
            phase,
            memory[ACCELERATION : ACCELERATION + 3],
            laws.sight,
            a,
            TICK,
            staged,
        )
    )


@njit(cache=True)
def _hover(plant: Array, memory: Array, orders: Orders, laws: Laws, x: Array, u: Array) -> None:
    """Virtual commands (T1, T2, d1 T1, d2 T2) of the laws that allocate them as in the hover, into ``u`` (4,)."""
    if orders.law == LINEAR:
        integral = memory[INTEGRAL : INTEGRAL + 3]
        hover_linear.integrate(plant, orders.target, integral, laws.linear, TICK)
        hover_linear.control(x, integral, orders.heading, laws.linear, u)
    elif orders.law == ZERO_MOMENT:
        _zero_moment(plant, memory, orders.target, orders.heading, orders, laws, u)
    elif orders.law == ALIGN:
        memory[COURSE] = course_of(plant, memory, orders)
        _zero_moment(plant, memory, memory[HOLD : HOLD + 3], memory[COURSE], orders, laws, u)
    else:
        state = memory[ATTITUDE : ATTITUDE + hover_attitude.SIZE]
        pose, rates, force = orders.attitude, orders.rates, orders.force
        gains, loop, a = laws.attitude, laws.zero_moment, laws.airframe
        hover_attitude.control(plant, state, pose, rates, force, gains, loop, a, TICK, u)


@njit(cache=True)
def _smooth(memory: Array, a: Airframe, u: Array) -> None:
    """Bumpless transfer: begin where the law before left off, and let the difference fade."""
    bump = memory[BUMP : BUMP + 4]
    if math.isnan(bump[0]):
        for i in range(2):
            thrust = a.k_f * memory[COMMAND + i] ** 2
            bump[i], bump[i + 2] = thrust - u[i], thrust * memory[COMMAND + 2 + i] - u[i + 2]
    for i in range(4):
        u[i] += bump[i]
        bump[i] *= 1.0 - TICK / FADE


@njit(cache=True)
def _turn_to_hover(plant: Array, memory: Array, orders: Orders) -> None:
    """At the end of the braking the heading goes over to that of the hover to come."""
    if math.hypot(plant[V], plant[V + 1]) < TURN_BELOW:
        off = orders.heading - memory[COURSE]
        off = math.atan2(math.sin(off), math.cos(off))
        memory[COURSE] += min(max(off, -TURN_RATE * TICK), TURN_RATE * TICK)


@njit(cache=True)
def _zero_moment(
    plant: Array, memory: Array, target: Array, heading: float, orders: Orders, laws: Laws, u: Array
) -> None:
    e, v = plant[P : P + 3] - target, plant[V : V + 3]
    gains = laws.zero_moment
    memory[GOVERNOR] = activity((e[0], e[1], e[2]), (v[0], v[1], v[2]), orders.speed, gains.governor)
    state = memory[LAW : LAW + hover_zero_moment.SIZE]
    hover_zero_moment.control(plant, state, target, hover(heading), orders.speed, gains, TICK, u)


@njit(cache=True)
def _deflect(u: Array, a: Airframe, staged: Array) -> int:
    """Thrusts and deflections as commands: the elevons are not divided by the thrust here."""
    virtual = np.array((u[0], u[1], u[2], u[3]))
    low, high = a.k_f * a.omega_min**2, a.k_f * a.omega_max**2
    T1, T2 = min(max(u[0], low), high), min(max(u[1], low), high)
    virtual[2], virtual[3] = u[2] * T1, u[3] * T2
    return int(allocate(virtual, a, staged))


@njit(cache=True)
def _forward_error(plant: Array, wind: Array, path: Path, gains: ForwardGains, x: Array) -> float:
    north, west = path.end[0] - path.start[0], path.end[1] - path.start[1]
    climb = math.atan2(path.end[2] - path.start[2], math.hypot(north, west))
    course = math.atan2(west, north)
    return float(forward_linear.error(plant, wind, path.start, course, climb, path.airspeed, gains, x))


@njit(cache=True)
def _follow(plant: Array, memory: Array, orders: Orders, laws: Laws, x_forward: Array) -> None:
    """Measure where a flight is beside what it follows, and V of the law that follows it."""
    memory[LYAPUNOV_FORWARD] = memory[LYAPUNOV_ATTITUDE] = math.nan
    if orders.law == HOVER_ATTITUDE:
        state = memory[ATTITUDE : ATTITUDE + hover_attitude.SIZE]
        memory[LYAPUNOV_ATTITUDE] = hover_attitude.lyapunov(plant, state, laws.zero_moment)
    if orders.law < TO_FORWARD or orders.law in (FAILSAFE, HOVER_ATTITUDE):
        memory[CROSS_TRACK] = 0.0
        return
    memory[CROSS_TRACK] = cross_track(orders.path, plant[P : P + 3])
    if orders.path.kind == LEG and orders.law in (LINE_OF_SIGHT, FORWARD_LINEAR):
        wind = memory[AIR : AIR + 3]
        _forward_error(plant, wind, orders.path, laws.forward, x_forward)
        memory[LYAPUNOV_FORWARD] = forward_linear.lyapunov(x_forward, orders.path.airspeed, laws.forward)


@njit(cache=True)
def _leaves(conditions: int, law: int, jump_sets: npt.NDArray[np.int64]) -> bool:
    """Whether the conditions are in a jump set of the law in force."""
    for row in range(jump_sets.shape[1]):
        when, unless = jump_sets[law, row, 0], jump_sets[law, row, 1]
        if (conditions & when) == when and (conditions & unless) == 0:
            return True
    return False
