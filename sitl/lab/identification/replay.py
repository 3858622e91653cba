"""The plant's own equations over recorded arrays: what the model makes of measured states and recorded commands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl import Actuators, Airframe, Array, Body, Plant, Quaternion, Vector
from sitl.compiled import entry, subroutine
from sitl.model.actuators import limited, moved, nodes
from sitl.model.aerodynamics import wrench
from sitl.model.ground import feet_aloft
from sitl.model.plant import advanced, derivative, step_in_air
from sitl.model.quaternions import normalised


@entry
def accelerations(v: Array, w: Array, actuators: Array, a: Airframe) -> tuple[Array, Array]:
    """Specific forces [m/s2] and angular accelerations [rad/s2] of states, body frame FLU, (n, 3) each.

    Args:
        v: Velocities relative to the air, body FLU, (n, 3) [m/s].
        w: Body rates, (n, 3) [rad/s].
        actuators: w1, w2 [rad/s], d1, d2 [rad], (n, 4).
        a: The airframe.
    """
    force, turning = np.empty((v.shape[0], 3)), np.empty((v.shape[0], 3))
    for i in range(v.shape[0]):
        p, q, r = w[i, 0], w[i, 1], w[i, 2]
        now = Actuators(actuators[i, 0], actuators[i, 1], actuators[i, 2], actuators[i, 3])
        F, M = wrench(Vector(v[i, 0], v[i, 1], v[i, 2]), Vector(p, q, r), now, a)
        force[i, 0], force[i, 1], force[i, 2] = F.x / a.m, F.y / a.m, F.z / a.m
        turning[i, 0] = (M.x - (a.J3 - a.J2) * q * r) / a.J1
        turning[i, 1] = (M.y - (a.J1 - a.J3) * p * r) / a.J2
        turning[i, 2] = (M.z - (a.J2 - a.J1) * p * q) / a.J3
    return force, turning


@entry
def actuator_positions(commands: Array, dt: float, a: Airframe) -> tuple[Array, Array]:
    """Actuator positions that follow from commands: before each step of ``dt`` [s] and in its mean, (n, 4) each.

    They begin where the first command (n, 4) wants them.
    """
    before, mean = np.empty(commands.shape), np.empty(commands.shape)
    now = limited(Actuators(commands[0, 0], commands[0, 1], commands[0, 2], commands[0, 3]), True, a)
    for i in range(commands.shape[0]):
        wanted = limited(Actuators(commands[i, 0], commands[i, 1], commands[i, 2], commands[i, 3]), True, a)
        _, middle, _ = nodes(now, wanted, dt, a)
        before[i, 0], before[i, 1], before[i, 2], before[i, 3] = now
        mean[i, 0], mean[i, 1], mean[i, 2], mean[i, 3] = middle
        now = moved(now, wanted, dt, a)
    return before, mean


@subroutine
def _rate(body: Body, actuators: Actuators, wind: Vector, a: Airframe) -> Body:
    free = Vector(0.0, 0.0, 0.0)
    return derivative(body, actuators, wind, free, free, a)


@entry
def courses(
    states: Array, begins: npt.NDArray[np.int64], dt: Array, actuators: Array, winds: Array, a: Airframe
) -> Array:
    """The plant's states at every sample, begun anew where a shot begins, (n, 13).

    Args:
        states: Position, velocity, attitude and body rates at the beginnings, (k, 13).
        begins: Samples at which shots begin, ascending from 0, (k,).
        dt: Time to the next sample, (n,) [s].
        actuators: Mean from each sample to the next, (n, 4).
        winds: Velocity of the air in each shot, world NWU, (k, 3) [m/s].
        a: The airframe.
    """
    course = np.empty((dt.shape[0], 13))
    air, shot = Vector(0.0, 0.0, 0.0), 0
    body = Body(Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0), Quaternion(1.0, 0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0))
    for i in range(dt.shape[0]):
        if shot < begins.shape[0] and begins[shot] == i:
            s = states[shot]
            body = Body(
                Vector(s[0], s[1], s[2]),
                Vector(s[3], s[4], s[5]),
                Quaternion(s[6], s[7], s[8], s[9]),
                Vector(s[10], s[11], s[12]),
            )
            air = Vector(winds[shot, 0], winds[shot, 1], winds[shot, 2])
            shot += 1
        p, v, q, w = body
        course[i, 0], course[i, 1], course[i, 2] = p.x, p.y, p.z
        course[i, 3], course[i, 4], course[i, 5] = v.x, v.y, v.z
        course[i, 6], course[i, 7], course[i, 8], course[i, 9] = q.w, q.x, q.y, q.z
        course[i, 10], course[i, 11], course[i, 12] = w.x, w.y, w.z
        mean, h = Actuators(actuators[i, 0], actuators[i, 1], actuators[i, 2], actuators[i, 3]), dt[i]
        k1 = _rate(body, mean, air, a)
        k2 = _rate(advanced(body, k1, 0.5 * h), mean, air, a)
        k3 = _rate(advanced(body, k2, 0.5 * h), mean, air, a)
        k4 = _rate(advanced(body, k3, h), mean, air, a)
        after = advanced(advanced(advanced(advanced(body, k1, h / 6.0), k2, h / 3.0), k3, h / 3.0), k4, h / 6.0)
        body = Body(after.position, after.velocity, normalised(after.attitude), after.rates)
    return course


class ActuatorHistory(NamedTuple):
    """Commands and actuators of every step, (m, 4) each."""

    commands: Array
    positions: Array  # before the step
    dt: float  # of a step [s]


@entry
def shots(
    states: Array, first: npt.NDArray[np.int64], steps: int, history: ActuatorHistory, wind: Array, a: Airframe
) -> Array:
    """States of the plant some steps after known states, (k, 13).

    Args:
        states: Position, velocity, attitude and body rates at the beginnings, (k, 13).
        first: The step at which each begins, (k,).
        steps: How many steps each flies.
        history: Of the commands and the actuators.
        wind: Velocity of the air, world NWU, (3,) [m/s].
        a: The airframe.
    """
    commands, positions, dt = history
    ends = np.empty_like(states)
    air = Vector(wind[0], wind[1], wind[2])
    for k in range(states.shape[0]):
        s, j = states[k], first[k]
        body = Body(
            Vector(s[0], s[1], s[2]),
            Vector(s[3], s[4], s[5]),
            Quaternion(s[6], s[7], s[8], s[9]),
            Vector(s[10], s[11], s[12]),
        )
        there = Actuators(positions[j, 0], positions[j, 1], positions[j, 2], positions[j, 3])
        plant = Plant(body, there, feet_aloft())
        for i in range(j, j + steps):
            wanted = limited(Actuators(commands[i, 0], commands[i, 1], commands[i, 2], commands[i, 3]), True, a)
            plant = step_in_air(plant, wanted, air, a, dt)
        p, v, q, w = plant.body
        ends[k, 0], ends[k, 1], ends[k, 2] = p.x, p.y, p.z
        ends[k, 3], ends[k, 4], ends[k, 5] = v.x, v.y, v.z
        ends[k, 6], ends[k, 7], ends[k, 8], ends[k, 9] = q.w, q.x, q.y, q.z
        ends[k, 10], ends[k, 11], ends[k, 12] = w.x, w.y, w.z
    return ends
