"""Tasks of the environments: where an episode begins, what is wanted, and when it is lost."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sitl import Body, Quaternion, Reference, SitlError, Vector, along, hover_at, leg
from sitl.gym.rewards import CRUISE_NORTH, GO_TO_PLACE, HOLD_PLACE, Goal
from sitl.model.quaternions import from_euler, hover, multiply
from sitl.sensors.draws import in_fine_steps

WANTED_AIRSPEED = 15.0  # in forward flight [m/s]
LEG_DISTANCE = 80.0  # [m]
MAX_GYRATION = 8.0  # of a fall [rad/s]
DEEPEST_FALL = 150.0  # from where it began [m]


class TaskWeather(NamedTuple):
    """Wind and gusts that belong to a task, unless they are varied otherwise."""

    wind: tuple[float, float] = (0.0, 0.0)  # steady, level, from anywhere [m/s]
    gusts: tuple[float, float] = (0.0, 0.0)  # rms per axis [m/s]


class FlightTask(NamedTuple):
    """A task by name."""

    goal: Goal
    seconds: float  # after which an episode is cut off [s]
    begin: Callable[[np.random.Generator, Vector], Body]  # state at the beginning of an episode at a place
    weather: TaskWeather = TaskWeather()

    @property
    def reference(self) -> Reference:
        """The same goal as the product's own controllers are told it."""
        goal, start = self.goal, Vector(0.0, 0.0, self.goal.place.z)
        if goal.kind == HOLD_PLACE:
            return hover_at(goal.place, 0.0)
        if goal.kind == GO_TO_PLACE:
            return along(hover_at(goal.place, 0.0), leg(start, goal.place, goal.speed), 0.0)
        far = start._replace(x=1e4)
        return along(hover_at(far, 0.0), leg(start, far, goal.speed, stop=False), 0.0)


def thrown_off(random: np.random.Generator, place: Vector) -> Body:
    """Up to 2 m and 1.5 m/s off a hover on each axis, tilted by up to 0.5 rad, at any heading."""
    off, speed, tilt, turn = (random.uniform(-1.0, 1.0, 3) for _ in range(4))
    heading = float(random.uniform(-math.pi, math.pi))
    leaning = from_euler(0.5 * float(tilt[0]), 0.5 * float(tilt[1]), 0.0)
    position = Vector(place.x + 2.0 * float(off[0]), place.y + 2.0 * float(off[1]), place.z + 2.0 * float(off[2]))
    return Body(position, _vector(1.5 * speed), multiply(leaning, hover(heading)), _vector(turn))


def hovering_at(random: np.random.Generator, place: Vector) -> Body:
    """Nearly at rest 0 m north at the height of a place, belly to the north."""
    small = random.uniform(-1.0, 1.0, 9)
    leaning = from_euler(0.05 * float(small[0]), 0.05 * float(small[1]), 0.0)
    attitude = multiply(leaning, hover(0.1 * float(small[2])))
    still = Vector(0.0, 0.0, place.z)
    return Body(still, _vector(0.2 * small[3:6]), attitude, _vector(0.1 * small[6:9]))


def falling_from(random: np.random.Generator, place: Vector) -> Body:
    """Any attitude, a tumble about any axis, sinking at up to 15 m/s and moving level at up to 10 m/s."""
    q, axis = (in_fine_steps(random.standard_normal(size)) for size in (4, 3))
    q, axis = q / math.sqrt(float(q @ q)), axis / math.sqrt(float(axis @ axis))
    level = random.uniform(-7.0, 7.0, 2)
    velocity = Vector(float(level[0]), float(level[1]), -15.0 * float(random.uniform()))
    return Body(place, velocity, Quaternion(*q.tolist()), _vector(MAX_GYRATION * float(random.uniform()) * axis))


def _vector(numbers: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Vector:
    return Vector(*numbers.tolist())


_NEAR = Goal(kind=HOLD_PLACE, place=Vector(0.0, 0.0, 50.0), speed=0.0, scale=2.0, bound=10.0, above=10.0)
TASKS = {
    "Hover": FlightTask(_NEAR, 10.0, thrown_off),
    "Transition": FlightTask(
        Goal(
            kind=CRUISE_NORTH,
            place=Vector(0.0, 0.0, 100.0),
            speed=WANTED_AIRSPEED,
            scale=4.0,
            bound=30.0,
            above=20.0,
        ),
        12.0,
        hovering_at,
    ),
    "Leg": FlightTask(
        Goal(
            kind=GO_TO_PLACE,
            place=Vector(LEG_DISTANCE, 0.0, 100.0),
            speed=WANTED_AIRSPEED,
            scale=5.0,
            bound=30.0,
            above=20.0,
        ),
        25.0,
        hovering_at,
    ),
    "Fall": FlightTask(
        _NEAR._replace(place=Vector(0.0, 0.0, 300.0), scale=10.0, bound=DEEPEST_FALL, above=DEEPEST_FALL),
        20.0,
        falling_from,
    ),
    "Gust": FlightTask(
        _NEAR._replace(bound=20.0, above=20.0), 20.0, thrown_off, TaskWeather(wind=(0.0, 5.0), gusts=(0.3, 1.2))
    ),
}


def task_of(name: str) -> FlightTask:
    """The task of a name.

    Raises:
        SitlError: If there is none.
    """
    if name not in TASKS:
        raise SitlError(f"task {name!r}: there is {', '.join(TASKS)}")
    return TASKS[name]
