"""Result of an identification: values with intervals, unknowns it could not tell and why, and the errors left."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sitl import Airframe, Array
from sitl.lab.identification import rotations
from sitl.lab.identification.flight_log import GRID_STEP, LEAD_TIME
from sitl.lab.identification.path_reconstruction import ReconstructedPath
from sitl.lab.identification.regression import NORMAL_95, RESIDUAL_AXES, FitProblem, Nuisance, Solution
from sitl.lab.identification.replay import ActuatorHistory, accelerations, actuator_positions, shots
from sitl.lab.identification.unknowns import Unknown, value_at, value_of
from sitl.model.propeller import speed_for

# Joint effects of an airframe's constants: accelerations per thrust, deflection and rate, which flights tell best.


CRUISE, INCIDENCE = 15.0, math.radians(6.0)  # where forward flight is looked at [m/s], [rad]
ELEVON_STEP, MOTOR_STEP, RATE_STEP = 0.02, 5.0, 0.1  # half the differences [rad], [rad/s], [rad/s]


class Effect(NamedTuple):
    """One of them."""

    name: str
    unit: str
    forward: bool = False  # of forward flight


EFFECTS = (
    Effect("thrust coefficient / mass", "m"),
    Effect("lift slope / mass", "1/(kg rad)"),
    Effect("pitch by elevons, hover", "1/s2"),
    Effect("roll by elevons, hover", "1/s2"),
    Effect("yaw by motors, hover", "1/s"),
    Effect("roll by motors, hover", "1/s"),
    Effect("pitch by elevons, 15 m/s", "1/s2", forward=True),
    Effect("roll by elevons, 15 m/s", "1/s2", forward=True),
    Effect("roll damping, 15 m/s", "1/s", forward=True),
    Effect("pitch damping, 15 m/s", "1/s", forward=True),
    Effect("yaw damping, 15 m/s", "1/s", forward=True),
)


def effect_values(a: Airframe, at: Airframe) -> Array:
    """Values of :data:`EFFECTS`.

    Args:
        a: The airframe.
        at: The set, whose hovering motor speed says where it is looked at.
    """
    speed = speed_for(0.5 * at.m * at.g, 0.0, at)
    still, cruise = np.zeros(3), np.array([CRUISE * math.cos(INCIDENCE), 0.0, -CRUISE * math.sin(INCIDENCE)])
    both, differ = np.array([0.0, 0.0, ELEVON_STEP, ELEVON_STEP]), np.array([0.0, 0.0, ELEVON_STEP, -ELEVON_STEP])
    motors, p, q, r = np.array([MOTOR_STEP, -MOTOR_STEP, 0.0, 0.0]), *(RATE_STEP * np.eye(3))
    none, rest = np.zeros(4), np.zeros(3)
    moves = (
        (still, both, rest, 1, 2.0 * ELEVON_STEP), (still, differ, rest, 0, -4.0 * ELEVON_STEP),
        (still, motors, rest, 2, -4.0 * MOTOR_STEP), (still, motors, rest, 0, 4.0 * MOTOR_STEP),
        (cruise, both, rest, 1, 2.0 * ELEVON_STEP), (cruise, differ, rest, 0, -4.0 * ELEVON_STEP),
        (cruise, none, p, 0, -2.0 * RATE_STEP), (cruise, none, q, 1, -2.0 * RATE_STEP),
        (cruise, none, r, 2, -2.0 * RATE_STEP),
    )  # fmt: skip
    v = np.array([move[0] for move in moves for _ in range(2)])
    trim = np.array([speed, speed, 0.0, 0.0])
    actuators = np.array([trim + sign * move[1] for move in moves for sign in (1.0, -1.0)])
    rates = np.array([sign * move[2] for move in moves for sign in (1.0, -1.0)])
    _, turning = accelerations(v, rates, actuators, a)
    slopes = [(turning[2 * i, axis] - turning[2 * i + 1, axis]) / width for i, (*_, axis, width) in enumerate(moves)]
    return np.array([a.k_f / a.m, a.C_l / a.m, *slopes])


TOLD = 0.5  # share of what was assumed that the deviation must have come down to
TOLD_TOGETHER = 0.9  # correlation above which two unknowns are only told together
FORWARD = 8.0  # airspeed that forward flight reaches [m/s]
NEEDS_FORWARD = frozenset({"C_l", "C_d0", "C_y0", "C_mq", "C_nr", "C_lp", "C_lr", "C_np", "advance", "per_stall"})
OF_ACTUATORS = frozenset({"motor_tau", "elevon_tau", "omega_rate", "delta_rate"})
GUSTY = 0.1  # gusts that explain what is left [m/s]
BEYOND_GUSTS = 0.8  # of a shot, above which it is no gust [m/s]
SHOT = 1.0  # of a replay [s]
LARGE_BIAS = 1.0  # of an accelerometer: rather a frame that is another [m/s2]
UNEXPLAINED = 6.0  # times the sensor's own noise
EFFECT_STEP = 1e-4


class Row(NamedTuple):
    """One value found."""

    key: str  # of an unknown; empty for an effect
    name: str
    unit: str
    before: float  # of the set
    estimate: float
    interval: float  # half the 95 % interval
    told: bool  # whether the flight tells it


class ReplayErrors(NamedTuple):
    """Errors of the model, SHOT seconds after the vehicle's own state, rms."""

    position: float  # [m]
    velocity: float  # [m/s]
    attitude: float  # [deg]
    rates: float  # [rad/s]


@dataclass(frozen=True)
class Identification:
    """The whole result."""

    sources: tuple[str, ...]
    seconds: float  # of flight that were used
    fastest: float  # through the air [m/s]
    base: Airframe
    airframe: Airframe
    effects: tuple[Row, ...]
    parameters: tuple[Row, ...]
    directions: tuple[int, int]  # independent combinations of the unknowns that are told, and how many there are
    untold: tuple[str, ...]  # what, and why
    remarks: tuple[str, ...]
    nuisance: Nuisance
    nuisance_interval: Nuisance
    gust: float  # rms per axis, about [m/s]
    gyro_bias: Array  # mean, (3,) [rad/s]
    before: Array  # rms residuals at the set, (6,)
    after: Array
    replay: tuple[ReplayErrors, ReplayErrors]  # of the set and of the answer
    residuals: tuple[Array, Array]  # (n, 6) each
    time: Array  # (n,) [s]


def identification(
    paths: Sequence[ReconstructedPath],
    problem: FitProblem,
    solution: Solution,
    base: Airframe,
    sources: tuple[str, ...],
) -> Identification:
    """The result of a solved problem."""
    x, covariance = solution.x, solution.covariance
    deviations = np.sqrt(np.diag(covariance))
    nuisance, spread = problem.nuisance(x), problem.nuisance(NORMAL_95 * deviations)
    airframe = problem.airframe(x)
    fastest = max(float(np.linalg.norm(path.velocity - nuisance.wind, axis=1).max()) for path in paths)
    parameters = tuple(_parameters(base, problem.unknowns, x, deviations, solution.assumed))
    return Identification(
        sources=sources,
        seconds=sum(path.stretch.seconds for path in paths),
        fastest=fastest,
        base=base,
        airframe=airframe,
        effects=_effects(problem, solution, base, fastest),
        parameters=parameters,
        directions=_directions(solution, len(problem.unknowns)),
        untold=tuple(_untold(parameters, covariance, fastest)),
        remarks=tuple(_remarks(paths, solution)),
        nuisance=nuisance,
        nuisance_interval=spread,
        gust=solution.gust,
        gyro_bias=np.mean([path.gyro_bias for path in paths], axis=0),
        before=solution.before,
        after=solution.after,
        replay=(
            replay_errors(paths, base, nuisance._replace(delay=0.0)),
            replay_errors(paths, airframe, nuisance),
        ),
        residuals=solution.residuals,
        time=np.concatenate([path.stretch.time for path in paths]),
    )


def _parameters(
    base: Airframe, unknowns: Sequence[Unknown], x: Array, deviations: Array, assumed: Array
) -> Iterator[Row]:
    for i, one in enumerate(unknowns):
        before, estimate = value_of(base, one.key), value_at(base, one, float(x[i]))
        scale = (abs(before) or one.scale) if one.signed else estimate
        interval = NORMAL_95 * float(deviations[i]) * scale
        yield Row(one.key, one.meaning, one.unit, before, estimate, interval, bool(deviations[i] < TOLD * assumed[i]))


def _effects(problem: FitProblem, solution: Solution, base: Airframe, fastest: float) -> tuple[Row, ...]:
    """Effects by the delta method; those of forward flight are told by forward flight alone."""
    x = solution.x
    slopes = np.zeros((len(EFFECTS), len(x)))
    for j in range(len(problem.unknowns)):
        step = np.zeros_like(x)
        step[j] = EFFECT_STEP
        up, down = (effect_values(problem.airframe(x + side), base) for side in (step, -step))
        slopes[:, j] = (up - down) / (2.0 * EFFECT_STEP)
    deviation = np.sqrt(np.einsum("ij,jk,ik->i", slopes, solution.covariance, slopes))
    assumed = np.sqrt(np.einsum("ij,j,ij->i", slopes, solution.assumed**2, slopes))
    before, after = effect_values(base, base), effect_values(problem.airframe(x), base)
    return tuple(
        Row(
            key="",
            name=effect.name,
            unit=effect.unit,
            before=float(before[i]),
            estimate=float(after[i]),
            interval=NORMAL_95 * float(deviation[i]),
            told=bool(deviation[i] < TOLD * assumed[i] and (fastest >= FORWARD or not effect.forward)),
        )
        for i, effect in enumerate(EFFECTS)
    )


def _directions(solution: Solution, count: int) -> tuple[int, int]:
    """Eigenvalues of the unknowns' covariance, counted in what was assumed, that have come down."""
    scale = solution.assumed[:count]
    shares = np.linalg.eigvalsh(solution.covariance[:count, :count] / np.outer(scale, scale))
    return int(np.count_nonzero(shares < TOLD**2)), count


def _untold(parameters: Sequence[Row], covariance: Array, fastest: float) -> Iterator[str]:
    deviations = np.sqrt(np.diag(covariance))
    if fastest < FORWARD:
        yield f"forward flight: at most {fastest:.1f} m/s through the air; what is said of it, the model extrapolates"
    for i, row in enumerate(parameters):
        if row.told:
            continue
        shared = np.abs(covariance[i, : len(parameters)]) / (deviations[i] * deviations[: len(parameters)])
        shared[i] = 0.0
        partner = int(shared.argmax())
        if fastest < FORWARD and row.key in NEEDS_FORWARD:
            why = "it takes forward flight"
        elif shared[partner] > TOLD_TOGETHER:
            why = f"only together with {parameters[partner].key}"
        elif row.key in OF_ACTUATORS:
            why = "commands hardly ask for more than it allows"
        else:
            why = "hardly excited in this flight"
        yield f"{row.key}, {row.name}: {why}"


def _remarks(paths: Sequence[ReconstructedPath], solution: Solution) -> Iterator[str]:
    bias = max(float(np.abs(path.accelerometer_bias).max()) for path in paths)
    if bias > LARGE_BIAS:
        yield (
            f"accelerometer and motion disagree by {bias:.1f} m/s2: are attitude and IMU in the same frame (--frame), "
            "and is the IMU level?"
        )
    cause = f"gusts of about {solution.gust:.1g} m/s" if solution.gust > GUSTY else "the model lacks something"
    if solution.gust > BEYOND_GUSTS:
        cause = "the model does not explain this flight, intervals do not hold: are frame, outputs and airframe right?"
    noise = paths[0].deviations
    own = np.array([*[noise.accelerometer] * 3, *[noise.gyro] * 3])
    for axis, left, sensor in zip(RESIDUAL_AXES, solution.after, own, strict=True):
        if left > UNEXPLAINED * sensor:
            yield f"{axis}: {left:.3g} is left, {left / sensor:.1f} times the sensor's noise: {cause}"


def replay_errors(paths: Sequence[ReconstructedPath], a: Airframe, nuisance: Nuisance) -> ReplayErrors:
    """Errors of the plant flown by recorded commands from reconstructed states, a shot every SHOT seconds."""
    found = np.concatenate([_shot_errors(path, a, nuisance) for path in paths])
    position, velocity, attitude, rates = np.sqrt(np.mean(found.reshape(len(found), 4, 3) ** 2, axis=(0, 2))).tolist()
    return ReplayErrors(position, velocity, math.degrees(attitude), rates)


def _shot_errors(path: ReconstructedPath, a: Airframe, nuisance: Nuisance) -> Array:
    """Of position, velocity, attitude and rates at the ends of the shots, (k, 12)."""
    s = path.stretch
    before, _ = actuator_positions(s.commands, GRID_STEP, a)
    time = s.time - s.time[0]
    begins = np.searchsorted(time, np.arange(0.0, time[-1] - SHOT - 2.0 * GRID_STEP, SHOT))
    steps = round(SHOT / GRID_STEP)
    first = np.round((time[begins] + LEAD_TIME - nuisance.delay) / GRID_STEP).astype(np.int64)
    fits = (first >= 0) & (first + steps <= len(s.commands))
    begins, first = begins[fits], first[fits]
    states = np.concatenate([path.position, path.velocity, path.attitude, path.rates], axis=1)
    history = ActuatorHistory(s.commands, before, GRID_STEP)
    ends = shots(states[begins], first, steps, history, nuisance.wind, a)
    then = np.stack([np.interp(time[begins] + SHOT, time, column) for column in states.T], axis=1)
    off = ends - then
    turned = rotations.product(rotations.inverse(rotations.unit(then[:, 6:10])), rotations.unit(ends[:, 6:10]))
    return np.concatenate([off[:, :6], rotations.vector_of(turned), off[:, 10:]], axis=1)
