"""Motors and elevons as describing functions: gain and phase of their response to a sine."""

from __future__ import annotations

import math

from sitl import Actuators, Airframe
from sitl.compiled import entry
from sitl.model.actuators import limited, moved
from sitl.model.arithmetic import sine_cosine

MEAN_MOTOR_SPEED = 687.0  # about which a motor's command oscillates [rad/s]
STEPS_PER_PERIOD = 200


def response(a: Airframe, which: int, amplitude: float, frequency: float) -> tuple[float, float]:
    """Gain [-] and phase [rad] of an actuator at the fundamental of a sine.

    Args:
        a: The airframe.
        which: 0 for a motor, 2 for an elevon.
        amplitude: [rad/s] or [rad].
        frequency: [Hz]
    """
    size = float(amplitude)
    sine, cosine = _fundamental(a, size if which == 0 else 0.0, size if which == 2 else 0.0, float(frequency))
    return math.hypot(sine, cosine) / size, math.atan2(cosine, sine)


@entry
def _fundamental(a: Airframe, motor: float, elevon: float, frequency: float) -> tuple[float, float]:
    """Sine and cosine parts of the left actuator's response to a sine about MEAN_MOTOR_SPEED or 0 rad.

    Args:
        a: The airframe.
        motor: Amplitude of the motor's command [rad/s]; the elevon stands still if it is not 0.
        elevon: Amplitude of the elevon's command [rad].
        frequency: [Hz]
    """
    now = Actuators(MEAN_MOTOR_SPEED, MEAN_MOTOR_SPEED, 0.0, 0.0)
    dt, sine_part, cosine_part = 1.0 / (frequency * STEPS_PER_PERIOD), 0.0, 0.0
    for k in range(6 * STEPS_PER_PERIOD):
        sine, cosine = sine_cosine(2.0 * math.pi * k / STEPS_PER_PERIOD)
        command = Actuators(MEAN_MOTOR_SPEED + motor * sine, MEAN_MOTOR_SPEED, elevon * sine, 0.0)
        now = moved(now, limited(command, True, a), dt, a)
        if k >= 4 * STEPS_PER_PERIOD:  # the first periods settle
            value = now.left_motor - MEAN_MOTOR_SPEED if motor != 0.0 else now.left_elevon
            sine_part, cosine_part = sine_part + value * sine, cosine_part + value * cosine
    return sine_part / STEPS_PER_PERIOD, cosine_part / STEPS_PER_PERIOD
