"""Laws of one's own beside two of the vehicle's, for tests of what is made from registers."""

import math
from enum import IntEnum
from typing import NamedTuple

from protocol.dialect.vocabulary import Law, Reason
from sitl.compiled import kernel
from sitl.control.laws import LAWS, VALUES, LawRow, ValueRow
from sitl.model.state import Actuators
from sitl.simulation.dispatch import Register
from sitl.supervisor import guards
from sitl.supervisor.guards import Guard
from sitl.supervisor.resets import Reset, point_from_here
from sitl.supervisor.table import Jump

ENOUGH = 0.5  # m/s2 s of what is counted


class OwnLaw(IntEnum):
    ASCEND = 101


class AscendGains(NamedTuple):
    thrust: float  # over the weight
    count: int  # type: ignore[assignment]  # a method of tuples is called so, too


class Ascended(NamedTuple):
    speed: float  # [m/s]
    periods: int
    size: float  # as numpy's own attribute is called


class AscendState(NamedTuple):
    course: float  # a slot of the vehicle's laws, which counts the time here [s]
    ascended: Ascended


@kernel
def ascend(estimate, gains, a, state: AscendState, dt):
    motor, ascended = math.sqrt(0.5 * gains.thrust * a.m * a.g / a.k_f), state.ascended
    after = Ascended(ascended.speed + dt * estimate.acceleration.z, ascended.periods + gains.count, 1.0)
    return Actuators(motor, motor, 0.01, -0.01), 3, AscendState(state.course + dt, after)


@kernel
def enough(speed_value):
    return speed_value > ENOUGH


@kernel
def speed_value(ascended):
    return ascended.speed


@kernel
def forget(ascended):
    return Ascended(0.0, ascended.periods, 0.0)


FAST = Guard("fast", "Climbing fast enough.", 1 << 40, enough)
FORGET = Reset("forget", ("ascended",), forget, clears=(FAST,))
OFF = Jump("off", Law.LANDED, Reason.DISARM, unless=(guards.armed,))


def register(step=ascend, **changes):
    """Three laws, one of them not the vehicle's own, and of its values the cheapest: every one is compiled."""
    chosen = {
        "laws": [row for row in LAWS if row.law in {Law.LANDED, Law.HOVER_ZERO_MOMENT}]
        + [LawRow(OwnLaw.ASCEND, step, "ascend")],  # type: ignore[arg-type]  # of another IntEnum
        "values": (VALUES[-1], ValueRow("speed_value", speed_value, "ascend")),
        "table": {
            Law.LANDED: (),
            Law.HOVER_ZERO_MOMENT: (
                OFF,
                Jump("there", OwnLaw.ASCEND, Reason.COMMAND, when=(guards.attitude_commanded,)),  # type: ignore[arg-type]
            ),
            OwnLaw.ASCEND: (
                OFF,
                Jump("back", Law.HOVER_ZERO_MOMENT, Reason.COMMAND, when=(guards.attitude_commanded,)),
                Jump("level_off", Law.HOVER_ZERO_MOMENT, Reason.SPEED, when=(FAST,), resets=(point_from_here, FORGET)),
            ),
        },
        "states": {"ascended": Ascended},
        "gains": {"ascend": AscendGains(1.2, 2)},
    }
    return Register(**chosen | changes)


OWN = register()
