"""The bridge, without a socket: from NatNet packets to MAVLink messages, and what it tells a person."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from darko_gcs.motion_capture.bridge_links import AutopilotLink, NatnetLink
from darko_gcs.motion_capture.poses import MESSAGE_MAKERS, ArenaAxes, AxesSettings, PoseAccuracy, PoseTrack, is_credible
from darko_gcs.state.text import printable
from protocol.natnet import BodyReading, FrameReading, is_readable
from protocol.tools.timing import ClockMatch

STATISTICS_PERIOD = 10.0  # [s]
RATED_FRAMES = 20  # that tell how many come in a second
EARLY = 0.002  # a frame may be sent so much before the rate limit says [s]
MAX_FRAMES_BACK = 100  # a frame number that is lower by more is of a new stream
JUMPED = "the rigid body jumped (markers swapped?): no poses are sent until it jumps back or is lost"
MAX_LATE = 0.1  # a stamp that is earlier than the last one by more is of a clock that was set [s]
MAX_AGE = 1.0  # of a frame; what seems older is of a clock that cannot be matched [s]


class BridgeSettings(NamedTuple):
    """Settings of the bridge."""

    axes: AxesSettings = AxesSettings()
    body: str | int = ""  # name or number; empty: the only one
    message: str = "odometry"  # of MESSAGE_MAKERS
    rate: float = math.inf  # at most so many poses a second [Hz]
    latency: float = 0.0  # from the exposure to us that no stamp of the server tells [s]
    accuracy: PoseAccuracy = PoseAccuracy()


@dataclass(slots=True)
class _Count:
    """Counts since the last statistics."""

    began: float
    frames: int = 0
    sent: int = 0
    missing: int = 0  # frames whose number was left out
    lost: int = 0  # frames without the body
    held: int = 0  # poses after a jump
    damaged: int = 0  # packets that could not be read, at the beginning
    age: float = 0.0  # sum of what was sent [s]
    oldest: float = 0.0  # [s]


class PoseBridge:
    """Hand in what arrives on either side, send what the calls give; ``said`` collects lines for a person.

    Args:
        settings: What is bridged and how.
        natnet: The server's side.
        autopilot: The vehicle's side.
    """

    def __init__(self, settings: BridgeSettings, natnet: NatnetLink, autopilot: AutopilotLink) -> None:
        self._settings, self._natnet, self._autopilot = settings, natnet, autopilot
        self._axes, self._track, self._clocks = ArenaAxes(settings.axes), PoseTrack(), ClockMatch()
        self.said: list[str] = []
        self._count: _Count | None = None
        self._number: int | None = None  # of the last frame
        self._first_frame: tuple[int, float] | None = None  # of the stream: number and stamp [s]
        self._stamp = -math.inf  # of the last frame, on the server's clock if it tells it [s]
        self._due = -math.inf  # the next pose, by the rate limit [s]
        self._was_streaming = self._was_heard = self._was_tracked = self._was_held = False
        self._has_told_body = ""
        self._has_told_server = ""

    def from_server(self, data: bytes, now: float) -> list[bytes]:
        """Take a packet of the NatNet server; gives what is to be sent to the vehicle.

        Args:
            data: The packet.
            now: Monotonic time [s].
        """
        frame = self._natnet.receive(data, now)
        self._tell_server()
        return [] if frame is None else self._take(frame, now)

    def from_vehicle(self, data: bytes, now: float) -> None:
        """Take a datagram of the vehicle."""
        for text in self._autopilot.receive(data, now):
            self._say(f"the vehicle says: {text}")

    def handle_timer(self, now: float) -> None:
        """Let time pass: notice who is gone, and count."""
        self._tell_streaming(streaming=self._natnet.is_streaming)
        if self._autopilot.is_heard(now) != self._was_heard:
            self._was_heard = not self._was_heard
            self._say(
                f"vehicle ({self._autopilot.autopilot}) heard" if self._was_heard else "no HEARTBEAT from the vehicle"
            )
        if self._natnet.server is None and not self._has_told_server:
            self._has_told_server = "waiting for the NatNet server"
            self._say(self._has_told_server)
        if self._count is None:
            self._count = _Count(now, damaged=self._natnet.damaged)
        elif now - self._count.began >= STATISTICS_PERIOD:
            self._say(self._statistics(self._count, now))
            self._count = _Count(now, damaged=self._natnet.damaged)

    def _take(self, frame: FrameReading, now: float) -> list[bytes]:
        self._tell_streaming(streaming=True)
        count = self._count = self._count or _Count(now)
        if not self._is_next(frame.number, count):
            return []
        count.frames += 1
        time = self._exposure(frame, now)
        stamp = time if frame.exposed is None else frame.exposed
        if stamp < self._stamp - MAX_LATE:
            self._say("the NatNet server's clock was set back: tracking starts again")
            self._lose()
            self._due = -math.inf
        self._stamp = stamp
        self._first_frame = self._first_frame or (frame.number, stamp)
        body = self._body(frame)
        if body is None or not body.is_tracked or not is_credible(body.position, body.marker_error):
            count.lost += 1
            self._tell_tracked(tracked=False)
            self._lose()
            return []
        self._tell_tracked(tracked=True)
        pose = self._axes.pose(body.position, body.attitude)
        tracked = self._track.follow(stamp, pose, body.marker_error)
        self._tell_held()
        if tracked is None:
            count.held += self._track.is_held
            return []
        if not self._is_due(stamp):
            return []
        told = self._autopilot.stamp(time, None if frame.exposed is None else stamp - self._settings.latency)
        message = MESSAGE_MAKERS[self._settings.message](tracked, told, self._settings.accuracy)
        count.sent, count.age = count.sent + 1, count.age + now - time
        count.oldest = max(count.oldest, now - time)
        return [self._autopilot.encode(message, now)]

    def _is_next(self, number: int, count: _Count) -> bool:
        """Whether a frame is newer than the last one; what was left out is counted."""
        last, ahead = self._number, 1 if self._number is None else number - self._number
        if last is not None and -MAX_FRAMES_BACK < ahead <= 0:
            return False  # again, or late
        if 1 < ahead < MAX_FRAMES_BACK:
            count.missing += ahead - 1
        self._number = number
        return True

    def _exposure(self, frame: FrameReading, now: float) -> float:
        """Exposure time of a frame, on our clock [s]."""
        if frame.exposed is None or frame.transmitted is None:
            return now - self._settings.latency
        self._clocks.hear(frame.transmitted, now)
        self._autopilot.compare(frame.transmitted)
        time = self._clocks.ours(frame.exposed) - self._settings.latency
        return time if now - time < MAX_AGE else now - self._settings.latency

    def _body(self, frame: FrameReading) -> BodyReading | None:
        """The rigid body that was asked for."""
        wanted = self._settings.body
        if wanted == "":
            found = frame.bodies[0] if len(frame.bodies) == 1 else None
            missing = f"{len(frame.bodies)} rigid bodies are streamed: name one with --body"
        else:
            names = self._natnet.names
            number = wanted if isinstance(wanted, int) else None if names is None else names.get(wanted)
            found = next((body for body in frame.bodies if body.number == number), None)
            known = ", ".join(f"{name} ({number})" for name, number in (names or {}).items())
            missing = "" if names is None else f"no rigid body {wanted!r} is streamed; there are: {known or 'none'}"
        if found is not None:
            self._tell_body(found.number, frame.number)
        elif missing and missing != self._has_told_body:
            self._has_told_body = missing
            self._say(missing)
        return found

    def _is_due(self, time: float) -> bool:
        if time < self._due - EARLY:
            return False
        period = 1.0 / self._settings.rate
        self._due = max(self._due + period, time)
        return True

    def _lose(self) -> None:
        """Begin a new track with the next pose."""
        self._track.lose()
        self._was_held = False

    # What is told

    def _say(self, text: str) -> None:
        self.said.append(printable(text))

    def _tell_server(self) -> None:
        server = self._natnet.server
        if server is None:
            return
        way = f"multicast {server.group}:{server.data_port}" if server.group else "unicast"
        line = f"{server.name} {server.application}, NatNet {'.'.join(map(str, server.version))}, {way}"
        if not is_readable(server.version):
            line += ": this bit-stream cannot be read, 3.0 to 4.x can"
        if line != self._has_told_server:
            self._has_told_server = line
            self._say(line)

    def _tell_body(self, number: int, frame: int) -> None:
        """Name the body and the rate of its frames, once both are known."""
        if self._natnet.names is None or self._first_frame is None or frame - self._first_frame[0] < RATED_FRAMES:
            return
        if self._has_told_body != str(number):
            self._has_told_body = str(number)
            names = {number: name for name, number in self._natnet.names.items()}
            rate = (frame - self._first_frame[0]) / max(self._stamp - self._first_frame[1], 1e-6)
            self._say(f"rigid body {names.get(number, 'without a name')} ({number}), {rate:.0f} Hz")

    def _tell_streaming(self, *, streaming: bool) -> None:
        if streaming == self._was_streaming:
            return
        self._was_streaming = streaming
        if not streaming:
            self._lose()
            self._number = self._first_frame = None
        self._say("frames arrive" if streaming else "no frames from the NatNet server: no poses are sent")

    def _tell_tracked(self, *, tracked: bool) -> None:
        if tracked != self._was_tracked:
            self._was_tracked = tracked
            self._say("tracking" if tracked else "tracking lost: nothing is sent")

    def _tell_held(self) -> None:
        if self._track.is_held != self._was_held:
            self._was_held = self._track.is_held
            self._say(JUMPED if self._was_held else "the rigid body is back: poses are sent again")

    def _statistics(self, count: _Count, now: float) -> str:
        elapsed = now - count.began
        damaged = self._natnet.damaged - count.damaged
        troubles = (
            ("missing", count.missing),
            ("not tracked", count.lost),
            ("held back", count.held),
            ("damaged", damaged),
        )
        told = [f"{number} {name}" for name, number in troubles if number]
        if count.sent:
            told.append(f"age {1e3 * count.age / count.sent:.1f} ms, at most {1e3 * count.oldest:.1f} ms")
        frames = f"{count.frames} frames in {elapsed:.1f} s ({count.frames / elapsed:.1f} Hz)"
        return ", ".join((frames, f"{count.sent} sent by the {self._autopilot.clock} clock", *told))
