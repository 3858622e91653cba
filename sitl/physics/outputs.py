"""From an autopilot's outputs to motors and elevons: which channel moves what, and between which values."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from protocol.tools.files import decode_text
from sitl.errors import SitlError
from sitl.model.airframe import Airframe
from sitl.model.state import Actuators
from sitl.tools.toml_table import TomlTable

_MAX_CHANNEL = 32


class Output(NamedTuple):
    """One output of the autopilot; ``low`` above ``high`` turns its direction about."""

    channel: int  # from 1
    low: float  # value of a stopped motor, or of an elevon at its lower end
    high: float  # value of a motor at full speed, or of an elevon at its upper end: its trailing edge up, nose up

    def share(self, values: Sequence[float]) -> float:
        """Its place between low and high, 0 to 1; NaN where there is no such channel, or no pulse."""
        value = values[self.channel - 1] if self.channel <= len(values) else math.nan
        if value == 0.0 and min(self.low, self.high) > 0.0:  # a pulse of no length is none
            return math.nan
        return (value - self.low) / (self.high - self.low) if math.isfinite(value) else math.nan


class OutputMap(NamedTuple):
    """The outputs of the four actuators."""

    left_motor: Output
    right_motor: Output
    left_elevon: Output
    right_elevon: Output

    def is_finite(self, values: Sequence[float]) -> bool:
        """Whether all that is used of the values are numbers, and there."""
        channels = [output.channel for output in self]
        return max(channels) <= len(values) and all(math.isfinite(values[channel - 1]) for channel in channels)

    def command(self, values: Sequence[float], a: Airframe) -> Actuators | None:
        """Actuator commands; None where no motor is asked to turn.

        A motor's speed is proportional to its share, as an idle speed controller's is; an elevon without a pulse is in
        the middle.
        """
        motors = [_within(output.share(values), 0.0) for output in self[:2]]
        elevons = [2.0 * _within(output.share(values), 0.5) - 1.0 for output in self[2:]]
        if max(motors) <= 0.0:
            return None
        return Actuators(*(share * a.omega_max for share in motors), *(share * a.delta_max for share in elevons))


def _within(share: float, without: float) -> float:
    return without if math.isnan(share) else min(max(share, 0.0), 1.0)


def _pulses(left_motor: int, right_motor: int, left_elevon: int, right_elevon: int) -> OutputMap:
    return OutputMap(
        *(Output(channel, 1000.0, 2000.0) for channel in (left_motor, right_motor, left_elevon, right_elevon))
    )


SHIPPED = {
    # SERVO1_FUNCTION 77 ElevonLeft, 2: 78 ElevonRight, 3: 73 ThrottleLeft, 4: 74 ThrottleRight.
    "ardupilot": _pulses(3, 4, 1, 2),
    # 10042_sihsim_xvert: PWM_MAIN_FUNC1 101 right, 2: 102 left, 5: 201 left, 6: 202 right; motors 0..1, servos -1..1.
    "px4": OutputMap(Output(2, 0.0, 1.0), Output(1, 0.0, 1.0), Output(5, -1.0, 1.0), Output(6, -1.0, 1.0)),
    # Mixer FLYING_WING: one motor, then SERVO_FLAPPERON_1 and _2.
    "betaflight": _pulses(1, 1, 2, 3),
    # Mixer CUSTOMAIRPLANE with two motors: then come the servos 2 (flaps), 3 and 4.
    "betaflight-tailsitter": _pulses(1, 2, 4, 5),
}


def load_outputs(name_or_path: str) -> OutputMap:
    """Shipped outputs, or those of a TOML file.

    Args:
        name_or_path: A name of ``SHIPPED``, or a file with tables ``[left_motor]``, ``[right_motor]``,
            ``[left_elevon]`` and ``[right_elevon]``, each with ``channel``, ``low`` and ``high``; ``base`` names the
            shipped ones that it changes.

    Raises:
        SitlError: If the file cannot be read or is not valid; the message names file, key and value.
    """
    if name_or_path in SHIPPED:
        return SHIPPED[name_or_path]
    try:
        raw = tomllib.loads(decode_text(Path(name_or_path).read_bytes()))
    except OSError as error:
        names = ", ".join(SHIPPED)
        raise SitlError(f"{name_or_path}: {error.strerror} (shipped outputs: {names})") from error
    except (tomllib.TOMLDecodeError, UnicodeError) as error:
        raise SitlError(f"{name_or_path}: not a TOML file: {error}") from error
    top = TomlTable(name_or_path, raw, "", {"base", *OutputMap._fields})
    base = SHIPPED[top.choice("base", tuple(SHIPPED))] if top.has("base") else None
    known = {} if base is None else base._asdict()
    for name in OutputMap._fields:
        if top.has(name) or base is None:
            known[name] = _output(name_or_path, top.table(name), name)
    return OutputMap(**known)


def _output(file: str, raw: object, where: str) -> Output:
    table = TomlTable(file, raw, where, set(Output._fields))
    channel = table.number("channel", 1, _MAX_CHANNEL)
    if channel != int(channel):
        raise table.error("channel", f"= {channel:g} is not a whole number")
    low, high = (table.number(key, -1e6, 1e6) for key in ("low", "high"))
    if low == high:
        raise table.error("high", f"= {high:g} is the same as low")
    return Output(int(channel), low, high)
