r"""A set that a hover with lagging actuators provably never leaves: V = z' P z of :mod:`sitl.lab.proofs.lagged`.

With the rate z' = f(z) and f(0) = 0, f(z) = J z for the mean J of the Jacobians between the hover and z. So V' < 0
where P J + J' P is negative for every Jacobian on the set, as the set holds with a state all between it and the hover.
Boxes of attitudes cover the set; they are split until each is proved.

A command is sampled, and in force until the next one is: it is off what the law would send now by at most the integral
of its rate over ``COMMAND_DELAY``. As in :mod:`sitl.lab.proofs.closed_loop`, the functional

.. math:: V + \sum_j r_j \int_{t-h}^t (s - t + h) \, \dot c_j(s)^2 ds

falls where V' + sum_j r_j (h c_j'^2 - e_j^2 / h) does: a quadratic form in the state and the errors e_j, c' taken by a
Schur complement. What is integrated is sampled likewise, a period old at most.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, replace
from importlib.resources import files

import numpy as np
import numpy.typing as npt

from sitl import Airframe, Array, SitlError
from sitl.control.hover_linear import SQRT_HALF
from sitl.design.proved import SAME, base_gains
from sitl.design.rounding import rounded_matrix
from sitl.lab.proofs.closed_loop import ATTITUDE_ROWS, POSITION_ROWS, RATE_ROWS, SAMPLING, VELOCITY_ROWS
from sitl.lab.proofs.cover import attitude_boxes, split
from sitl.lab.proofs.lagged import (
    ACTUATORS,
    COMMAND_DELAY,
    LAGGED_STATES,
    VARIABLES,
    LaggedLoop,
    LargestMotion,
    bounds,
    free_air,
    linear_rest,
    whole,
)
from sitl.model.propeller import thrust

LAGGED_CERTIFICATES = "lagged.toml"
CHANNELS = 7  # the commands, then what is integrated
LEAST_EIGENVALUE = 1e-6  # that the form must exceed: far above what rounding can do
FIRST_SPLIT = 4  # boxes per axis to begin with
SPLITS = 14  # how often a box is split at most
WEIGHT_SEARCHES, TRIED = 6, (0.3, 0.6, 1.6, 3.0)  # of the search of the weights
BATCH = 64  # boxes whose Jacobians are bounded at once
AIR_ROWS = [3, 4, 5, 9, 10, 11]  # of the state: velocity and body rates

Booleans = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class LaggedProof:
    """The loop, its V, and the weights of the functional."""

    loop: LaggedLoop
    P: Array  # (19, 19)
    to_y: Array  # L': y = L' z, V = |y|^2
    to_z: Array  # its inverse
    columns: Array  # (19, 7): what an error of a channel does to the rates
    delays: Array  # (7,) [s]
    weights: Array  # (7,), r_j

    @classmethod
    def of(cls, loop: LaggedLoop, P: Array) -> LaggedProof:
        """Prepare the proof of a V.

        Raises:
            SitlError: V does not fall along the linear loop.
        """
        to_y = np.linalg.cholesky(P).T
        columns, delays = np.zeros((LAGGED_STATES, CHANNELS)), np.full(CHANNELS, SAMPLING)
        columns[ACTUATORS, :4] = np.diag(1.0 / loop.tau)
        columns[12:15, 4:] = np.eye(3)
        delays[:4] = COMMAND_DELAY
        proof = cls(loop, P, np.asarray(to_y, np.float64), np.linalg.inv(to_y), columns, delays, np.ones(CHANNELS))
        return proof._weighed()

    def _weighed(self) -> LaggedProof:
        """With the weights that leave most at the hover."""
        rates, _ = self.hover_rates()
        rows = np.linalg.norm(rates[0, LAGGED_STATES:, :LAGGED_STATES] @ self.to_z, axis=1)
        weights = np.linalg.norm(self.to_y @ self.columns, axis=0) / rows
        best, found = self._with(weights), -math.inf
        for _ in range(WEIGHT_SEARCHES):
            before = found
            for j in range(CHANNELS):
                for factor in (1.0, *TRIED):
                    weights = best.weights.copy()
                    weights[j] *= factor
                    tried = self._with(weights)
                    least = float(np.linalg.eigvalsh(tried.form(rates))[0, 0])
                    if least > found:
                        best, found = tried, least
            if found <= before:
                break
        if found <= LEAST_EIGENVALUE:
            raise SitlError("V does not fall along the linear loop: these gains and this V are no pair")
        return best

    def hover_rates(self) -> tuple[Array, Array]:
        """Rates at the hover, (1, 26, 26), and the channels by the state there."""
        hover = np.zeros((1, VARIABLES))
        slope = bounds(self.loop, hover, hover).slope[0]
        channels = self.channels(slope[0, 9:])
        rates = self.carried(whole(self.loop, slope) + linear_rest(self.loop), channels)
        return rates + self.errors(channels), channels

    def _with(self, weights: Array) -> LaggedProof:
        return replace(self, weights=weights)

    def carried(self, J: Array, channels: Array) -> Array:
        """Rates of state and channels by state and errors, (n, 26, 26), of a Jacobian (n, 19, 19).

        Args:
            J: Of the rates by the state; what is asked for without errors has none of their columns.
            channels: Of the channels by the state, (7, 19).
        """
        made = np.zeros((len(J), LAGGED_STATES + CHANNELS, LAGGED_STATES + CHANNELS))
        made[:, :LAGGED_STATES, :LAGGED_STATES] = J
        made[:, LAGGED_STATES:] = channels @ made[:, :LAGGED_STATES]
        return made

    def errors(self, channels: Array) -> Array:
        """The same of the errors alone, (26, 26)."""
        made = np.zeros((LAGGED_STATES + CHANNELS, LAGGED_STATES + CHANNELS))
        made[:LAGGED_STATES, LAGGED_STATES:] = self.columns
        made[LAGGED_STATES:] = channels @ made[:LAGGED_STATES]
        return made

    def channels(self, by_variables: Array) -> Array:
        """The channels by the state, (7, 19), of the commands by the variables, (4, 17)."""
        made = np.zeros((CHANNELS, LAGGED_STATES))
        made[:4] = by_variables @ self.loop.selection
        made[4:, POSITION_ROWS], made[4:, VELOCITY_ROWS] = np.eye(3), self.loop.gains.lead * np.eye(3)
        return made

    def form(self, rates: Array) -> Array:
        """The form that must be positive, of rates (n, 26, 26): (n, 33, 33)."""
        n, size = len(rates), LAGGED_STATES + CHANNELS
        M = np.zeros((n, size + CHANNELS, size + CHANNELS))
        A = np.einsum("ij,njk,kl->nil", self.to_y, rates[:, :LAGGED_STATES, :LAGGED_STATES], self.to_z, optimize=True)
        M[:, :LAGGED_STATES, :LAGGED_STATES] = -A - A.swapaxes(1, 2)
        drive = np.einsum("ij,njk->nik", self.to_y, rates[:, :LAGGED_STATES, LAGGED_STATES:], optimize=True)
        scale = np.sqrt(self.delays / self.weights)  # of the errors, so that their own part is the identity
        M[:, :LAGGED_STATES, LAGGED_STATES:size] = -drive * scale
        pull = np.sqrt(self.weights * self.delays)[:, None] * rates[:, LAGGED_STATES:]
        M[:, size:, :LAGGED_STATES] = np.einsum("nij,jk->nik", pull[:, :, :LAGGED_STATES], self.to_z, optimize=True)
        M[:, size:, LAGGED_STATES:size] = pull[:, :, LAGGED_STATES:] * scale
        M[:, LAGGED_STATES:size, :LAGGED_STATES] = M[:, :LAGGED_STATES, LAGGED_STATES:size].swapaxes(1, 2)
        M[:, :, size:] = M[:, size:, :].swapaxes(1, 2)
        M[:, LAGGED_STATES:size, LAGGED_STATES:size] = np.eye(CHANNELS)
        M[:, size:, size:] = np.eye(CHANNELS)
        return M

    def takes(self, rates: Array) -> Array:
        """Share of rates in the form, (n, 33, 33), of which they are a linear part."""
        return self.form(rates) - self.form(np.zeros_like(rates[:1]))

    def falls_within(self, level: float, boxes: int) -> bool:
        """Whether V' < 0 is proved on {V <= level} without the hover itself; more boxes prove more."""
        cover = LaggedCover(self, level)
        C = np.linalg.inv(self.P)[ATTITUDE_ROWS, ATTITUDE_ROWS]
        widest = np.sqrt(level * np.diag(C))
        centre, half = attitude_boxes(widest, FIRST_SPLIT, is_mirrored=self.is_mirrored())
        for _ in range(SPLITS):
            inside = cover.budget(centre, half) >= 0.0
            centre, half = centre[inside], half[inside]
            if len(centre) == 0:
                return True
            if len(centre) > boxes:
                return False
            held = np.concatenate(
                [cover.holds(centre[k : k + BATCH], half[k : k + BATCH]) for k in range(0, len(centre), BATCH)]
            )
            centre, half = centre[~held], half[~held]
            if len(centre) and not cover.holds(centre[:BATCH], np.zeros_like(half[:BATCH])).all():
                return False  # not even at the middle: no splitting would help
            centre, half = split(centre, half, np.ones(3))
        return False

    def is_mirrored(self) -> bool:
        """Whether V is its own mirror image about the vehicle's plane of symmetry, as plant and law are."""
        M = mirror()
        return bool(np.abs(M @ self.P @ M - self.P).max() <= 1e-8 * np.abs(self.P).max())

    def limits_level(self) -> float:
        """Largest V up to which no command meets a limit, the law bounds nothing and the nose stays above eta = 0."""
        loop, a, C = self.loop, self.loop.a, np.linalg.inv(self.P)
        K, T, gains = loop.feedback, loop.lift, loop.gains
        # At the level 1, which bounds it.
        drift = math.sqrt(float(np.linalg.eigvalsh(C[VELOCITY_ROWS, VELOCITY_ROWS])[-1]))
        low, high = (float(thrust(w, s * drift, a)) for w, s in ((a.omega_min, -1.0), (a.omega_max, 1.0)))
        planes = []
        for motor, elevon in ((0, 2), (1, 3)):
            planes += [(K[motor], T - low), (-K[motor], high - T)]
            planes += [(a.delta_max * K[motor] + sign * K[elevon], a.delta_max * T) for sign in (-1.0, 1.0)]
        level = min([1.0, *(bound * bound / (row @ C @ row) for row, bound in planes)])
        growth = np.zeros((3, LAGGED_STATES))
        growth[:, POSITION_ROWS], growth[:, VELOCITY_ROWS] = np.eye(3), gains.lead * np.eye(3)
        balance = self.balance_integral()
        for part, bound in (
            (C[POSITION_ROWS, POSITION_ROWS], gains.reach),
            (growth @ C @ growth.T, gains.integral_limit),
            (C[12:15, 12:15], gains.bound - float(np.linalg.norm(balance))),
        ):
            level = min(level, bound * bound / float(np.linalg.eigvalsh(part)[-1]))
        turn = math.sqrt(float(np.linalg.eigvalsh(C[ATTITUDE_ROWS, ATTITUDE_ROWS])[-1]))
        return float(min(level, ((1.0 - SQRT_HALF) / turn) ** 2))

    def balance_integral(self) -> Array:
        """Integrals in the hover, (3,) [m s]: the law's own thrust there is not quite the plant's."""
        u, T = self.loop.gains.u_bar, self.loop.lift
        off = np.array([u.T1 - T, u.T2 - T, u.dT1, u.dT2])
        return np.asarray(np.linalg.lstsq(self.loop.gains.K_i, off, rcond=None)[0])

    def settled(self) -> Array:
        """V of the law's 15 states while the actuators are where it wants them, near the hover, (15, 15)."""
        S = np.vstack([np.eye(15), self.hover_rates()[1][:4, :15]])
        return np.asarray(S.T @ self.P @ S)


def mirror() -> Array:
    """The mirror image of a state, (19, 19)."""
    M = np.diag([1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    M[15:17, 15:17] = M[17:, 17:] = [[0.0, 1.0], [1.0, 0.0]]
    return M


class LaggedCover:
    """The test on boxes of attitudes, at one level.

    On a box the Jacobian is that of its middle, and what changes with the way from there: along the attitudes each by
    its part of the box, the rest together, as they share what is left of the level, and what second derivatives are
    not sure of entry by entry.
    """

    def __init__(self, proof: LaggedProof, level: float) -> None:
        loop, C = proof.loop, np.linalg.inv(proof.P)
        self.proof, self.level = proof, level
        self.S_f = np.linalg.inv(C[ATTITUDE_ROWS, ATTITUDE_ROWS])
        select = loop.selection
        self.mean = select @ C[:, ATTITUDE_ROWS] @ self.S_f
        left = select @ C @ select.T - self.mean @ np.linalg.inv(self.S_f) @ self.mean.T
        values, vectors = np.linalg.eigh(left)
        self.ways = (vectors * np.sqrt(np.maximum(values, 0.0)))[:, values > 1e-12 * values[-1]]
        self.spread = np.sqrt(np.maximum(np.diag(left), 0.0))
        # In the metric of the hover's form, what is taken off costs least.
        rates, _ = proof.hover_rates()
        self.metric = np.linalg.inv(np.linalg.cholesky(proof.form(rates)[0]))
        most = np.sqrt(level * np.einsum("ki,ij,kj->k", select, C, select))[None]
        hover, on_set = np.zeros_like(most), bounds(loop, -most, most)
        self.channels = proof.channels(bounds(loop, hover, hover).slope[0][0, 9:])
        bend = np.maximum(np.abs(on_set.bend[0]), np.abs(on_set.bend[1]))[0, 9:]
        self.unsure = (bend @ most[0]) @ np.abs(select)  # of the commands' slopes by the state
        places = [(i, j) for i in range(13) for j in range(VARIABLES) if i >= 9 or j < 13]
        units = np.zeros((len(places), 13, VARIABLES))
        units[np.arange(len(places)), [i for i, _ in places], [j for _, j in places]] = 1.0
        self.rows, self.columns = np.array(places).T
        self.widths = self._sizes(self._carried(units))
        size = LAGGED_STATES + CHANNELS
        sent = np.zeros((4, size, size, size))
        for channel in range(4):
            sent[channel, np.arange(size), LAGGED_STATES + channel, np.arange(size)] = 1.0
        self.sent_widths = self._sizes(sent.reshape(-1, size, size))
        self.base, self.free, self.loose = self._of_free_air(float(most[0, 11:13].max()) / loop.lift)

    def _of_free_air(self, deflection: float) -> tuple[Array, Array, Array]:
        """Share of the free air that lowers the form, its mean part of the rates, and how far off that is.

        The parts are (19, 19).
        """
        C, middle = np.linalg.inv(self.proof.P), np.zeros((LAGGED_STATES, LAGGED_STATES))
        speed, off, spin = (
            math.sqrt(self.level * float(np.linalg.eigvalsh(C[part, part])[-1]))
            for part in (VELOCITY_ROWS, ATTITUDE_ROWS, RATE_ROWS)
        )
        motion = LargestMotion(speed, spin, 2.0 * math.sin(min(2.0 * math.asin(min(1.0, 0.5 * off)), 0.5 * math.pi)))
        terms = free_air(self.proof.loop.a, motion, deflection)
        each = np.zeros((len(terms), LAGGED_STATES, LAGGED_STATES))
        for k, (low, high, M) in enumerate(terms):
            each[k][np.ix_(AIR_ROWS, AIR_ROWS)] = M
            middle += 0.5 * (low + high) * each[k]
        widths = self._sizes(self.proof.carried(each, self.channels))
        halves = np.array([0.5 * (high - low) for low, high, _ in terms])
        loose = np.einsum("k,kij->ij", halves, np.abs(each))
        return np.einsum("k,kij->ij", halves, widths), middle, loose

    def _carried(self, by_variables: Array) -> Array:
        return self.proof.carried(whole(self.proof.loop, by_variables), self.channels)

    def _in_metric(self, rates: Array) -> Array:
        return np.asarray(self.metric @ self.proof.takes(rates) @ self.metric.T)

    def _sizes(self, rates: Array) -> Array:
        """Absolute values of what rates make of the form."""
        values, vectors = np.linalg.eigh(self._in_metric(rates))
        return np.asarray((vectors * np.abs(values)[..., None, :]) @ vectors.swapaxes(-1, -2))

    def budget(self, centre: Array, half: Array) -> Array:
        """Upper bound of the level that a box's attitudes leave for the rest; negative outside, (n,)."""
        least = np.einsum("ni,ij,nj->n", centre, self.S_f, centre) - 2.0 * np.abs(centre @ self.S_f * half).sum(1)
        return np.asarray(self.level - np.maximum(least, 0.0))

    def holds(self, centre: Array, half: Array) -> Booleans:
        """Whether the form is positive everywhere on each box, (n,)."""
        proof, loop, n = self.proof, self.proof.loop, len(centre)
        room = np.sqrt(np.maximum(self.budget(centre, half), 0.0))
        middle = centre @ self.mean.T
        off = half @ np.abs(self.mean).T + room[:, None] * self.spread
        on_box, at = bounds(loop, middle - off, middle + off), bounds(loop, middle, middle).slope
        J = whole(loop, 0.5 * (at[0] + at[1])) + linear_rest(loop) + self.free
        rates = proof.carried(J, self.channels) + proof.errors(self.channels)
        form = self.metric @ proof.form(rates) @ self.metric.T - self.base
        bend = 0.5 * (on_box.bend[0] + on_box.bend[1])
        for axis in range(3):
            turned = bend @ self.mean[:, axis] * half[:, axis, None, None]
            form -= self._sizes(self._carried(turned))
        form -= self._together(bend, room)
        unsure = np.einsum("nijk,nk->nij", 0.5 * (on_box.bend[1] - on_box.bend[0]), off)
        unsure += 0.5 * (at[1] - at[0])  # tables are not exact
        form -= np.einsum("nk,kij->nij", unsure[:, self.rows, self.columns], self.widths, optimize=True)
        # The commands' slopes are those at the end of the way from the hover, the Jacobian's anywhere on it.
        by_state = np.abs(J) + self.loose + self._spread_of(unsure + np.einsum("nijk,nk->nij", np.abs(bend), off))
        sent = self.unsure @ np.concatenate(
            (by_state, np.broadcast_to(proof.columns, (n, LAGGED_STATES, CHANNELS))), axis=2
        )
        form -= np.einsum("nk,kij->nij", sent.reshape(n, -1), self.sent_widths, optimize=True)
        known = np.isfinite(form).all(axis=(1, 2))
        held = np.zeros(n, dtype=np.bool_)
        held[known] = np.linalg.eigvalsh(form[known])[:, 0] > LEAST_EIGENVALUE
        return held

    def _spread_of(self, by_variables: Array) -> Array:
        """Bounds of rates by the state, of sizes by the variables."""
        made = np.zeros((len(by_variables), LAGGED_STATES, LAGGED_STATES))
        by_state = by_variables @ np.abs(self.proof.loop.selection)
        made[:, 3:12], made[:, ACTUATORS] = by_state[:, :9], by_state[:, 9:] / self.proof.loop.tau[:, None]
        return made

    def _together(self, bend: Array, room: Array) -> Array:
        """A bound of what all ways but the attitudes take off, whose shares are within a ball of a radius.

        x' (sum_j n_j T_j) x is at most |n| |x| (x' Q x)^(1/2), Q = sum_j T_j^2, and so |n| x' (s + Q / s) x / 2.
        """
        total = np.zeros((len(bend), *self.metric.shape))
        for way in self.ways.T:
            T = self._in_metric(self._carried(bend @ way))
            total += T @ T
        scale = np.sqrt(np.linalg.eigvalsh(total)[:, -1])[:, None, None]
        return np.asarray(0.5 * room[:, None, None] * (scale * np.eye(len(self.metric)) + total / scale))


# What is stored, by ``scripts/prove_lagged_hover.py``: V, and what it was found for.


def lagged_premises(loop: LaggedLoop) -> Array:
    """The numbers that a proof is of, (k,)."""
    gains = loop.gains
    law = (gains.K, gains.K_i, np.array((gains.lead, gains.integral_limit, gains.reach, gains.bound)))
    return np.concatenate([np.array(loop.a, dtype=np.float64), *(np.ravel(part) for part in law)])


def lagged_entry(loop: LaggedLoop, P: Array) -> str:
    """A certificate as it is stored."""
    rows = [", ".join(f"{value:.10g}" for value in row[: k + 1]) for k, row in enumerate(rounded_matrix(P))]
    now = ", ".join(f"{value:.10g}" for value in lagged_premises(loop))
    return "\n".join(["[[certificate]]", f"premises = [{now}]", "P = [", *(f"    [{row}]," for row in rows), "]", ""])


def stored_proof(a: Airframe) -> LaggedProof:
    """The proof whose V falls on {V <= 1} of this airframe.

    Raises:
        SitlError: None is stored.
    """
    loop = LaggedLoop.of(a, base_gains(a))
    now = lagged_premises(loop)
    text = (files("sitl.lab.proofs") / LAGGED_CERTIFICATES).read_text(encoding="utf-8")
    for certificate in tomllib.loads(text)["certificate"]:
        then = np.array(certificate["premises"])
        if then.shape == now.shape and (np.abs(then - now) <= SAME * np.maximum(np.abs(now), SAME)).all():
            P = np.zeros((LAGGED_STATES, LAGGED_STATES))
            for k, row in enumerate(certificate["P"]):
                P[k, : k + 1] = P[: k + 1, k] = row
            return LaggedProof.of(loop, P)
    raise SitlError("no V is stored that proves anything of this airframe's hover (scripts/prove_lagged_hover.py)")


def lagged_radii(proof: LaggedProof) -> tuple[float, float, float, float]:
    """Radii of {V <= 1}: position [m], speed, turn [rad] and rates.

    Each in any direction while all else is zero and the actuators are where the law wants them.
    """
    V = proof.settled()
    p, v, e, w = (
        1.0 / math.sqrt(float(np.linalg.eigvalsh(V[part, part])[-1]))
        for part in (POSITION_ROWS, VELOCITY_ROWS, ATTITUDE_ROWS, RATE_ROWS)
    )
    return p, v, 4.0 * math.asin(0.5 * e), w
