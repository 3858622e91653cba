"""The flow between jumps: laws, actuators and plant, tick after tick in one compiled call.

This is the flow map of the vehicle's hybrid system, and its flow set as well: the call returns early at the
first tick after which the law in force should be left, so that the supervisor's table can jump.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.kernels.ground import on_ground
from sitl.kernels.integrate import plant_step
from sitl.kernels.parameters import Airframe, Array
from sitl.kernels.quaternion import hover
from sitl.kernels.state import ACTUATOR, V
from sitl.kernels.wind import gust_step
from sitl.laws import hover_linear, hover_zero_moment
from sitl.laws.allocation import allocate
from sitl.laws.governor import activity
from sitl.laws.hover_linear import LinearGains
from sitl.laws.hover_zero_moment import ZeroMomentGains

TICK = 0.002  # control period [s]
SUBSTEPS = 2  # plant steps per tick
LANDED, LINEAR, ZERO_MOMENT = 0, 1, 2  # the supervisor's laws, as the compiled code sees them

# Layout of the memory the flow keeps beside the plant's state.
LAW = 0  # q_d, f of the zero-moment law, 5 entries
INTEGRAL = 5  # of the linear law, world [m s], 3 entries
GUST = 8  # world NWU [m/s], 3 entries
COMMAND = 11  # in force this tick: w1, w2, d1, d2, 4 entries
ENERGY = 15  # at the shafts [J]
AT_REST = 16  # how long it has rested on the ground [s]
GOVERNOR = 17  # share of the force the governor takes away, 0..1
LYAPUNOV = 18  # V of the linear hover law
MEMORY = 19


class Surroundings(NamedTuple):
    """The air of one stretch of flow."""

    wind: Array  # steady, world NWU, (3,) [m/s]
    gust_rms: float  # per axis [m/s]
    gust_length: float  # [m]
    noise: Array  # unit normals, a row per tick, (n, 3)


class Orders(NamedTuple):
    """What the flow is told; constant until the next jump or autopilot tick."""

    law: int
    target: Array  # world NWU, (3,) [m]
    heading: float  # [rad]
    speed: float  # horizontal speed limit [m/s]
    armed: bool
    landing: bool
    v_enter: float
    v_leave: float
    settle_time: float  # on the ground at rest this long is landed [s]


@njit(cache=True)
def flow(
    plant: Array,
    memory: Array,
    orders: Orders,
    air: Surroundings,
    linear: LinearGains,
    zero_moment: ZeroMomentGains,
    a: Airframe,
    ticks: int,
    first: int,
) -> tuple[int, int]:
    """Fly up to ``ticks`` control ticks; stop after the one that leaves the flow set.

    Args:
        plant: Plant state, changed in place.
        memory: The flow's memory, changed in place, (MEMORY,).
        orders: What to fly.
        air: Wind and the noise of the gusts.
        linear: Gains of the linear law.
        zero_moment: Gains of the zero-moment law.
        a: The airframe.
        ticks: How many ticks at most.
        first: Row of ``air.noise`` of the first tick.

    Returns:
        Ticks flown, and the DARKO_LIMIT bits that were active in any of them.
    """
    x, u, staged = np.empty(12), np.empty(4), np.empty(4)
    q_ref = hover(orders.heading)
    flags = 0
    hover_linear.error(plant, orders.target, orders.heading, x)
    for k in range(ticks):
        wind = _air(plant, memory, air, first + k)
        _law(plant, memory, orders, linear, zero_moment, x, q_ref, u)
        if orders.law == LANDED:
            staged[0] = staged[1] = a.omega_min if orders.armed else 0.0
            staged[2] = staged[3] = 0.0
        else:
            allocate(u, a, staged)
        command = memory[COMMAND : COMMAND + 4]
        for _ in range(SUBSTEPS):
            flags |= plant_step(plant, command, wind, orders.armed, a, TICK / SUBSTEPS)
        command[:] = staged
        w1, w2 = plant[ACTUATOR], plant[ACTUATOR + 1]
        memory[ENERGY] += a.k_m * (w1**3 + w2**3) * TICK
        hover_linear.error(plant, orders.target, orders.heading, x)
        memory[LYAPUNOV] = hover_linear.lyapunov(x, linear)
        if _leaves(plant, memory, orders, a):
            return k + 1, flags
    return ticks, flags


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
def _law(
    plant: Array,
    memory: Array,
    orders: Orders,
    linear: LinearGains,
    zero_moment: ZeroMomentGains,
    x: Array,
    q_ref: Array,
    u: Array,
) -> None:
    memory[GOVERNOR] = 0.0
    if orders.law == LINEAR:
        integral = memory[INTEGRAL : INTEGRAL + 3]
        hover_linear.integrate(plant, orders.target, integral, linear, TICK)
        hover_linear.control(x, integral, orders.heading, linear, u)
    elif orders.law == ZERO_MOMENT:
        e, v = plant[0:3] - orders.target, plant[V : V + 3]
        memory[GOVERNOR] = activity((e[0], e[1], e[2]), (v[0], v[1], v[2]), orders.speed, zero_moment.governor)
        state = memory[LAW : LAW + hover_zero_moment.SIZE]
        hover_zero_moment.control(plant, state, orders.target, q_ref, orders.speed, zero_moment, TICK, u)


@njit(cache=True)
def _leaves(plant: Array, memory: Array, orders: Orders, a: Airframe) -> bool:
    """Whether the state is outside the flow set of the law in force."""
    if orders.law == LANDED:
        return False
    resting = orders.landing and on_ground(plant, a) and abs(plant[V + 2]) < 0.3
    memory[AT_REST] = memory[AT_REST] + TICK if resting else 0.0
    if memory[AT_REST] >= orders.settle_time:
        return True
    if orders.law == LINEAR:
        return bool(memory[LYAPUNOV] > orders.v_leave)
    return bool(memory[LYAPUNOV] < orders.v_enter)
