"""One control period of sensing and navigation, compiled: plant -> instruments -> filter -> estimate."""

from __future__ import annotations

from collections.abc import Callable
from inspect import getsource
from typing import NamedTuple, cast

from sitl.compiled import kernel, part
from sitl.control.estimate import Estimate
from sitl.estimation.filter import Filter
from sitl.estimation.navigator import navigate
from sitl.estimation.nominal_state import ARENA_ERRORS
from sitl.model.actuators import limited
from sitl.model.airframe import Airframe, Array
from sitl.model.state import Actuators, Plant
from sitl.model.vectors import Vector
from sitl.sensors.aiding import read_outdoors, read_pose, read_tube
from sitl.sensors.draws import PERIOD, SLOW_PERIODS, is_time
from sitl.sensors.hidden_errors import drift, turn_propellers
from sitl.sensors.inertial import read_inertial
from sitl.sensors.instruments import PENDING, Instruments, put_inertial
from sitl.sensors.misreadings import misread
from sitl.storage import Records, value_of


@kernel
def delayed(i: Instruments, command: Actuators, period: int) -> Actuators:
    """The command in force in a period: as late as the pipeline makes it, and held from frame to frame.

    The vehicle knows it, since the timers that begin the frames are its own.
    """
    pending, held, pipeline = i.pending, i.held, value_of(i.specification.pipeline)
    late = int(pipeline.latency / PERIOD + 0.5)
    if late == 0 and pipeline.servo_rate * PERIOD >= 1.0 and pipeline.motor_rate * PERIOD >= 1.0:
        return command
    at, then = period % PENDING, (period - late) % PENDING
    pending[at, 0], pending[at, 1] = command.left_motor, command.right_motor
    pending[at, 2], pending[at, 3] = command.left_elevon, command.right_elevon
    if _begins_frame(period, pipeline.motor_rate):
        held[0], held[1] = pending[then, 0], pending[then, 1]
    if _begins_frame(period, pipeline.servo_rate):
        held[2], held[3] = pending[then, 2], pending[then, 3]
    return Actuators(held[0], held[1], held[2], held[3])


@kernel
def _begins_frame(period: int, rate: float) -> bool:
    return rate * PERIOD >= 1.0 or is_time(period, rate, PERIOD)


class Aboard(NamedTuple):
    """Instruments and filter of one vehicle."""

    instruments: Instruments
    filter: Filter


class Motion(NamedTuple):
    """A control period of the vehicle as it is."""

    before: Plant  # at its beginning
    plant: Plant  # at its end
    wind: Vector  # velocity of the air, world NWU [m/s]
    command: Actuators  # in force, as the vehicle sent it
    may_turn: bool  # whether the motors may turn
    period: int  # control periods flown
    has_tube: bool  # whether there is a pitot tube


@part
def sensed(aboard: Aboard, steps: Records, a: Airframe, motion: Motion, fast: Array, slow: Array) -> Estimate:
    """Estimate of the vehicle at the end of a control period, by its instruments and filter.

    Args:
        aboard: Instruments and filter, a record.
        steps: What the filter has yet to come to, records, (MAX_HORIZON,).
        a: The airframe as it is, a record.
        motion: The period.
        fast: Draws of a block of periods, (n, FAST_COLUMNS).
        slow: Draws of its slow steps, (n / SLOW_PERIODS, SLOW_COLUMNS).
    """
    i, f = aboard.instruments, aboard.filter
    plant, wind, period = motion.plant, motion.wind, motion.period
    airframe, now = value_of(a), (period - 1) % fast.shape[0]
    draws = fast[now]
    inertial = read_inertial(i, motion.before, plant, draws, airframe, PERIOD)
    put_inertial(i, misread(i, inertial, period, PERIOD))
    turn_propellers(i, plant, wind, airframe, PERIOD)
    if now % SLOW_PERIODS == 0:
        drift(i, slow[now // SLOW_PERIODS], PERIOD)
    in_arena = f.settings.states == ARENA_ERRORS
    if in_arena:
        read_pose(i, period, plant, draws, PERIOD)
    read_tube(i, period, slow[now // SLOW_PERIODS], PERIOD)
    if not in_arena:
        read_outdoors(i, period, plant, wind, slow[now // SLOW_PERIODS], PERIOD)
    return navigate(f, i, steps, period, limited(motion.command, motion.may_turn, value_of(f.model)), motion.has_tube)


def sensed_by(other: Callable[..., Estimate]) -> Callable[..., Estimate]:
    """The same about another filter, called as ``navigate`` is: the text is read once more."""
    scope = {**globals(), "navigate": other, "part": kernel}
    exec(getsource(getattr(sensed, "py_func", sensed)), scope)  # noqa: S102 - the text above
    return cast("Callable[..., Estimate]", scope["sensed"])
