"""A leg as a control problem: the plant in space or in its plane of symmetry, its trims, limits, ends and guesses.

Actuators are states, their rates the controls, so that rate limits are bounds; where actuators lag instead, the command
``position + tau rate`` has the limits. In the plane both sides act alike: states are north, up, their rates, the nose's
elevation, the rate of pitch, motors and elevons; the plant is the same text.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple, Protocol

import casadi as ca
import numpy as np

from sitl import Airframe, Array, SitlError, Vector, load_airframe
from sitl.design.trim import level_trim, trims
from sitl.enclosure.arena_files import Obstacle, load_arena
from sitl.lab.optimal.collocation import ControlProblem, Course, sampled_course
from sitl.lab.optimal.question import CRUISE_END, POINT_END, Question
from sitl.lab.optimal.symbols import Expression, Symbol, compiler_options, plant_rates
from sitl.model.airframe import FIRST_ORDER
from sitl.model.propeller import hover_speed
from sitl.model.quaternions import from_euler

BODY, PLANT_STATES, FOUR_ACTUATORS = 13, 17, 4
FASTEST, QUICKEST = 40.0, 20.0  # bounds nobody reaches: over ground [m/s], body rates [rad/s]
SMOOTHING = 2e-3  # cost of actuator rates against that of time or energy: without it they are not determined
MOVED_IN = 0.1  # the time in which actuators go through their range where their rates have no limit [s]
POWER_SCALE = 100.0  # [W]
LEAST_HEIGHT = 0.3  # height over the ground [m]
CLEARANCE = 0.4  # from obstacles, of the centre of mass [m]
ROUNDNESS = 6  # power of the rounded boxes that stand for obstacles
GUESS_SAMPLES = 41
TURNED_BY = 0.4  # share of the time in which a guess turns to the leg


class Layout(Protocol):
    """States of a problem, and those of the plant that they make."""

    size: int
    controls: int

    def spread(self, states: Expression) -> Expression:
        """The plant's states, (17,)."""

    def gathered(self, rates: Expression, states: Expression) -> Expression:
        """Rates of change of the problem's body from the plant's body's, (13,)."""

    def of_plant(self, plant: Array) -> Array:
        """The problem's states of plants, (k, 17)."""

    def scales(self, a: Airframe, reach: float) -> Array:
        """Sizes of its states; ``reach`` is that of the leg [m]."""


class Space:
    """Three dimensions: the plant's own states."""

    size, controls = PLANT_STATES, 4

    def spread(self, states: Expression) -> Expression:
        """As they are."""
        return states

    def gathered(self, rates: Expression, states: Expression) -> Expression:  # noqa: ARG002 - as the plane's
        """As they are."""
        return rates

    def of_plant(self, plant: Array) -> Array:
        """As they are."""
        return plant

    def scales(self, a: Airframe, reach: float) -> Array:
        """Of position, velocity, attitude, body rates, actuators."""
        return np.array([reach] * 3 + [10.0] * 3 + [1.0] * 4 + [5.0] * 3 + [a.omega_max] * 2 + [a.delta_max] * 2)


class SymmetryPlane:
    """The vertical plane to the north, both sides alike: x, z, their rates, nose, pitch rate, motors, elevons."""

    size, controls = 8, 2

    def spread(self, states: Expression) -> Expression:
        """The plant's states, (17,)."""
        x, z, vx, vz, nose, rate, motor, elevon = (states[i] for i in range(8))
        c, s = ca.cos(0.5 * nose), ca.sin(0.5 * nose)
        return ca.vertcat(x, 0, z, vx, 0, vz, c, 0, -s, 0, 0, rate, 0, motor, motor, elevon, elevon)

    def gathered(self, rates: Expression, states: Expression) -> Expression:
        """Rates of the body; the nose rises against the pitch rate."""
        return ca.vertcat(rates[0], rates[2], rates[3], rates[5], -states[5], rates[11])

    def of_plant(self, plant: Array) -> Array:
        """The plane's states of plants in it, (k, 8)."""
        nose = -2.0 * np.arctan2(plant[:, 8], plant[:, 6])
        return np.column_stack([plant[:, [0, 2, 3, 5]], nose, plant[:, [11, 13, 15]]])

    def scales(self, a: Airframe, reach: float) -> Array:
        """Of its states."""
        return np.array([reach, reach, 10.0, 10.0, 1.0, 5.0, a.omega_max, a.delta_max])


class ActuatorLimits(NamedTuple):
    """Limits of motors and elevons, two each, what is left for feedback taken off: (4,) each."""

    low: Array
    high: Array
    rate: Array
    lag: Array  # time constants of a first-order model [s]; 0 of a rate limit


def actuator_limits(a: Airframe, share_left: float) -> ActuatorLimits:
    """Limits that a course may use.

    A share of the elevons' range is left on both sides, and of what the motors have above the hover: where both turn
    slowest, one can still be sped up. A share of the rates is left where these are limits.
    """
    top = a.omega_max - share_left * (a.omega_max - hover_speed(a))
    elevon = (1.0 - share_left) * a.delta_max
    lagging = a.actuator_model == FIRST_ORDER
    rates = np.array((a.omega_rate, a.omega_rate, a.delta_rate, a.delta_rate))
    return ActuatorLimits(
        low=np.array((a.omega_min, a.omega_min, -elevon, -elevon)),
        high=np.array((top, top, elevon, elevon)),
        rate=rates if lagging else (1.0 - share_left) * rates,
        lag=np.array((a.motor_tau, a.motor_tau, a.elevon_tau, a.elevon_tau)) * lagging,
    )


@lru_cache(maxsize=8)
def body_function(a: Airframe, layout: type[Layout]) -> ca.Function:
    """Rates of a layout's body and power [W] of its states and the wind (3,), compiled once for all legs."""
    states, wind = ca.SX.sym("states", layout.size), ca.SX.sym("wind", 3)
    rates, power = plant_rates(layout().spread(states), Vector(*(Symbol(wind[i]) for i in range(3))), a)  # type: ignore[arg-type]
    found = ca.cse([layout().gathered(rates, states), power])
    return ca.Function("body", [states, wind], found, compiler_options())


@lru_cache(maxsize=8)
def plant_function(a: Airframe, wind: Vector) -> ca.Function:
    """Rates (13,) and power [W] of the plant's states (17,)."""
    states = ca.SX.sym("states", PLANT_STATES)
    rates, power = plant_rates(states, wind, a)
    return ca.Function("plant", [states], [rates, power])


def directions(states: Expression) -> tuple[Expression, Expression, Expression]:
    """Body axes in the world of the plant's states: x_b the nose, y_b left, z_b away from the belly."""
    w, x, y, z = (states[i] for i in range(6, 10))
    return (
        ca.vertcat(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        ca.vertcat(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        ca.vertcat(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )


def trimmed(a: Airframe, wind: Vector, airspeed: float, heading: float) -> Array:
    """The plant's states at the origin in a hover over ground, or in a level cruise, (17,).

    Args:
        a: The airframe.
        wind: Velocity of the air, world NWU [m/s].
        airspeed: Of the cruise [m/s]; 0: hover, at rest over ground.
        heading: From north towards west [rad].

    Raises:
        SitlError: The actuators cannot hold it.
    """
    c, s = math.cos(heading), math.sin(heading)
    velocity = Vector(airspeed * c + wind.x, airspeed * s + wind.y, 0.0) if airspeed else Vector(0.0, 0.0, 0.0)
    unknown = ca.SX.sym("unknown", 8)
    scale = np.array([1.0] * 4 + [a.omega_max] * 2 + [a.delta_max] * 2)
    real = unknown * scale
    states = ca.vertcat(0, 0, 0, *velocity, real[:4], 0, 0, 0, real[4:])
    rates, _ = plant_function(a, wind)(states)
    _, left, _ = directions(states)
    balance = ca.vertcat(rates[3:6], rates[10:13] / 10, c * left[0] + s * left[1], ca.sumsqr(real[:4]) - 1)
    into_wind = -(wind.x * c + wind.y * s)  # a hover meets as much from ahead
    met = level_trim(a, max(airspeed or into_wind, 0.0))
    guess = [*from_euler(0.0, -met.theta, heading), *[met.omega or hover_speed(a)] * 2, *[met.delta] * 2]
    limits = actuator_limits(a, 0.0)
    solver = ca.nlpsol(
        "trim",
        "ipopt",
        {"x": unknown, "f": 0, "g": balance},
        {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"},
    )
    found = solver(
        x0=np.array(guess) / scale,
        lbx=np.array([-1.1] * 4 + list(limits.low)) / scale,
        ubx=np.array([1.1] * 4 + list(limits.high)) / scale,
        lbg=0.0,
        ubg=0.0,
    )
    if not solver.stats()["success"]:
        what = f"a cruise at {airspeed:g} m/s" if airspeed else f"a hover in {math.hypot(wind.x, wind.y):g} m/s of wind"
        raise SitlError(f"the actuators hold no trim: {what}, heading {math.degrees(heading):.0f} deg")
    solution = np.asarray(found["x"]).ravel() * scale
    return np.concatenate([[0.0] * 3, velocity, solution[:4], [0.0] * 3, solution[4:]])


class LegProblem(NamedTuple):
    """A question made ready to be solved."""

    question: Question
    airframe: Airframe
    layout: Layout
    problem: ControlProblem
    start: Array  # the plant's states, (17,)
    end: Array  # likewise; the heading is free if any will do


def leg_problem(question: Question) -> LegProblem:
    """The control problem of a question.

    Raises:
        SitlError: The question has no answer: bad values, an end that no actuators hold, or that is out of bounds.
    """
    question.check()
    a, wind = load_airframe(question.airframe).parameters, question.wind
    layout: Layout = SymmetryPlane() if question.is_planar else Space()
    start = trimmed(a, wind, question.airspeed if question.start == CRUISE_END else 0.0, -question.turn)
    end = trimmed(a, wind, question.airspeed if question.end == CRUISE_END else 0.0, 0.0)
    start[:3] = question.place
    end[:3] = start[:3] + np.array((question.distance, 0.0, question.climb))
    if end[6:10] @ start[6:10] < 0.0:
        end[6:10] *= -1.0
    limits = actuator_limits(a, question.share_left)
    _check_ends(question, start, end, limits)
    states, controls = ca.MX.sym("states", layout.size), ca.MX.sym("rates", layout.controls)
    rates, power = body_function(a, type(layout))(states, ca.DM(wind))
    pairs = slice(None) if layout.controls == FOUR_ACTUATORS else slice(0, FOUR_ACTUATORS, 2)
    rate_scale = np.minimum(limits.rate, (limits.high - limits.low) / MOVED_IN)[pairs]
    for_time = math.isinf(question.time_price)
    busy = ca.sumsqr(controls / rate_scale)
    running = busy * SMOOTHING if for_time else power + busy * SMOOTHING * POWER_SCALE
    path, path_low, path_high = _path(question, layout, limits, pairs)
    met = _end(question, layout, states, end, rates)
    low, high = _state_bounds(question, layout, limits, start, end)
    longest = 10.0 + 2.0 * (question.distance + abs(question.climb)) / 3.0
    problem = ControlProblem(
        dynamics=ca.Function("leg", [states, controls], [ca.vertcat(rates, controls), running]),
        state_bounds=(low, high),
        control_bounds=(-limits.rate[pairs], limits.rate[pairs]),
        start=layout.of_plant(start[None])[0],
        end=ca.Function("end", [states, controls], [met]),
        end_bounds=(np.zeros(met.numel()), np.zeros(met.numel())),
        time_bounds=(0.2, longest),
        scales=(layout.scales(a, max(10.0, 0.2 * question.distance)), rate_scale),
        time_weight=1.0 if for_time else question.time_price,
        cost_scale=1.0 if for_time else POWER_SCALE,
        path=path,
        path_bounds=(path_low, path_high),
    )
    return LegProblem(question, a, layout, problem, start, end)


def _check_ends(question: Question, start: Array, end: Array, limits: ActuatorLimits) -> None:
    for name, state in (("start", start), ("end", end)):
        act = state[BODY:]
        if np.any(act < limits.low - 1e-6) or np.any(act > limits.high + 1e-6):
            raise SitlError(f"the {name}'s trim needs more than the actuators give with a share of "
                            f"{question.share_left:g} left")  # fmt: skip
        if question.arena and (
            reason := load_arena(question.arena).refuse((float(state[0]), float(state[1]), float(state[2])))
        ):
            raise SitlError(f"the {name} of the leg: {reason}")


def _state_bounds(
    question: Question, layout: Layout, limits: ActuatorLimits, start: Array, end: Array
) -> tuple[Array, Array]:
    """Of the problem's states: height band, arena, and bounds that only keep IPOPT near."""
    bottom = max(min(start[2], end[2]) - question.room[0], LEAST_HEIGHT)
    top = max(start[2], end[2]) + question.room[1]
    far = question.distance + 100.0
    low = [start[0] - far, start[1] - far, bottom, *[-FASTEST] * 3, *[-1.5] * 4, *[-QUICKEST] * 3, *limits.low]
    high = [start[0] + far, start[1] + far, top, *[FASTEST] * 3, *[1.5] * 4, *[QUICKEST] * 3, *limits.high]
    bounds = np.array((low, high))
    if layout.size == PLANT_STATES:
        return bounds[0], bounds[1]
    in_plane = [0, 2, 3, 5, 6, 11, 13, 15]
    bounds = bounds[:, in_plane]
    bounds[:, 4] = np.radians(question.nose)
    return bounds[0], bounds[1]


def _path(question: Question, layout: Layout, limits: ActuatorLimits, pairs: slice) -> tuple[ca.Function, Array, Array]:
    """Bounded on the way: commands of lagging actuators, the nose, air along the wing, the distance from obstacles."""
    states, controls = ca.SX.sym("states", layout.size), ca.SX.sym("rates", layout.controls)
    plant = layout.spread(states)
    parts, low, high = [], [], []
    if controls.numel() == FOUR_ACTUATORS:  # in the plane it is a bound of a state
        nose, left, up = directions(plant)
        down, back = np.radians(question.nose)
        parts = [nose[2] * math.cos(down) - up[2] * math.sin(down), up[2] * math.sin(back) - nose[2] * math.cos(back)]
        parts.append(ca.dot(left, plant[3:6] - ca.DM(question.wind)) / question.sideways)
        low, high = [0.0, 0.0, -1.0], [math.inf, math.inf, 1.0]
    if limits.lag.any():
        size = limits.high[pairs]
        parts.append((plant[BODY:][pairs] + controls * limits.lag[pairs]) / size)
        low += list(limits.low[pairs] / size)
        high += [1.0] * len(size)
    if question.arena:
        arena = load_arena(question.arena)
        ahead, left = arena.inside((plant[0], plant[1], plant[2]))
        sides = (arena.half_length - arena.margin, arena.half_width - arena.margin, arena.height - arena.margin)
        parts += [ahead / sides[0], left / sides[1], plant[2] / sides[2]]
        low, high = [*low, -1.0, -1.0, 0.0], [*high, 1.0, 1.0, 1.0]
        parts += [_roundness(obstacle, plant) for obstacle in arena.obstacles]
        low, high = low + [1.0] * len(arena.obstacles), high + [math.inf] * len(arena.obstacles)
    return ca.Function("path", [states, controls], [ca.vertcat(*parts)]), np.array(low), np.array(high)


def _roundness(obstacle: Obstacle, plant: Expression) -> Expression:
    """At least 1 outside of a rounded solid that holds an obstacle and the clearance from it."""
    x, y, z = plant[0] - obstacle.north, plant[1] - obstacle.west, plant[2] - 0.5 * (obstacle.bottom + obstacle.top)
    half = 0.5 * (obstacle.top - obstacle.bottom) + CLEARANCE
    c, s = math.cos(obstacle.course), math.sin(obstacle.course)
    ahead, left = (
        (x * c + y * s) / (obstacle.half_length + CLEARANCE),
        (y * c - x * s) / (obstacle.half_width + CLEARANCE),
    )
    if obstacle.is_round:
        across, corners = (ahead * ahead + left * left) ** (ROUNDNESS // 2), 2.0
    else:
        across, corners = ahead**ROUNDNESS + left**ROUNDNESS, 3.0
    return ((across + (z / half) ** ROUNDNESS) / corners + 1e-9) ** (1.0 / ROUNDNESS)


def _end(question: Question, layout: Layout, states: Expression, end: Array, rates: Expression) -> Expression:
    """Zero at the end: the way from its trim; where any heading will do, the accelerations stand for attitude."""
    if layout.size != PLANT_STATES:
        return (states - layout.of_plant(end[None])[0]) / np.array([1.0] * 6 + [1000.0, 1.0])
    plant = layout.spread(states)
    motion = ca.vertcat(plant[:6] - end[:6], plant[10:13])
    if question.end == POINT_END:
        return ca.vertcat(motion, rates[3:6], rates[10:13] / 10.0)
    w, x, y, z = end[6:10]
    away = np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])  # vector part of the turn from the end's attitude
    actuators = (plant[BODY:] - end[BODY:]) / np.array([1000.0, 1000.0, 1.0, 1.0])
    return ca.vertcat(motion, ca.DM(away) @ plant[6:10], actuators)


class Manner(NamedTuple):
    """A way to fly a leg, as a guess to begin with."""

    name: str
    speed: float  # at most [m/s]
    accel: float  # [m/s2]
    leans: bool  # the nose as in a trim at that speed; else up


MANNERS = (
    Manner("as a wing", 15.0, 5.0, leans=True),
    Manner("upright", 6.0, 2.5, leans=False),
    Manner("as a slow wing", 10.0, 2.5, leans=True),
    Manner("as a fast wing", 22.0, 8.0, leans=True),
)
MORE_MANNERS = (  # tried where the best two of the others do not agree
    Manner("as a wing at 12 m/s", 12.0, 4.0, leans=True),
    Manner("as a wing at 18 m/s", 18.0, 6.0, leans=True),
    Manner("as a wing at 8 m/s", 8.0, 2.0, leans=True),
)


def guess(leg: LegProblem, manner: Manner) -> Course:
    """A course to begin with: straight, attitudes by the speed, actuators in line from end to end."""
    way = leg.end[:3] - leg.start[:3]
    length = max(float(np.linalg.norm(way)), 0.5)
    along = np.linspace(0.0, length, GUESS_SAMPLES)
    begin, last = (float(np.linalg.norm(state[3:6])) for state in (leg.start, leg.end))
    speed = np.sqrt(np.minimum(begin**2 + 2.0 * manner.accel * along, last**2 + 2.0 * manner.accel * (length - along)))
    speed = np.minimum(speed, max(manner.speed, begin, last))
    times = np.concatenate([[0.0], np.cumsum(np.diff(along) / np.maximum(0.5 * (speed[1:] + speed[:-1]), 0.3))])
    share = times / times[-1]
    states = np.outer(1.0 - share, leg.start) + np.outer(share, leg.end)
    states[:, :3] = leg.start[:3] + np.outer(along / length, way)
    states[1:-1, 3:6] = np.outer(speed[1:-1] / length, way)
    noses = np.full(GUESS_SAMPLES, 0.5 * math.pi)
    if manner.leans or leg.question.start == leg.question.end == CRUISE_END:
        air = np.maximum(speed - leg.question.tail_wind, 0.0)
        noses = np.array([trim.theta for trim in trims(leg.airframe, np.minimum(air, 20.0))])
    heading = -leg.question.turn * np.maximum(1.0 - share / TURNED_BY, 0.0)
    for i in range(1, GUESS_SAMPLES - 1):
        q = np.array(from_euler(0.0, -float(noses[i]), float(heading[i])))
        states[i, 6:10] = q if q @ states[i - 1, 6:10] >= 0.0 else -q
    if states[-1, 6:10] @ states[-2, 6:10] < 0.0:
        states[-1, 6:10] *= -1.0
    return sampled_course(times, leg.layout.of_plant(states), leg.layout.controls)
