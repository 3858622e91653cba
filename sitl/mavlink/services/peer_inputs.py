"""Inputs of peers beside commands: signing keys, traffic, sticks and set-points, obstacles, poses."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from protocol import units
from protocol.dialect import mavlink
from protocol.events import PoseReceived, SetpointReceived, SigningChanged
from protocol.frames import (
    ATTITUDE_VARIANCES,
    POSITION_VARIANCES,
    flip,
    flip_quaternion,
    flying_attitude,
    flying_axes,
    quaternion_from_euler,
)
from protocol.names import ABSOLUTE_ALTITUDE_FRAMES, BODY_FRAMES, OFFSET_FRAMES
from protocol.plans.plan import Refusal
from protocol.ranges import ALTITUDE, STICK_SCALE, UNUSED_AXIS, message_flaw
from protocol.tools.timing import ClockMatch
from protocol.wire.message import Message, Peer, source_of
from protocol.wire.signing import Keyring, KeyState, Verdict
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.manual import Sticks
from sitl.autopilot.path_watch import scan_of
from sitl.autopilot.world import POSITION_FRAMES
from sitl.control.reference import AttitudeReference, Point
from sitl.guidance.setpoints import KEEP_HEADING, MIN_THRUST, HeadingSetpoint
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.handlers import on_event, on_message
from sitl.model.quaternions import Quaternion
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.simulation.avionics import Navigation
from sitl.vehicle.aircraft import Aircraft

# Decoding of streamed set-points; docs/clients.md has the table of those that are flown and those that are refused.
#
# https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED
# https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_GLOBAL_INT
# https://mavlink.io/en/messages/common.html#SET_ATTITUDE_TARGET


# POSITION_TARGET_TYPEMASK
IGNORE_POSITION = 0b0000_0000_0000_0111
IGNORE_VELOCITY = 0b0000_0000_0011_1000
IGNORE_ACCELERATION = 0b0000_0001_1100_0000
IS_FORCE = mavlink.POSITION_TARGET_TYPEMASK_FORCE_SET
IGNORE_YAW = mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE
IGNORE_YAW_RATE = mavlink.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE

# ATTITUDE_TARGET_TYPEMASK
IGNORE_RATES = (
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE,
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE,
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE,
)
RATE_FIELDS = ("body_roll_rate", "body_pitch_rate", "body_yaw_rate")
THRUST_BODY = 0b0010_0000  # THRUST_BODY_SET, newer than the generator's definitions
IGNORE_THRUST = mavlink.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE
IGNORE_ATTITUDE = mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE

DIRECTION_FRAMES = BODY_FRAMES | {mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_OFFSET_NED}


def take_setpoint(autopilot: Autopilot, message: Message) -> str | None:
    """Hand a set-point to the autopilot. Returns why it was refused, or None."""
    if message.get_type() == "SET_ATTITUDE_TARGET":
        return _take_attitude(autopilot, message)
    if message.get_type() == "SET_ACTUATOR_CONTROL_TARGET":
        return "motors and elevons follow the control laws only"
    return _take_position_or_motion(autopilot, message)


def _take_position_or_motion(autopilot: Autopilot, message: Message) -> str | None:
    mask = message.type_mask
    if flaw := _flaw(message, _heading_fields(mask)):
        return flaw
    heading = _heading(message)
    if not mask & IGNORE_POSITION:  # velocity and acceleration beside a position are a feed-forward, which is not used
        return _take_position(autopilot, message, heading)
    if mask & IGNORE_POSITION != IGNORE_POSITION:
        return "a set-point with part of a position is not flown"
    if not mask & IGNORE_VELOCITY:
        v = _direction(autopilot, message, ("vx", "vy", "vz"))
        return v.text if isinstance(v, Refusal) else autopilot.offboard.set_velocity(v, heading)
    if mask & IGNORE_VELOCITY != IGNORE_VELOCITY:
        return "a set-point with part of a velocity is not flown"
    if mask & IGNORE_ACCELERATION or mask & IS_FORCE:
        return "set-point without position, velocity or acceleration"
    a = _direction(autopilot, message, ("afx", "afy", "afz"))
    return a.text if isinstance(a, Refusal) else autopilot.offboard.set_acceleration(a, heading)


def _flaw(message: Message, fields: Iterable[str]) -> str:
    """The reason why a set-point cannot have the values of these fields; empty if it can."""
    return message_flaw(message.get_type(), {field: getattr(message, field) for field in fields})


def _heading_fields(mask: int) -> list[str]:
    """The fields of the heading that count."""
    yaw, rate = not mask & IGNORE_YAW, not mask & IGNORE_YAW_RATE
    return ["yaw"] * yaw + ["yaw_rate"] * rate


def _heading(message: Message) -> HeadingSetpoint:
    """The heading or its rate. A NaN yaw asks for no heading."""
    if not message.type_mask & IGNORE_YAW and not math.isnan(message.yaw):
        return HeadingSetpoint(heading=-message.yaw)
    if message.type_mask & IGNORE_YAW_RATE or math.isnan(message.yaw_rate):
        return KEEP_HEADING
    return HeadingSetpoint(turn_rate=-message.yaw_rate)


def _take_position(autopilot: Autopilot, message: Message, heading: HeadingSetpoint) -> str | None:
    frame = message.coordinate_frame
    is_local = message.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
    if flaw := _flaw(message, ("x", "y", "z") if is_local else ("lat_int", "lon_int", "alt")):
        return flaw
    if is_local:
        p = flip((message.x, message.y, message.z))
        if frame in OFFSET_FRAMES:
            return autopilot.offboard.set_offset(p, heading, body=frame in BODY_FRAMES)
        if frame != mavlink.MAV_FRAME_LOCAL_NED:
            return _unsupported(frame)
        return autopilot.offboard.set_position(p, heading)
    if frame not in POSITION_FRAMES:
        return _unsupported(frame)
    world = autopilot.world
    up = world.up(message.alt, above_sea=frame in ABSOLUTE_ALTITUDE_FRAMES)
    p = world.local(units.from_e7(message.lat_int), units.from_e7(message.lon_int), up)
    return autopilot.offboard.set_position(p, heading)


def _direction(autopilot: Autopilot, message: Message, fields: tuple[str, str, str]) -> Point | Refusal:
    """A velocity or an acceleration in world NWU, or why it is invalid."""
    if flaw := _flaw(message, fields):
        return Refusal(flaw)
    first, second, third = (getattr(message, field) for field in fields)
    frame, v = message.coordinate_frame, flip((first, second, third))
    if message.get_type() == "SET_POSITION_TARGET_GLOBAL_INT":
        return v if frame in POSITION_FRAMES else Refusal(_unsupported(frame))
    if frame not in DIRECTION_FRAMES:
        return Refusal(_unsupported(frame))
    return autopilot.offboard.from_body(v) if frame in BODY_FRAMES else v


def _take_attitude(autopilot: Autopilot, message: Message) -> str | None:
    """An attitude in the hover frame, as ATTITUDE has it: attitudes are flown in hover only."""
    mask = message.type_mask
    if mask & IGNORE_ATTITUDE:
        return "body rates alone are not flown: send the attitude with them"
    if mask & IGNORE_THRUST or mask & THRUST_BODY:
        return "an attitude needs a thrust along the nose"
    used = [field for ignored, field in zip(IGNORE_RATES, RATE_FIELDS, strict=True) if not mask & ignored]
    parts = {f"q[{k}]": part for k, part in enumerate(message.q)} | {"thrust": message.thrust}
    if flaw := message_flaw(message.get_type(), parts | {field: getattr(message, field) for field in used}):
        return flaw
    wire = [getattr(message, field) for field in RATE_FIELDS]
    wanted = [0.0 if mask & ignored else rate for ignored, rate in zip(IGNORE_RATES, wire, strict=True)]
    attitude = Quaternion(*flip_quaternion(flying_attitude(message.q)))
    rates = Vector(*flip(flying_axes(wanted)))
    # Programs begin with no thrust, and drop the vehicle with none: that much keeps the elevons in a slipstream.
    return autopilot.offboard.set_attitude(AttitudeReference(attitude, rates, max(message.thrust, MIN_THRUST)))


def _unsupported(frame: int) -> str:
    entry = mavlink.enums["MAV_FRAME"].get(frame)
    name = "" if entry is None else f" ({str(entry.name).removeprefix('MAV_FRAME_')})"
    return f"set-point frame {frame} is not supported{name}"


DEAD_ZONE = 0.05  # share of an axis about its centre that counts as centred


def sticks_of(message: Message) -> Sticks | Refusal:
    """The sticks of a MANUAL_CONTROL, or the axis that is out of its range.

    x is forward, y to the right and r clockwise, -1000..1000; z is the throttle, 0..1000 with the centre at 500.
    """
    axes = {name: getattr(message, name) for name in "xyzr"}
    if flaw := message_flaw("MANUAL_CONTROL", axes):
        return Refusal(flaw)
    x, y, r = (0 if axes[name] == UNUSED_AXIS else axes[name] for name in "xyr")
    z = STICK_SCALE // 2 if axes["z"] == UNUSED_AXIS else axes["z"]
    return Sticks(
        forward=_without_dead_zone(x / STICK_SCALE),
        right=_without_dead_zone(y / STICK_SCALE),
        up=_without_dead_zone(2.0 * z / STICK_SCALE - 1.0),
        clockwise=_without_dead_zone(r / STICK_SCALE),
    )


def _without_dead_zone(value: float) -> float:
    return math.copysign(max(0.0, abs(value) - DEAD_ZONE) / (1.0 - DEAD_ZONE), value)


MAX_COORDINATE = 1e4  # from the origin, along each axis [m]
MAX_NORM_ERROR = 0.1  # a quaternion's norm differs from one by no more
NED_FRAMES = frozenset({mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_RESERVED_14})  # once MOCAP_NED, as of MAVSDK
ARENA_FRAMES = NED_FRAMES | {mavlink.MAV_FRAME_LOCAL_FRD}  # where no compass tells north, its forward is north
LOST_TRACK = -1  # ODOMETRY.quality


class ExternalPose(NamedTuple):
    """A measured pose."""

    position: Vector  # world NWU [m]
    attitude: Quaternion  # body FLU to world NWU
    position_variance: float | None  # of the worst axis [m2]; None: not told
    attitude_variance: float | None  # [rad2]
    time_stamp: float  # on the sender's clock [s]


def pose_of(message: Message, *, in_arena: bool = False) -> ExternalPose | Refusal:
    """The pose of a message, or why it is refused.

    Args:
        message: ODOMETRY, VISION_POSITION_ESTIMATE or ATT_POS_MOCAP.
        in_arena: Whether the vehicle flies by motion capture alone.
    """
    kind = message.get_type()
    if kind == "ODOMETRY" and (refusal := _refuse_odometry(message, ARENA_FRAMES if in_arena else NED_FRAMES)):
        return Refusal(refusal)
    angles = (message.roll, message.pitch, message.yaw) if kind == "VISION_POSITION_ESTIMATE" else ()
    place = (message.x, message.y, message.z)
    if not all(map(math.isfinite, (*place, *(angles or message.q)))):
        return Refusal("not a number")
    if max(map(abs, place)) > MAX_COORDINATE:
        return Refusal(f"more than {MAX_COORDINATE:g} m away")
    q = quaternion_from_euler(*angles) if angles else tuple(message.q)
    norm = math.hypot(*q)
    if abs(norm - 1.0) > MAX_NORM_ERROR:
        return Refusal(f"quaternion has norm {norm:.2f}, not 1")
    w, x, y, z = (part / norm for part in q)
    covariance = message.pose_covariance if kind == "ODOMETRY" else message.covariance
    return ExternalPose(
        Vector(*flip(place)),
        Quaternion(*flip_quaternion(flying_attitude((w, x, y, z)))),
        _variance(covariance, POSITION_VARIANCES),
        _variance(covariance, ATTITUDE_VARIANCES),
        (message.usec if kind == "VISION_POSITION_ESTIMATE" else message.time_usec) * 1e-6,
    )


def _refuse_odometry(message: Message, frames: frozenset[int]) -> str:
    """The reason why an ODOMETRY is not used; empty if it is."""
    if message.frame_id not in frames:
        return f"frame {message.frame_id} is not LOCAL_NED"
    return "its sender has lost track" if message.quality == LOST_TRACK else ""


def _variance(triangle: Sequence[float], diagonal: Sequence[int]) -> float | None:
    """The greatest variance on a part of the diagonal; None where the sender does not know it."""
    if not triangle or math.isnan(triangle[0]):
        return None
    worst = max(triangle[k] for k in diagonal)
    return worst if 0.0 < worst < math.inf else None


REPORT_INTERVAL = 30.0  # between two reports of refused frames: a flood of frames must not become one of texts [s]


class SigningService:
    """Reports changed keys at once and refused frames now and then.

    Args:
        keyring: Counts refused frames.
        broadcast: Tells everyone a text.
    """

    def __init__(self, keyring: Keyring, broadcast: Broadcast) -> None:
        self._keyring, self._broadcast = keyring, broadcast
        self._reported, self._next_report = 0, float("-inf")

    @on_event(SigningChanged)
    def announce(self, event: SigningChanged, _now: float) -> None:
        """A key was accepted, refused or has expired."""
        if event.state is KeyState.REFUSED:
            self._broadcast.complain(event.text)
        elif event.state is KeyState.EXPIRED:
            self._broadcast.warn(event.text)
        else:
            self._broadcast.info(event.text)

    def handle_timer(self, now: float) -> None:
        """Report refused frames if there are more of them and the last report is old enough.

        Args:
            now: The link's time [s].
        """
        refused = self._keyring.refused
        if refused == self._reported or now < self._next_report:
            return
        self._reported, self._next_report = refused, now + REPORT_INTERVAL
        counts = self._keyring.counts
        kinds = [verdict for verdict in Verdict if verdict.is_refused and verdict in counts]
        self._broadcast.warn("Messages refused so far: " + ", ".join(f"{counts[kind]} {kind.value}" for kind in kinds))


DEGREES, METRES, METRES_PER_SECOND = 1e-7, 1e-3, 1e-2  # of the integers on the wire
MAX_AIRCRAFT_SPEED = 300.0  # that is believed of an aircraft [m/s]


class TrafficService:
    """Keeps where other systems are.

    Args:
        autopilot: Whose plan may follow them.
    """

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot

    @on_message("FOLLOW_TARGET")
    def take_target(self, message: Message) -> None:
        """A system tells where it is, to be followed."""
        self._take(message, message.alt, message.vel)

    @on_message("GLOBAL_POSITION_INT")
    def take_position(self, message: Message) -> None:
        """An aircraft streams where it is."""
        velocity = [METRES_PER_SECOND * v for v in (message.vx, message.vy, message.vz)]
        self._take(message, METRES * message.alt, velocity)

    def _take(self, message: Message, altitude: float, velocity: Sequence[float]) -> None:
        lat, lon = DEGREES * message.lat, DEGREES * message.lon
        if abs(lat) > 90.0 or abs(lon) > 180.0 or not ALTITUDE.allows(altitude):
            return
        north, east, down = velocity if all(map(math.isfinite, velocity)) else (0.0, 0.0, 0.0)
        if math.hypot(north, east, down) > MAX_AIRCRAFT_SPEED:
            return
        world, now = self._autopilot.world, self._autopilot.view.time
        x, y, _ = world.local(lat, lon, 0.0)
        up = world.up(altitude, above_sea=True)
        self._autopilot.flight_plan.others.take(source_of(message)[0], now, (x, y, up), (north, -east, -down))


class SteeringService:
    """Hands set-points and sticks to the autopilot.

    Args:
        autopilot: Flies them.
        broadcast: Tells everyone a text.
        system: The vehicle's system id.
    """

    def __init__(self, autopilot: Autopilot, broadcast: Broadcast, system: int) -> None:
        self._autopilot, self._broadcast, self._system = autopilot, broadcast, system

    @on_event(SetpointReceived)
    def take_setpoint(self, event: SetpointReceived, _now: float) -> None:
        """A set-point of OFFBOARD."""
        reason = take_setpoint(self._autopilot, event.message)
        if reason is not None:
            self._broadcast.complain(f"Set-point refused: {reason}")

    @on_message("MANUAL_CONTROL")
    def take_sticks(self, message: Message) -> None:
        """A pilot's sticks."""
        if message.target not in {0, self._system}:
            return
        sticks = sticks_of(message)
        if isinstance(sticks, Refusal):
            self._broadcast.complain(f"Sticks refused: {sticks.text}")
        else:
            self._autopilot.manual.take_sticks(sticks)


UNUSED = 0xFFFF  # an element that says nothing
BY_HEADING = frozenset({mavlink.MAV_FRAME_BODY_FRD})
BY_NORTH = frozenset({mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_LOCAL_NED})


class ObstacleService:
    """Takes what sensors see about the vehicle.

    Args:
        autopilot: Stops before it.
        broadcast: Tells everyone why a message is refused.
    """

    def __init__(self, autopilot: Autopilot, broadcast: Broadcast) -> None:
        self._autopilot, self._broadcast = autopilot, broadcast

    @on_message("OBSTACLE_DISTANCE")
    def take_distances(self, message: Message) -> None:
        """Distances in directions round the vehicle."""
        if reason := self._hand_over(message):
            self._broadcast.complain(f"OBSTACLE_DISTANCE refused: {reason}")

    def _hand_over(self, message: Message) -> str:
        if message.frame not in BY_HEADING | BY_NORTH:
            return f"frame {message.frame} is not supported"
        step = message.increment_f if message.increment_f > 0.0 else float(message.increment)
        if not (0.0 < step <= 360.0 and math.isfinite(message.angle_offset)):
            return f"directions {step:g} deg apart from {message.angle_offset:g} deg"
        distances = [_metres(value, message.min_distance, message.max_distance) for value in message.distances]
        scan = scan_of(
            self._autopilot.view,
            distances,
            math.radians(message.angle_offset),
            math.radians(step),
            by_heading=message.frame in BY_HEADING,
        )
        source = (*source_of(message), message.sensor_type)
        return "" if self._autopilot.failsafes.obstacles.take(source, scan) else "too many sensors"


def _metres(value: int, nearest: int, farthest: int) -> float:
    """A distance of the message [cm] in metres; infinite where nothing was seen."""
    if value == UNUSED or value > farthest or value < nearest:
        return math.inf
    return 0.01 * value


MAX_AGE = 1.0  # a time stamp that is older by a clock is not of that clock [s]
STAMP_LEAD = 0.02  # a stamp may be ahead of the clock by so much: the link is looked at now and then [s]
TAKE_OVER_TIME = 1.0  # a source that is silent for so long is replaced by another [s]
CLOCK_WINDOW = 1.0  # in which the flight is at least once where it should be by the link's time [s]
MIN_POSE_DEVIATION = 0.001  # nobody measures better than that [m], [rad]


class PoseService:
    """Takes poses from one source at a time.

    Args:
        aircraft: Flies on them.
        broadcast: Tells everyone why poses are refused.
    """

    def __init__(self, aircraft: Aircraft, broadcast: Broadcast) -> None:
        self._aircraft, self._broadcast = aircraft, broadcast
        self._source: Peer | None = None
        self._heard = -math.inf  # the source, on the link's time [s]
        self._clocks = ClockMatch(CLOCK_WINDOW)  # of the flight, as the link's time sees it

    @on_event(PoseReceived)
    def take_pose(self, event: PoseReceived, now: float) -> None:
        """A peer sends where the vehicle is."""
        in_arena = self._aircraft.vehicle.avionics.navigation is Navigation.MOCAP
        pose = pose_of(event.message, in_arena=in_arena)
        refusal = self._refuse_source(event.peer, now)
        if not refusal:
            refusal = pose.text if isinstance(pose, Refusal) else self._hand_over(pose, now)
        if refusal:
            self._broadcast.complain(f"{event.message.get_type()} refused: {refusal}")

    def _refuse_source(self, peer: Peer, now: float) -> str:
        if not self._aircraft.vehicle.avionics.is_sensed:
            return "the vehicle flies on the exact state"
        if peer.component == mavlink.MAV_COMP_ID_AUTOPILOT1:
            return "it is of another vehicle"
        if self._source not in {None, peer} and now - self._heard < TAKE_OVER_TIME:
            return "poses come from another source"
        self._source, self._heard = peer, now
        return ""

    def _hand_over(self, pose: ExternalPose, now: float) -> str:
        """Give a pose to the filter; why not, if it cannot use it."""
        settings = self._aircraft.configuration.settings
        return self._aircraft.vehicle.avionics.receive_pose(
            pose.position,
            pose.attitude,
            _variance_or(pose.position_variance, settings.pose_position_noise),
            _variance_or(pose.attitude_variance, settings.pose_attitude_noise),
            age=round(self._age(pose.time_stamp, now) / PERIOD),
            period=self._aircraft.vehicle.periods,
        )

    def _age(self, stamp: float, now: float) -> float:
        """Age of a pose since it was measured, by the clock that its stamp is of [s].

        That is the vehicle's time since boot, or the link's, which TIMESYNC tells. A stamp of neither tells nothing.
        The vehicle flies in steps, the link's time passes between them: what counts is when a step has just ended.
        """
        self._clocks.hear(time := self._aircraft.vehicle.time, now)
        for flown in (stamp, self._clocks.theirs(stamp)):
            if -STAMP_LEAD <= time - flown < MAX_AGE:
                return max(time - flown, 0.0)
        return 1e-3 * self._aircraft.configuration.settings.pose_delay


def _variance_or(told: float | None, assumed: float) -> float:
    """Variance as the sender tells it, or as the settings assume it."""
    return max(assumed**2 if told is None else told, MIN_POSE_DEVIATION**2)
