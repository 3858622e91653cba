"""Betaflight's SITL: the vehicle's state to its UDP port 9003, its outputs at ours, 9001.

After ``src/platform/SIMULATOR/sitl.c`` and ``target/SITL/target.h`` of Betaflight 4.6. It reads a state, lets its main
loop write outputs once, and waits for the next state: one state, one answer, and a state without an answer is sent
again. It has no autopilot's number and no count of frames: only its silence tells that it has ended. Radio control, its
port 9004, is the user's.

Between states its clock goes by the wall clock, times how fast the states' own times have last gone: so a state that is
sent again is a little later by its own time, while the vehicle stays where it is, or that clock would stop. A state
while it boots may hang it. It tells its outputs once when it has booted, for which we wait; for one that did so before
we came, a pair of states goes out now and then, since of a pause it takes the first one for its end alone.

It turns what it reads into its own body frame, x ahead, y left, z up: rates and attitude it takes for those of FRD in
NED, and of a force it turns all signs about.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Hashable

from protocol.frames import LocalFrame, flip
from sitl.mavlink.telemetry.sensor_messages import standard_atmosphere
from sitl.physics.driven_vehicle import Seen
from sitl.physics.link import Datagram, Link
from sitl.physics.rig import Rig

STATE = struct.Struct("<18d")  # time; rates; force; attitude w, x, y, z; velocity; position; pressure
TIME = struct.Struct("<d")  # of a state
_OUTPUTS = struct.Struct("<Hxx16f")  # number of motors; outputs, first the motors and then the servos [us]
STATE_PORT = 9003
_STEP_PERIODS = 1
REPEAT_TIME = 0.01  # after which a state is sent again, and later by so much; it takes less than 0.02 [s]
SEEK_TIME = 3.0  # between two pairs of states while nobody answers [s]
_SILENT_TIME = 2.0  # after which Betaflight is taken to have ended [s]


class BetaflightLink(Link):
    """One Betaflight; see :class:`sitl.physics.link.Link`.

    Args:
        rig: The vehicle.
        frame: Its local frame.
        peer: Address and port of Betaflight's state input.
    """

    default_port = 9001

    def __init__(self, rig: Rig, frame: LocalFrame, peer: tuple[str, int]) -> None:
        super().__init__(rig)
        self._frame, self._peer = frame, peer
        self._lead = 0.0  # of the states' times over the vehicle's [s]
        self._state, self._pressure = b"", 100.0 * standard_atmosphere(frame.origin.alt)[0]
        self._sent = self._heard = -math.inf
        self._awaits = self._is_known = self._is_silent = self._is_second = False

    def receive(self, data: bytes, peer: Hashable, now: float) -> list[Datagram]:
        """Take a datagram of outputs."""
        if len(data) != _OUTPUTS.size:
            text = f"a packet of {len(data)} bytes, Betaflight's outputs have {_OUTPUTS.size}: ignored"
            self.journal.note("bad packets", text)
            return []
        if isinstance(peer, tuple) and peer[0] != self._peer[0]:
            self.journal.note("foreign packets", f"outputs from {peer[0]}, not from {self._peer[0]}: ignored")
            return []
        if self._is_silent:
            self.rig.restarted("Betaflight answers again")
        elif not self._is_known:
            self.journal.say(f"Betaflight at {self._peer[0]} answers")
        elif not self._awaits:
            self.journal.note("repeated outputs", "outputs without a new state: no step for them")
        self._is_known, self._is_silent, self._heard, self._awaits = True, False, now, False
        self.rig.take(_OUTPUTS.unpack(data)[1:])
        return []

    def poll(self, now: float) -> list[Datagram]:
        """The state again, if its answer is missing."""
        if not self._awaits:
            return []
        if self._is_known and not self._is_silent and now - self._heard > _SILENT_TIME:
            self._is_silent = True
            self.rig.disarm()
            text = f"no outputs for {_SILENT_TIME:g} s: the vehicle waits at {self.rig.vehicle.time:.1f} s"
            self.journal.tell("silences", text)
        if now < self.wakes():
            return []
        self._sent, self._is_second = now, not self._is_second
        self._lead += REPEAT_TIME
        self._state = TIME.pack(self.rig.vehicle.time + self._lead) + self._state[TIME.size :]
        if self._is_known and not self._is_silent:
            self.journal.note("repeated states", "a state without an answer is sent again")
        return [(self._state, self._peer)]

    def wants(self, now: float) -> int:  # noqa: ARG002 - it goes as it is answered
        """Control periods to the next state, if the last one is answered."""
        return 0 if self._awaits else _STEP_PERIODS

    def wakes(self) -> float:
        """Time to send a state again."""
        if not self._awaits:
            return math.inf
        answers = self._is_known and not self._is_silent
        return self._sent + (SEEK_TIME if self._is_second and not answers else REPEAT_TIME)

    def step(self, now: float) -> list[Datagram]:
        """Fly them and send the state."""
        seen = self.rig.fly(_STEP_PERIODS)
        if seen.height is not None:
            self._pressure = 100.0 * standard_atmosphere(self._frame.origin.alt + seen.height)[0]
        self._state = self._packed(seen)
        self._awaits, self._sent, self._is_second = True, now, False
        return [(self._state, self._peer)]

    def _packed(self, seen: Seen) -> bytes:
        north, east, down = seen.velocity
        place = self._frame.to_geodetic(seen.position)  # its virtual GPS takes the position for degrees
        return STATE.pack(
            seen.time + self._lead,
            *seen.rates,
            *(-force for force in flip(seen.force)),
            *seen.attitude,
            *(east, north, -down),
            *(place.lon_deg, place.lat_deg, place.alt),
            self._pressure,
        )
