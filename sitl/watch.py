"""The supervisor's conditions, evaluated on the state: the bits its table of jumps is written in."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.hybrid.conditions import Condition
from sitl.kernels.ground import on_ground
from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import rotate
from sitl.kernels.state import P, Q, V
from sitl.laws.forward_guidance import GuidanceGains, due_to_stop, ground_speed
from sitl.laws.path import LEG, Path, aim
from sitl.memory_layout import AIR, AT_REST, COURSE, LYAPUNOV, LYAPUNOV_ATTITUDE, LYAPUNOV_FORWARD, SINCE

C = Condition
LANDED, TO_FORWARD, TO_HOVER, HOVER_ATTITUDE = 0, 4, 7, 9
DWELL = 0.5  # [s]
WING_SPEED = 8.0  # the wing carries from this airspeed on, or from most of the wanted one [m/s]
WING_SHARE = 0.85
WORTH_DISTANCE = 15.0  # less than this of a leg is not worth tipping over for [m]
SETTLED_SHARE = 0.5  # of v_enter
ROOM = 2.0  # braking distances that make it worth flying on [-]
SLIDE_TIME, SLIDE_SPEED = 4.0, 4.0  # [s], [m/s]
WINDY, STILL = 4.0, 3.0  # level wind [m/s]
CALM_SPEED = 3.5  # [m/s]
ALIGNED_SPEED = 2.5  # [m/s]
ALIGNED_ANGLE = math.radians(12.0)
STANDING_SPEED = 2.0  # [m/s]
FALL = 14.0  # no law sinks faster than this for long [m/s]
GROUND_TIME = 0.8  # nearer to the ground than this at the present sink rate, a fall is caught [s]
SINK = 3.0  # what counts as sinking there [m/s]
LOST = 0.3  # V of the attitude law when it is 45 deg off at rest [rad2]

_ARMED, _FLYING, _RESTING = int(C.ARMED), int(C.FLYING), int(C.RESTING)
_NEAR, _FAR, _SETTLED = int(C.NEAR), int(C.FAR), int(C.SETTLED)
_WANTED, _WORTH = int(C.WANTED), int(C.WORTH)
_ALIGNED, _CALM, _WING_BORNE, _STOP_DUE = int(C.ALIGNED), int(C.CALM), int(C.WING_BORNE), int(C.STOP_DUE)
_WINDY, _STILL, _SLIDING, _STEERED = int(C.WINDY), int(C.STILL), int(C.SLIDING), int(C.STEERED)
_STRAIGHT, _ON_TRIM, _OFF_TRIM = int(C.STRAIGHT), int(C.ON_TRIM), int(C.OFF_TRIM)
_STANDING, _FALLING, _RECOVERED, _DWELT, _ROOM = (
    int(C.STANDING),
    int(C.FALLING),
    int(C.RECOVERED),
    int(C.DWELT),
    int(C.ROOM),
)


class Orders(NamedTuple):
    """What the flow is told; constant until the next jump or autopilot tick."""

    law: int
    target: Array  # world NWU, (3,) [m]
    heading: float  # [rad]
    speed: float  # horizontal speed limit of the hover laws [m/s]
    armed: bool
    flying: bool
    landing: bool
    forward: bool  # the path shall be flown on the wing
    path: Path
    v_enter: float
    v_leave: float
    v_forward_enter: float
    v_forward_leave: float
    settle_time: float  # on the ground at rest this long is landed [s]
    steered: bool  # the attitude below shall be flown
    attitude: Array  # body FLU in world NWU, (4,)
    rates: Array  # of that attitude, in its body frame, (3,) [rad/s]
    force: float  # along the nose [N]


@njit(cache=True)
def watch(plant: Array, memory: Array, orders: Orders, limits: GuidanceGains, a: Airframe, dt: float) -> int:
    """The conditions that hold now, as bits; how long it has rested on the ground is counted on by ``dt``."""
    bits = (_ARMED if orders.armed else 0) | (_FLYING if orders.flying else 0) | (_STEERED if orders.steered else 0)
    resting = orders.law != LANDED and orders.landing and on_ground(plant, a) and abs(plant[V + 2]) < 0.3
    memory[AT_REST] = memory[AT_REST] + dt if resting else (0.0 if dt > 0.0 else memory[AT_REST])
    bits |= _RESTING if memory[AT_REST] >= orders.settle_time else 0
    # V does not see the sign of the quaternion's scalar part: it is as small with the nose straight down.
    upright = plant[Q + 1] * plant[Q + 3] - plant[Q] * plant[Q + 2] > 0.0
    bits |= _NEAR if memory[LYAPUNOV] < orders.v_enter and upright and memory[SINCE] >= 0.0 else 0
    bits |= _SETTLED if memory[LYAPUNOV] < SETTLED_SHARE * orders.v_enter and upright else 0
    bits |= _FAR if memory[LYAPUNOV] > orders.v_leave else 0
    bits |= _DWELT if memory[SINCE] >= DWELL else 0
    level = math.hypot(memory[AIR], memory[AIR + 1])
    bits |= _WINDY if level > WINDY else (_STILL if level < STILL else 0)
    bits |= _motion(plant, memory, orders)
    if math.isinf(orders.v_leave):  # a hover law that is never to be left is flown alone, whatever comes of it
        bits &= ~(_WINDY | _SLIDING | _FALLING)
    if orders.law == HOVER_ATTITUDE:
        return bits | (_OFF_TRIM if memory[LYAPUNOV_ATTITUDE] > LOST else 0)
    return bits | _path(plant, memory, orders, limits)


@njit(cache=True)
def _motion(plant: Array, memory: Array, orders: Orders) -> int:
    q, v = plant[Q : Q + 4], plant[V : V + 3]
    nose, belly = rotate(q, np.array((1.0, 0.0, 0.0))), rotate(q, np.array((0.0, 0.0, -1.0)))
    speed = math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    bits = 0
    if nose[2] > 0.5 and speed < CALM_SPEED:
        bits |= _CALM
    if nose[2] > 0.7 and speed < ALIGNED_SPEED:
        bits |= _RECOVERED
        off = math.atan2(belly[1], belly[0]) - memory[COURSE]
        if math.cos(off) > math.cos(ALIGNED_ANGLE):
            bits |= _ALIGNED
    if nose[2] > 0.3 and speed < STANDING_SPEED:
        bits |= _STANDING
    if memory[SINCE] > SLIDE_TIME and speed > SLIDE_SPEED and nose[2] < 0.9:
        bits |= _SLIDING
    low = plant[P + 2] + GROUND_TIME * v[2] < 0.0 and v[2] < -SINK
    if orders.law != LANDED and (v[2] < -FALL or low):
        bits |= _FALLING
    return bits


@njit(cache=True)
def _path(plant: Array, memory: Array, orders: Orders, limits: GuidanceGains) -> int:
    if not orders.forward and orders.law < TO_FORWARD:
        return 0  # upright, and to stay so
    path, wind, p, v = orders.path, memory[AIR : AIR + 3], plant[P : P + 3], plant[V : V + 3]
    airspeed = math.sqrt((v[0] - wind[0]) ** 2 + (v[1] - wind[1]) ** 2 + (v[2] - wind[2]) ** 2)
    bits = _WING_BORNE if airspeed > min(WING_SPEED, WING_SHARE * path.airspeed) else 0
    if path.kind == LEG:
        bits |= _STRAIGHT
    if orders.forward:
        bits |= _WANTED
        left = math.hypot(path.end[0] - p[0], path.end[1] - p[1])
        if path.kind != LEG or not path.stop or left > WORTH_DISTANCE:
            bits |= _WORTH
        if due_to_stop(p, v, wind, path, 1.0, limits):
            bits |= _STOP_DUE
        elif orders.law == TO_HOVER and not due_to_stop(p, v, wind, path, ROOM, limits):
            bits |= _ROOM
    V_forward = memory[LYAPUNOV_FORWARD]
    bits |= _ON_TRIM if V_forward < orders.v_forward_enter else 0
    return bits | (0 if V_forward <= orders.v_forward_leave else _OFF_TRIM)


@njit(cache=True)
def course_of(plant: Array, memory: Array, orders: Orders) -> float:
    """Azimuth of the air velocity that flies along the path: where belly or nose are to point [rad]."""
    path, wind, p, v = orders.path, memory[AIR : AIR + 3], plant[P : P + 3], plant[V : V + 3]
    north, west = aim(path, p, math.hypot(v[0], v[1]))
    if north == 0.0 and west == 0.0:
        return float(memory[COURSE])
    over_ground = ground_speed(north, west, wind, path.airspeed)
    return math.atan2(over_ground * west - wind[1], over_ground * north - wind[0])
