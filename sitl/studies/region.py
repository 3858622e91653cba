"""Region of attraction of the linear hover law: flights from random states beside what is proved (report, section 5.1).

The report takes 250 and 400 from sampled trajectories. Here states are drawn uniformly in direction on level sets of
V and flown by the linear law alone on the whole plant: actuators with their limits, one tick of delay. A flight
has converged once it is in the set that :mod:`sitl.design.region` proves; V is the LQR's, whichever law flies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from numba import njit

from sitl.design import linearise
from sitl.design.lmi import SPREAD, effectiveness, guaranteed_decay, lmi_gains
from sitl.design.lqr import hover_gains
from sitl.design.lqr import lqr as design_lqr
from sitl.design.region import Certificate, certify
from sitl.design.rise import first_rise
from sitl.errors import SitlError
from sitl.flow import SUBSTEPS, TICK
from sitl.kernels.integrate import plant_step
from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import from_rotation_vector, hover, multiply
from sitl.kernels.state import ACTUATOR, ANCHOR, SIZE, P, Q
from sitl.laws import hover_linear
from sitl.laws.allocation import allocate
from sitl.control.hover_linear import HALF, LinearGains

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Flags: TypeAlias = npt.NDArray[np.bool_]

BANDS = (0.0, 20.0, 50.0, 100.0, 150.0, 250.0, 400.0)  # of V; a flight's band is where it starts
DURATION = 20.0  # of a flight at most [s]
ALOFT = 10_000.0  # out of the ground's reach [m]
ENVELOPE = (17.0, 5.0, math.radians(90.0), 3.0)  # position [m], speed [m/s], turn [rad], rates [rad/s]
LOST = 1e6  # a V from which nothing came back
CAUGHT = 0.02  # V at which a law without a certificate counts as converged
GENTLE = 10.0  # the other weight of u that is tried
RADIUS = 0.05  # a step has settled within this [m]
STEPS = (0.5, 1.0, 2.0, 4.0, 8.0)  # [m]
ROUNDING = 1e-9
NEAR = 1.25  # factor of V
SHARE = 0.95  # of flights that a threshold to leave asks for
DEFAULTS, REPORT = (20.0, 50.0), (250.0, 400.0)  # thresholds to enter and to leave
RIPPLE = 1e-6  # of V, relative: rounding, not a rise
LEVEL, BAND = 13, 14  # columns of a drawn state after the rigid one
POSITION_LIMITS = 15  # the DARKO_LIMIT bits of positions


class Flights(NamedTuple):
    """One entry per flight."""

    start: Array  # V
    band: npt.NDArray[np.int64]  # of V at the start
    upright: Flags  # eta > 0: on the hover's side of what x cannot tell apart
    converged: Flags
    monotone: Flags  # V of the law's own S never rose
    time: Array  # to the proved set [s]; NaN if it did not converge
    saturated: Array  # share of the flight with an actuator at a position limit


class Result(NamedTuple):
    """What the study finds of one law."""

    name: str
    gains: LinearGains
    certificate: Certificate | None  # None with an integral: V is not of its whole state
    rise: float  # of the law's own V, where it first rises
    guaranteed: float  # decay rate of V over the spread of effectiveness [1/s]
    seen: float  # decay rate flown [1/s]
    settling: Array  # of steps, as :func:`steps` [s]
    flown: Flights  # from states of a flight
    spread: Flights  # from states uniform on level sets


def laws(a: Airframe) -> dict[str, LinearGains]:
    """The laws that are compared, by name."""
    lqr = hover_gains(a, integral=False)
    A, B = linearise.hover(a)
    K, S = design_lqr(A, B, np.eye(12), GENTLE * np.eye(4))
    return {
        "LQI as flown": hover_gains(a),
        "LQR": lqr,
        "LQR of the report": lqr._replace(reach=math.inf),
        f"LQR, R = {GENTLE:.0f} I": lqr._replace(K=np.ascontiguousarray(K), S=S),
        "LMI": lmi_gains(a),
    }


def study(a: Airframe, samples: int, seed: int) -> list[Result]:
    """Certify and fly every law from the same states.

    Args:
        a: The airframe.
        samples: States per draw.
        seed: Of the draws.

    Raises:
        SitlError: If there are too few samples for the bands, or nothing can be proved of a law.
    """
    if samples < len(BANDS) - 1 or seed < 0:
        raise SitlError(
            f"{samples} samples with seed {seed}: at least {len(BANDS) - 1} and a seed from 0 on are needed"
        )
    S = hover_gains(a, integral=False).S
    flown, spread = (draw(S, samples, seed, envelope=envelope) for envelope in (True, False))
    A, corners = linearise.hover(a)[0], effectiveness(a, SPREAD)
    results = []
    for name, gains in laws(a).items():
        certificate = None if gains.K_i.any() else certify(a, gains)
        caught = CAUGHT if certificate is None else certificate.level
        results.append(
            Result(
                name,
                gains,
                certificate,
                first_rise(a, gains),
                guaranteed_decay(A, corners, gains.K, gains.S),
                decay_seen(a, gains),
                steps(a, gains),
                fly(a, gains, flown, caught),
                fly(a, gains, spread, caught),
            )
        )
    return results


def draw(S: Array, count: int, seed: int, *, envelope: bool, bands: Sequence[float] = BANDS) -> Array:
    """Random states, equally many for each band of V = x' S x, (n, 15).

    Args:
        S: Of V, (12, 12).
        count: How many states, at least; rounded up to a multiple of the bands.
        seed: Of the draw.
        envelope: Whether to draw what a flight can hand over (see :func:`_from_envelope`), or uniformly in direction
            on level sets of V, where rates reach 6 sqrt(V) rad/s.
        bands: Edges of the bands of V.

    Returns:
        Rows of (p - p_e, v, q, w, V, index of the band), band after band.
    """
    random = np.random.default_rng(seed)
    to_x = np.linalg.inv(np.linalg.cholesky(S))
    share = math.ceil(count / (len(bands) - 1))
    kept: list[list[Array]] = [[] for _ in bands[1:]]
    while min(len(rows) for rows in kept) < share:
        rigid = _from_envelope(random) if envelope else _from_level_set(random, to_x, bands[-1])
        x = _deviation(rigid)
        level = float(x @ S @ x)
        band = int(np.searchsorted(bands, level, side="right")) - 1
        if 0 <= band < len(kept) and len(kept[band]) < share:
            kept[band].append(np.array((*rigid, level, band)))
    return np.array([row for rows in kept for row in rows])


def _from_level_set(random: np.random.Generator, to_x: Array, highest: float) -> Array:
    """A state uniform in direction on the level set of a V uniform up to the highest, (13,).

    That is as far as it has attitudes: x holds eps alone, |eps| <= 1. Where both signs of eta agree with the law's
    choice of the sign of q either is taken.
    """
    while True:
        y = random.standard_normal(12)
        x = math.sqrt(random.uniform(0.0, highest)) / np.linalg.norm(y) * y @ to_x
        eps = x[6:9] - (0.0, HALF, 0.0)
        eta = math.sqrt(max(1.0 - float(eps @ eps), 0.0)) * (1.0 if random.random() < 0.5 else -1.0)
        if eps @ eps < 1.0 and eta > eps[1]:
            return np.array((*x[:6], eta, *eps, *x[9:]))


def _from_envelope(random: np.random.Generator) -> Array:
    """A state within ENVELOPE of the hover, position, velocity, turn and rates in random directions, (13,)."""
    parts = [
        random.uniform(0.0, greatest) * direction / np.linalg.norm(direction)
        for greatest, direction in zip(ENVELOPE, random.standard_normal((4, 3)), strict=True)
    ]
    q = multiply(hover(0.0), from_rotation_vector(parts[2]))
    return np.array((*parts[0], *parts[1], *q, *parts[3]))


def _deviation(rigid: Array) -> Array:
    """The x that the law sees of a rigid state relative to its target, heading 0, (12,)."""
    x = np.empty(12)
    hover_linear.error(rigid, np.zeros(3), 0.0, x)
    return x


def fly(a: Airframe, gains: LinearGains, states: Array, caught: float) -> Flights:
    """Fly states under the linear law alone in still air, target and heading zero.

    Args:
        a: The airframe.
        gains: The law.
        states: Of :func:`draw`, (n, 15).
        caught: Level of the law's own V that is proved: below it, with eta > 0, the flight has converged.
    """
    flown = np.array([_flight(a, gains, state, caught) for state in states])
    converged = flown[:, 0] > 0.0
    return Flights(
        start=states[:, LEVEL],
        band=states[:, BAND].astype(np.int64),
        upright=states[:, Q] * np.where(states[:, Q] >= states[:, Q + 2], 1.0, -1.0) > 0.0,
        converged=converged,
        monotone=flown[:, 1] > 0.0,
        time=np.where(converged, flown[:, 2] * TICK, math.nan),
        saturated=flown[:, 3] / np.maximum(flown[:, 2], 1.0),
    )


def threshold(flights: Flights, share: float) -> float:
    """The V up to which at least this share of the flights converges; 0 where even the lowest misses it.

    The share as a function of V is the best fit that does not rise with V.
    """
    from scipy.optimize import isotonic_regression  # noqa: PLC0415 - half a second that only this study needs

    order = np.argsort(flights.start)
    fit = isotonic_regression(flights.converged[order].astype(float), increasing=False).x
    good = np.flatnonzero(fit >= share - ROUNDING)
    return float(flights.start[order][good[-1]]) if good.size else 0.0


def share_at(flights: Flights, level: float) -> float:
    """Share that converges of the flights from within NEAR of a V; NaN without any."""
    near = np.abs(np.log(flights.start / level)) <= math.log(NEAR)
    return float(flights.converged[near].mean()) if near.any() else math.nan


def steps(a: Airframe, gains: LinearGains) -> Array:
    """Settling times within RADIUS of position steps, (steps, axes) as STEPS and north, west, up [s]; NaN: not."""
    times = np.empty((len(STEPS), 3))
    for row, size in enumerate(STEPS):
        for axis in range(3):
            flown = _flight(a, gains, _offset(size, axis), -1.0)
            settled = flown[4] < flown[2] and flown[2] * TICK >= DURATION - TICK
            times[row, axis] = flown[4] * TICK if settled else math.nan
    return times


def decay_seen(a: Airframe, gains: LinearGains) -> float:
    """Mean rate alpha of V ~ exp(-2 alpha t) over four decades of V, smallest step, slowest axis [1/s]."""
    rates = []
    for axis in range(3):
        state = _offset(STEPS[0], axis)
        x = _deviation(state[:LEVEL])
        flown = _flight(a, gains, state, 1e-4 * float(x @ gains.S @ x))
        rates.append(0.5 * math.log(1e4) / (flown[2] * TICK) if flown[0] else 0.0)
    return min(rates)


def _offset(size: float, axis: int) -> Array:
    """At rest this far from the target along an axis, (15,)."""
    state = np.zeros(BAND + 1)
    state[P + axis], state[Q : Q + 4] = -size, hover(0.0)
    return state


def _flight(a: Airframe, gains: LinearGains, state: Array, caught: float) -> tuple[float, ...]:
    plant = np.full(SIZE, math.nan)
    plant[:ACTUATOR], plant[ACTUATOR:ANCHOR] = state[:ACTUATOR], 0.0
    plant[P + 2] += ALOFT
    plant[ACTUATOR : ACTUATOR + 2] = math.sqrt(float(gains.u_bar[0]) / a.k_f)
    return _descend(plant, gains, a, round(DURATION / TICK), caught)


@njit(cache=True)
def _descend(
    plant: Array, gains: LinearGains, a: Airframe, ticks: int, caught: float
) -> tuple[float, float, float, float, float]:
    """Whether a flight converged, whether V never rose, ticks flown, ticks at a limit, and the tick it settled at.

    The tick is :func:`sitl.flow.flow`'s: commands of tick k are in force in tick k + 1.
    """
    x, u, staged, integral = np.empty(12), np.empty(4), np.empty(4), np.zeros(3)
    target, wind, command = np.array((0.0, 0.0, ALOFT)), np.zeros(3), plant[ACTUATOR:ANCHOR].copy()
    hover_linear.error(plant, target, 0.0, x)
    before, monotone, saturated, settled = hover_linear.lyapunov(x, gains), 1.0, 0.0, 0.0
    for k in range(ticks):
        sign = 1.0 if plant[Q] >= plant[Q + 2] else -1.0  # as the law takes it
        if before <= caught and sign * plant[Q] > 0.0:
            return 1.0, monotone, float(k), saturated, settled
        hover_linear.integrate(plant, target, integral, gains, TICK)
        hover_linear.control(x, integral, 0.0, gains, u)
        allocate(u, a, staged)
        flags = 0
        for _ in range(SUBSTEPS):
            flags |= plant_step(plant, command, wind, True, a, TICK / SUBSTEPS)
        command[:] = staged
        hover_linear.error(plant, target, 0.0, x)
        now = hover_linear.lyapunov(x, gains)
        if x[0] * x[0] + x[1] * x[1] + x[2] * x[2] > RADIUS * RADIUS:
            settled = float(k + 1)
        saturated += 1.0 if flags & POSITION_LIMITS else 0.0
        if not now < LOST:
            return 0.0, 0.0, float(k + 1), saturated, settled
        if now > before * (1.0 + RIPPLE):
            monotone = 0.0
        before = now
    return 0.0, monotone, float(ticks), saturated, settled


def save_plot(results: list[Result], path: Path) -> None:
    """Draw every start by V and outcome, what is proved, and the thresholds.

    Raises:
        SitlError: If the file cannot be written; the message names it.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - two seconds that only plots need

    page = Figure(figsize=(9.0, 7.0), layout="constrained")
    page.suptitle("Linear hover law: where flights start, and whether they come home")
    above, below = page.subplots(2, 1, sharex=True)
    _strips(above, results, [result.flown for result in results])
    above.set_title("states of a flight: 17 m, 5 m/s, 90 deg, 3 rad/s at most", fontsize=9)
    _strips(below, results, [result.spread for result in results])
    below.set_title("states uniform on level sets of V", fontsize=9)
    below.set_xlabel("V of the LQR with Q = I, R = I at the start; proved level and first rise: of the law's own V")
    above.plot([], [], color="tab:green", linewidth=2.5, label="proved")  # not every law has one
    handles, labels = above.get_legend_handles_labels()
    page.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
    try:
        page.savefig(path, dpi=80)
    except (OSError, ValueError) as error:
        raise SitlError(f"plot {path}: {error}") from error


def _strips(axis: Axes, results: list[Result], strips: list[Flights]) -> None:
    scatter = np.random.default_rng(0)
    for row, (result, flights) in enumerate(zip(results, strips, strict=True)):
        height = row + scatter.uniform(-0.3, 0.3, flights.start.size)
        for outcome, colour, name in ((True, "tab:blue", "converged"), (False, "tab:red", "lost")):
            chosen = flights.converged == outcome
            label = None if row else name
            axis.plot(flights.start[chosen], height[chosen], ".", color=colour, markersize=2.5, label=label)
        ends = np.array([row - 0.4, row + 0.4])
        if result.certificate is not None:
            axis.plot(2 * [result.certificate.level], ends, color="tab:green", linewidth=2.5)
        axis.plot(2 * [result.rise], ends, color="tab:orange", linewidth=1.5, label=None if row else "V first rises")
        leave = threshold(flights, SHARE)
        if leave > 0.0:
            axis.plot(2 * [leave], ends, "k", linewidth=1.5, label=None if row else "95 % converge up to here")
    for values, style in ((DEFAULTS, "--"), (REPORT, ":")):
        for value in values:
            pair = f"{values[0]:.0f} / {values[1]:.0f}" if value == values[0] else None
            axis.axvline(value, linestyle=style, linewidth=0.9, color="grey", label=pair)
    axis.set_xscale("log")
    axis.set_yticks(range(len(results)), [result.name for result in results], fontsize=8)
    axis.invert_yaxis()
