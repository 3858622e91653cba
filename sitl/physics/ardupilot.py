"""ArduPilot's JSON interface: its servo outputs in, one line of JSON with the vehicle's state out, over UDP.

After ``libraries/SITL/examples/JSON/readme.md`` and ``libraries/SITL/SIM_JSON.cpp`` of ArduPilot. It waits for every
answer (lockstep): its clock is our ``timestamp``. What its reader makes of JSON binds us:

- It seeks keys as text from the line's beginning, so that ``velocity`` comes before ``velocity_wind``, and it knows no
  blank after a colon.
- It reads the newest whole line between two line ends, so that the first answer of all is read with the second one:
  frames that are repeated must be answered.
- It makes compass, barometer and satellites of position and attitude itself.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Hashable
from typing import NamedTuple

from sitl.physics.driven_vehicle import Seen
from sitl.physics.link import Datagram, Link
from sitl.physics.rig import Rig
from sitl.sensors.draws import PERIOD

FRAME_FORMATS = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}  # by magic
_CONTROL_RATE = round(1.0 / PERIOD)  # [Hz]
_MAX_STEP = 49  # control periods: after 0.1 s and more it does not take the step for one
RESTART_DROP = 100  # a count that falls by less, but not to 0, is of a frame that came late
_SILENT_TIME = 2.0  # after which another autopilot may take over [s]
DEAD_TIME = 12.0  # after which it is taken to have ended: it asks again after ten seconds [s]


class Frame(NamedTuple):
    """One frame of servo outputs."""

    rate: int  # wanted [Hz]
    number: int  # counts up with every answer that it has read
    pulses: tuple[int, ...]  # [us], (16,) or (32,)


def read_frame(data: bytes) -> Frame | str:
    """The frame in a datagram, or why there is none."""
    if len(data) < 2:
        return f"a packet of {len(data)} bytes"
    magic = int.from_bytes(data[:2], "little")
    layout = FRAME_FORMATS.get(magic)
    if layout is None:
        return f"a packet with magic {magic}, which is neither {' nor '.join(map(str, FRAME_FORMATS))}"
    if len(data) != layout.size:
        return f"a packet of {len(data)} bytes, of magic {magic} it has {layout.size}"
    _, rate, number, *pulses = layout.unpack(data)
    return Frame(rate, number, tuple(pulses))


def state_line(seen: Seen, time: float, airspeed: float) -> bytes:
    """The state as ArduPilot reads it.

    Args:
        seen: Of the vehicle.
        time: Since the autopilot began [s].
        airspeed: Newest reading of the pitot tube [m/s].
    """
    state = {
        "timestamp": round(time, 6),
        "imu": {"gyro": seen.rates, "accel_body": seen.force},
        "position": seen.position,
        "quaternion": seen.attitude,
        "velocity": seen.velocity,
        "airspeed": airspeed,
        "velocity_wind": seen.wind,
        "battery": {"voltage": seen.voltage, "current": seen.current},
    }
    return f"\n{json.dumps(state, separators=(',', ':'))}\n".encode()


class ArduPilotLink(Link):
    """One ArduPilot; see :class:`sitl.physics.link.Link`."""

    default_port = 9002  # SIM_OUT_PORT; 10 more for each instance, as its -I adds

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self._peer: Hashable | None = None
        self._number, self._heard, self._is_silent = -1, 0.0, False
        self._wanted, self._owed = 0, 0.0
        self._answer, self._airspeed = b"", 0.0
        self._began = rig.vehicle.periods

    def receive(self, data: bytes, peer: Hashable, now: float) -> list[Datagram]:
        """Take a datagram; a frame that was answered is answered as before."""
        frame = read_frame(data)
        if isinstance(frame, str):
            self.journal.note("bad packets", f"{frame}: not of ArduPilot's JSON interface, ignored")
            return []
        if peer != self._peer and not self._follow(peer, frame, now):
            return []
        self._heard, self._is_silent = now, False
        if frame.number == self._number:
            if self._wanted:
                return []
            self.journal.note("repeated frames", f"frame {frame.number} again: answered again")
            return [(self._answer, peer)]
        if frame.number < self._number:
            if frame.number > 0 and self._number - frame.number < RESTART_DROP:
                self.journal.note("late frames", f"frame {frame.number} after {self._number}: ignored")
                return []
            self._begin(f"ArduPilot began anew (frame {frame.number} after {self._number})")
        elif self._number >= 0 and (lost := frame.number - self._number - 1):
            self.journal.note("lost frames", f"{lost} frames before {frame.number} are lost", lost)
        self._take(frame)
        return []

    def _follow(self, peer: Hashable, frame: Frame, now: float) -> bool:
        """Whether to listen to another sender: a first one, one that begins, or one after a silence."""
        if self._peer is not None and frame.number > 0 and now - self._heard < _SILENT_TIME:
            text = f"a second autopilot at {_text(peer)}: ignored, as {_text(self._peer)} flies"
            self.journal.note("foreign frames", text)
            return False
        self.journal.say(f"ArduPilot at {_text(peer)}, {frame.rate} Hz, {len(frame.pulses)} outputs")
        self._peer = peer
        return True

    def _begin(self, why: str) -> None:
        self.rig.restarted(why)
        self._began, self._owed = self.rig.vehicle.periods, 0.0

    def _take(self, frame: Frame) -> None:
        self._number = frame.number
        rate = frame.rate
        if not 0 < rate <= _CONTROL_RATE:
            wish = f"ArduPilot asks for {rate} steps a second: the plant has {_CONTROL_RATE}; SIM_RATE_HZ can say so"
            self.journal.note("other rates", wish)
            rate = _CONTROL_RATE
        self._owed += _CONTROL_RATE / rate
        periods = min(max(int(self._owed), 1), _MAX_STEP)
        self._owed = min(self._owed - periods, 1.0)
        self._wanted = periods
        self.rig.take(frame.pulses)

    def poll(self, now: float) -> list[Datagram]:
        """Nothing; a silence is told once."""
        has_answer = self._peer is not None and not self._wanted
        if has_answer and not self._is_silent and now - self._heard > DEAD_TIME:
            self._is_silent = True
            text = f"no frames for {DEAD_TIME:g} s: the vehicle waits at {self.rig.vehicle.time:.1f} s"
            self.journal.tell("silences", text)
        return []

    def wants(self, now: float) -> int:  # noqa: ARG002 - it answers whenever it is asked
        """Control periods of the frame that waits for its answer."""
        return self._wanted

    def step(self, now: float) -> list[Datagram]:
        """Fly them and answer."""
        seen = self.rig.fly(self._wanted)
        self._wanted, self._heard = 0, now  # a pause of ours is no silence
        self._airspeed = self._airspeed if seen.airspeed is None else seen.airspeed
        time = (self.rig.vehicle.periods - self._began) * PERIOD
        self._answer = state_line(seen, time, self._airspeed)
        return [(self._answer, self._peer)]


def _text(peer: Hashable) -> str:
    return ":".join(map(str, peer)) if isinstance(peer, tuple) else str(peer)
