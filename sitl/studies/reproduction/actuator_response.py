"""What a motor and an elevon make of a sine, as describing functions."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from sitl.compiled import entry
from sitl.model.actuators import limited, moved
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import sine_cosine
from sitl.model.state import Actuators
from sitl.studies.reproduction.draw import Sheet
from sitl.studies.reproduction.experiment import Panel

MIDDLE = 687.0  # of a motor's sine [rad/s]
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
    """Sine and cosine parts of what the left actuators make of a sine about 687 rad/s and 0 rad.

    Args:
        a: The airframe.
        motor: Amplitude of the motor's command [rad/s]; the elevon stands still if it is not 0.
        elevon: Amplitude of the elevon's command [rad].
        frequency: [Hz]
    """
    now = Actuators(MIDDLE, MIDDLE, 0.0, 0.0)
    dt, sine_part, cosine_part = 1.0 / (frequency * STEPS_PER_PERIOD), 0.0, 0.0
    for k in range(6 * STEPS_PER_PERIOD):
        sine, cosine = sine_cosine(2.0 * math.pi * k / STEPS_PER_PERIOD)
        command = Actuators(MIDDLE + motor * sine, MIDDLE, elevon * sine, 0.0)
        now = moved(now, limited(command, True, a), dt, a)
        if k >= 4 * STEPS_PER_PERIOD:  # the first periods settle
            value = now.left_motor - MIDDLE if motor != 0.0 else now.left_elevon
            sine_part, cosine_part = sine_part + value * sine, cosine_part + value * cosine
    return sine_part / STEPS_PER_PERIOD, cosine_part / STEPS_PER_PERIOD


def response_panel(made: Mapping[str, Airframe]) -> Panel:
    """Gain and phase of the saturated and the first-order actuators, over frequency."""
    frequencies = np.geomspace(0.5, 15.0, 20)
    sheet = Sheet("motors-response", 2, columns=2, height=2.0)
    with sheet as axes:
        for column, (which, amplitudes, unit) in enumerate(((0, (50.0, 300.0), "rad/s"), (2, (5.0, 30.0), "deg"))):
            for name in ("saturated", "first order"):
                for amplitude in amplitudes if name == "saturated" else amplitudes[:1]:
                    size = amplitude if which == 0 else math.radians(amplitude)
                    points = np.array([response(made[name], which, size, float(f)) for f in frequencies])
                    label = f"{name}, {amplitude:.0f} {unit}" if name == "saturated" else name
                    axes[column].loglog(frequencies, points[:, 0], label=label)
                    axes[column + 2].semilogx(frequencies, np.degrees(np.unwrap(points[:, 1])))
            axes[column].set_title(("motor", "elevon")[column], fontsize=9)
            axes[column].set_yticks([0.2, 0.5, 1.0], ["0.2", "0.5", "1"])
            axes[column].minorticks_off()
            axes[column + 2].set_xticks([1.0, 2.0, 5.0, 10.0], ["1", "2", "5", "10"])
            axes[column + 2].minorticks_off()
            axes[column].legend(fontsize=7)
            axes[column + 2].set_xlabel("frequency [Hz]")
        axes[0].set_ylabel("gain")
        axes[2].set_ylabel("phase [deg]")
        for axis in axes:
            axis.grid(alpha=0.2)
    return Panel(
        "", "Actuators as describing functions: saturated (two amplitudes) and first order",
        "The saturation acts as the first order does, with some subtleties that depend on the frequency.",
        "True of small motions. Of large ones the rate limit's lag reaches 90 deg and its gain falls with the "
        "amplitude: that is what a limit cycle needs.", sheet.svg,
    )  # fmt: skip
