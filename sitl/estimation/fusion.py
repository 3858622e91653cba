"""Update of the filter by one scalar reading, and the test whether its instrument is believed.

Here is what all instruments share; what each of them tells is in ``observations`` and ``air_readings``.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.estimation.filter import Filter, put_nominal
from sitl.estimation.kalman import ErrorState, ScalarReading, correct, innovation_ratio, turn_errors
from sitl.estimation.nominal_state import AIR_ERRORS, ATTITUDE_ERROR, corrected
from sitl.model.airframe import Array
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import FIRST_DELAYED, GNSS, MOTION_CAPTURE, N_DELAYED, PITOT
from sitl.storage import value_of

NO_OTHER = -1
SATELLITE_VELOCITY, POSE_ATTITUDE = N_DELAYED, N_DELAYED + 1  # slots beside the lines: they are refused by themselves
MISTRUSTED_TIME = 0.5  # after a reading that was refused, none is fused for so long: garbage fits now and then [s]
# A belief goes astray little by little: where a reading that was right just before is far off, the instrument is wrong.
LATELY = 0.3  # since the last refusal: what comes sooner is not the first [s]
LEAPT = 16.0  # far off, in gates, squared
RIGHT_AGAIN = 10.0  # what has failed to tell the place is believed again after agreeing for so long [s]
JUST_BEFORE = 1.0  # since an instrument last helped: after a longer silence the belief may be what went astray [s]


class Agreement(NamedTuple):
    """Squared innovations of a reading over their variances."""

    worst: float  # of its scalars
    total: float  # of all of them
    scalars: int  # how many those are


@kernel
def put_vector(H: Array, first: int, value: Vector) -> None:
    """Set three numbers of H."""
    H[first], H[first + 1], H[first + 2] = value.x, value.y, value.z


@subroutine
def fuse(f: Filter, first: int, innovation: float, variance: float) -> float:
    """Correct by a scalar whose derivative stands in H; see :func:`sitl.estimation.kalman.correct`."""
    state = ErrorState(f.covariance, f.H, f.PH, f.errors, f.settings.states)
    return correct(state, ScalarReading(innovation, variance, f.settings.gate, 0.0), first, AIR_ERRORS)


@subroutine
def fuse_cautiously(f: Filter, first: int, innovation: float, variance: float, caution: float) -> float:
    """Likewise by less than the scalar tells, as if its variance were larger by ``caution``."""
    state = ErrorState(f.covariance, f.H, f.PH, f.errors, f.settings.states)
    return correct(state, ScalarReading(innovation, variance, f.settings.gate, caution), first, AIR_ERRORS)


@subroutine
def innovation_ratio_of(f: Filter, innovation: float, variance: float) -> float:
    """The squared innovation over its variance of a scalar whose derivative stands in H, which is set to zero."""
    ratio = innovation_ratio(f.covariance, f.H, f.settings.states, innovation, variance)
    f.H[:] = 0.0
    return ratio


@subroutine
def may_be_fused(f: Filter, slot: int, period: int, worst: float) -> bool:
    """Whether a reading agrees with the belief and may be fused; ``slot`` is its line, or one beside the lines."""
    at, gate = f.refused_at, f.settings.gate
    if worst > gate * gate:
        if (period - at[slot]) * PERIOD > LATELY:
            f.first_refused_at[slot] = period
            f.leapt[slot] = 1.0 if worst > LEAPT * gate * gate and _helped_lately(f, slot, period) else 0.0
        at[slot] = period
        return False
    if (period - at[slot]) * PERIOD > LATELY:
        f.leapt[slot] = 0.0
    line = _line_of(slot)
    if f.failed[line + FIRST_DELAYED] > 0.0 and line != PITOT - FIRST_DELAYED:
        return _is_right_again(f, slot, line, period)
    return bool((period - at[slot]) * PERIOD > MISTRUSTED_TIME)


@subroutine
def _is_right_again(f: Filter, slot: int, line: int, period: int) -> bool:
    """Whether all that an instrument tells that has failed has agreed for long; of a pose the attitude will do."""
    at = f.refused_at
    last = at[slot] if slot == POSE_ATTITUDE else max(at[line], at[paired_slot(line)])
    right = bool((period - last) * PERIOD > RIGHT_AGAIN)
    if right and slot == line:
        f.failed[line + FIRST_DELAYED] = 0.0
    return right


@kernel
def paired_slot(line: int) -> int:
    """The slot of what a line tells beside the place."""
    return SATELLITE_VELOCITY if line == GNSS - FIRST_DELAYED else POSE_ATTITUDE


@kernel
def _line_of(slot: int) -> int:
    if slot < N_DELAYED:
        return slot
    return GNSS - FIRST_DELAYED if slot == SATELLITE_VELOCITY else MOTION_CAPTURE - FIRST_DELAYED


@kernel
def _helped_lately(f: Filter, slot: int, period: int) -> bool:
    """Whether the instrument of a slot was right just before."""
    return bool((period - f.fused_at[_line_of(slot)]) * PERIOD < JUST_BEFORE)


@subroutine
def note(f: Filter, line: int, period: int, agreement: Agreement, fused: bool) -> bool:
    """Note how well a reading agreed; whether it was fused."""
    f.ratio[line] = agreement.worst
    f.squares[line] += agreement.total
    f.scalars[line] += agreement.scalars
    gate = f.settings.gate
    if agreement.worst <= gate * gate:
        f.refused_since[line] = -1.0
        f.fused_at[line] = period if fused else f.fused_at[line]
        return fused
    if f.refused_since[line] < 0.0:
        f.refused_since[line] = period
    return False


@subroutine
def correct_nominal(f: Filter) -> None:
    """Take the estimated errors out of the belief."""
    errors = f.errors
    turn = Vector(errors[ATTITUDE_ERROR], errors[ATTITUDE_ERROR + 1], errors[ATTITUDE_ERROR + 2])
    if turn.x != 0.0 or turn.y != 0.0 or turn.z != 0.0:
        turn_errors(f.covariance, f.settings.states, turn)
    put_nominal(f, corrected(value_of(f.nominal), f.errors))


@kernel
def sum_of_errors(H: Array, first: int, other: int) -> None:
    """Let the scalar be the sum of two errors, or the first alone."""
    H[first] = 1.0
    if other != NO_OTHER:
        H[other] = 1.0
