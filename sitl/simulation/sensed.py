"""One control period of sensing and navigation, compiled: plant -> instruments -> filter -> estimate."""

from __future__ import annotations

from sitl.compiled import counted_part, kernel
from sitl.control.estimate import Estimate
from sitl.estimation.filter import get_model
from sitl.estimation.navigator import navigate
from sitl.estimation.nominal_state import ARENA_ERRORS
from sitl.model.actuators import limited
from sitl.model.airframe import Airframe, Array
from sitl.model.state import Actuators, Plant
from sitl.model.vectors import Vector
from sitl.sensors.aiding import read_pose, read_slow
from sitl.sensors.draws import SLOW_PERIODS
from sitl.sensors.hidden_errors import drift, turn_propellers
from sitl.sensors.inertial import read_inertial
from sitl.sensors.instruments import (
    PENDING,
    get_errors,
    get_inertial,
    get_specification,
    put_inertial,
)
from sitl.sensors.misreadings import misread
from sitl.storage import Kept, access
from sitl.timing import PERIOD

get_airframe = access(Airframe).get


@kernel
def delayed(i: Kept, command: Actuators, period: int) -> Actuators:
    """The command that reaches the actuators in a period: as late as the pipeline makes it."""
    pending, late = i["pending"], int(get_specification(i, 0).pipeline.latency / PERIOD + 0.5)
    if late == 0:
        return command
    at, then = period % PENDING, (period - late) % PENDING
    pending[at, 0], pending[at, 1] = command.left_motor, command.right_motor
    pending[at, 2], pending[at, 3] = command.left_elevon, command.right_elevon
    return Actuators(pending[then, 0], pending[then, 1], pending[then, 2], pending[then, 3])


@counted_part
def sensed(
    i: Kept,
    f: Kept,
    steps: Kept,
    a: Kept,
    before: Plant,
    plant: Plant,
    wind: Vector,
    command: Actuators,
    is_armed: bool,
    period: int,
    fast: Array,
    slow: Array,
    has_tube: bool,
) -> Estimate:
    """Estimate of the vehicle at the end of a control period, by its instruments and filter.

    Args:
        i: Its instruments, a record.
        f: Its filter, a record.
        steps: What the filter has yet to come to, records, (MAX_HORIZON,).
        a: The airframe as it is, a record.
        before: The plant at the period's beginning.
        plant: The plant at its end.
        wind: Velocity of the air, world NWU [m/s].
        command: In force during the period, as the vehicle sent it.
        is_armed: Whether the motors may turn.
        period: Control periods flown.
        fast: Draws of a block of periods, (n, FAST_COLUMNS).
        slow: Draws of its slow steps, (n / SLOW_PERIODS, SLOW_COLUMNS).
        has_tube: Whether there is a pitot tube.
    """
    airframe, spec, now = get_airframe(a, 0), get_specification(i, 0), (period - 1) % fast.shape[0]
    draws = fast[now]
    inertial = read_inertial(
        before, plant, get_errors(i, 0), spec.gyroscope, spec.accelerometer, draws, get_inertial(i, 0), i["failures"],
        airframe.g, PERIOD,
    )  # fmt: skip
    inertial = misread(i, inertial, period, PERIOD)
    put_inertial(i, 0, inertial)
    turn_propellers(i, plant, wind, airframe, PERIOD)
    if now % SLOW_PERIODS == 0:
        drift(i, slow[now // SLOW_PERIODS], PERIOD)
    in_arena = f["settings"]["states"] == ARENA_ERRORS
    if in_arena:
        read_pose(i, period, plant, draws, PERIOD)
    read_slow(i, period, plant, wind, slow[now // SLOW_PERIODS], in_arena, PERIOD)
    return navigate(f, i, steps, period, limited(command, is_armed, get_model(f, 0)), has_tube)
