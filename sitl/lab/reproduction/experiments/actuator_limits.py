"""The limits of the actuators, as the compiled step of the plant obeys them (report, section 2.1.2)."""

from __future__ import annotations

import math

from sitl import Actuators, Airframe
from sitl.lab.reproduction.expectation import printed
from sitl.lab.reproduction.experiment import REPORT_SET, Conditions, Experiment, ExperimentResult, Statement
from sitl.model.actuators import limited, moved

TICK = 0.001  # [s]
HOVER_MOTOR_SPEED = 690.0  # of the motors at the start [rad/s]
BEYOND = Actuators(1e4, 1e4, math.radians(90.0), math.radians(90.0))
BELOW = Actuators(0.0, 0.0, -math.radians(90.0), -math.radians(90.0))
LIMITS_PLACE = "2.1.2"


def driven(start: Actuators, command: Actuators, duration: float, a: Airframe) -> Actuators:
    """The actuators after a time under a command, armed."""
    now, wanted = start, limited(command, True, a)
    for _ in range(round(duration / TICK)):
        now = moved(now, wanted, TICK, a)
    return now


def run(conditions: Conditions) -> ExperimentResult:
    """Drive motors and elevons against their stops, and measure how fast they go."""
    a = conditions.airframe(REPORT_SET)
    start = Actuators(HOVER_MOTOR_SPEED, HOVER_MOTOR_SPEED, 0.0, 0.0)
    soon, high, low = driven(start, BEYOND, 0.01, a), driven(start, BEYOND, 2.0, a), driven(start, BELOW, 2.0, a)
    rate, acceleration = soon.left_elevon / 0.01, (soon.left_motor - HOVER_MOTOR_SPEED) / 0.01
    swing = math.radians(60.0) / rate
    return ExperimentResult(
        [
            Statement(LIMITS_PLACE, "a motor commanded beyond its range turns by", printed("1000"), high.left_motor,
                      "rad/s"),
            Statement(LIMITS_PLACE, "a motor commanded below its range turns by", printed("200"), low.left_motor,
                      "rad/s"),
            Statement(LIMITS_PLACE, "a motor accelerates at most by", printed("3000"), acceleration, "rad/s2"),
            Statement(LIMITS_PLACE, "an elevon stops at", printed("30"), math.degrees(high.left_elevon), "deg"),
            Statement(LIMITS_PLACE, "an elevon turns at most by", printed("5.24"), rate, "rad/s",
                      note="printed in rad/s2"),
            Statement(LIMITS_PLACE, "an elevon needs for 60 deg", printed("0.2"), swing, "s"),
        ],
        [],
    )  # fmt: skip


ACTUATOR_LIMITS = Experiment(
    "limits",
    "Limits of the actuators",
    "2.1.2",
    "Motors and elevons are driven against their limits in the plant's own actuator model; what they do is measured.",
    run,
)
