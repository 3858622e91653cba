"""The parts of a snapshot, each about one subject, as immutable values. None means "never received".

Angles are in radians, all else in SI units. Positions are NED in the vehicle's local frame. Those of a vehicle that
tells only its place on the globe are from its first place (``start``), at the height of its home. No mapping is ever
changed in place, so that snapshots share the empty ones.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from darko_gcs.state.parameters import ParameterChange, ParameterMetadata
from darko_gcs.state.values import (
    AIRBORNE_STATES,
    ALL_PLANS,
    FENCE,
    MISSION,
    RALLY,
    Actuators,
    Air,
    Alert,
    Decision,
    Doubt,
    Energy,
    FlownLeg,
    HybridState,
    Items,
    Jump,
    LegChain,
    LegPrediction,
    LogLine,
    Navigation,
    OpenText,
    PlanIds,
    SigningState,
    Simulator,
    SpeedOrder,
    Truth,
)
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Saturation
from protocol.events import CommandProgress
from protocol.frames import Geodetic, LocalFrame, Quaternion, Vector
from protocol.names import law_label
from protocol.tools.option_values import GROUND_SYSTEM
from protocol.wire.message import Source

TAIL_SITTERS = frozenset(
    {
        mavlink.MAV_TYPE_VTOL_DUOROTOR,
        mavlink.MAV_TYPE_VTOL_QUADROTOR,
        mavlink.MAV_TYPE_VTOL_RESERVED3,  # MAV_TYPE_VTOL_TAILSITTER since 2021
    }
)
NOSE_FORWARD_STATES = frozenset({mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC, mavlink.MAV_VTOL_STATE_FW})


class Identity(NamedTuple):
    """Identity of the vehicle."""

    source: Source | None = None  # (system, component)
    autopilot: int = 0  # MAV_AUTOPILOT
    capabilities: int = 0  # MAV_PROTOCOL_CAPABILITY
    kind: int = 0  # MAV_TYPE

    @property
    def tells_hover_frame(self) -> bool:
        """True if attitudes on the wire are of the hover frame: of a tail-sitter that is not an ArduPilot."""
        return self.kind in TAIL_SITTERS and self.autopilot != mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA


class VehicleStatus(NamedTuple):
    """Mode and state of the vehicle."""

    armed: bool | None = None
    mode: str | None = None
    critical: bool = False  # a failsafe of the vehicle reports a critical state
    prearm_ok: bool | None = None
    unhealthy: int = 0  # MAV_SYS_STATUS_SENSOR that are there, enabled, and do not work
    has_measured_air: bool | None = None  # its airspeed is a pitot tube's; None: not told
    landed_state: int = 0  # MAV_LANDED_STATE
    vtol_state: int = 0  # MAV_VTOL_STATE

    @property
    def is_airborne(self) -> bool:
        """True in flight, also during take-off and landing."""
        return self.landed_state in AIRBORNE_STATES

    @property
    def is_forward(self) -> bool:
        """True in forward flight, until the back transition ends: it switches once per transition, at its end."""
        return self.vtol_state in NOSE_FORWARD_STATES


class LinkStatus(NamedTuple):
    """Arrivals from the vehicle; times are on the caller's clock, if not said otherwise."""

    heartbeat_at: float | None = None  # arrival of the last HEARTBEAT [s]
    lost: bool = False
    boot: float | None = None  # vehicle's time since boot [s]
    late_messages: int = 0  # messages in a row whose time since boot was long before ``boot``
    restarts: int = 0  # restarts of the vehicle seen so far
    arrivals: Mapping[str, float] = {}  # of the last message of each kind [s]
    received: int = 0  # messages
    rate: float = math.nan  # messages per second
    loss: float = 0.0  # share of frames lost, 0..1
    signing: SigningState = SigningState.PRIVATE
    refused: int = 0  # frames dropped because their signature was missing or wrong

    def age(self, now: float) -> float | None:
        """Time since the last HEARTBEAT [s]."""
        return None if self.heartbeat_at is None else max(0.0, now - self.heartbeat_at)

    def silence(self, now: float, kinds: Iterable[str]) -> float | None:
        """Time since the last message of some kinds [s]; None if there was none."""
        heard = [self.arrivals[kind] for kind in kinds if kind in self.arrivals]
        return max(0.0, now - max(heard)) if heard else None


class SessionStatus(NamedTuple):
    """This ground station beside its link."""

    own_system: int = GROUND_SYSTEM  # system id of this ground station
    unrecorded: bool = False  # the recording failed, or could not begin
    is_replay: bool = False  # of a recorded flight
    sends_to: str = ""  # where a replay sends its frames to; empty: nowhere
    vehicles: int = 1  # on the link
    simulator: Simulator = Simulator.NONE  # the vehicle process that we started
    simulator_since: float = 0.0  # when it got into this state, on the caller's clock [s]
    simulation_speed: float = 1.0  # that it was asked for, times real time
    port: int = 0  # UDP port that vehicles are awaited on; 0: none
    alerts: tuple[Alert, ...] = ()  # that the pilot has not said to have seen
    seen: tuple[Alert, ...] = ()  # by the pilot, of failures that last


class Attitude(NamedTuple):
    """Attitude of the vehicle."""

    q: Quaternion | None = None  # FRD -> NED, x along the nose
    time: float | None = None  # vehicle's time of a quaternion on the wire [s]
    repr_offset: Quaternion | None = None  # what the vehicle wants shown: q * repr_offset
    heading: float | None = None  # [rad]


class Position(NamedTuple):
    """Place and velocity of the vehicle, and the frame that they are in."""

    p: Vector | None = None  # NED [m]
    near: Vector | None = None  # whole metres near p: a hover between two stays at either, NED [m]
    v: Vector | None = None  # NED [m/s]
    time: float | None = None  # vehicle's time of p and v [s]
    geodetic: Geodetic | None = None
    relative_altitude: float | None = None  # [m]
    ground_speed: float | None = None  # [m/s]
    track: tuple[tuple[float, float], ...] = ()  # (north, east) [m]
    start: Geodetic | None = None  # zero of the map, of a vehicle that tells its place on the globe alone
    origin: Geodetic | None = None  # zero of the vehicle's local frame, where it tells it
    home: Geodetic | None = None
    told_home_p: Vector = (0.0, 0.0, 0.0)  # in the vehicle's local frame, NED [m]

    @property
    def home_p(self) -> Vector:
        """Home, NED [m]."""
        if self.start is None:
            return self.told_home_p
        return (0.0, 0.0, 0.0) if self.home is None else (*_level(self.start, self.home), 0.0)

    @property
    def from_home(self) -> Vector | None:
        """Position of the vehicle, NED from home [m]."""
        if self.p is None:
            return None
        return self.p[0] - self.home_p[0], self.p[1] - self.home_p[1], self.p[2] - self.home_p[2]

    def from_vehicle_frame(self, p: Vector) -> Vector | None:
        """A position in the vehicle's local frame, NED [m]; None if nobody has told where that frame lies."""
        if self.start is None:
            return p
        if self.origin is None:
            return None
        north, east = _level(self.start, self.origin)
        return p[0] + north, p[1] + east, p[2] + (0.0 if self.home is None else self.home.alt - self.origin.alt)

    def local(self, place: Geodetic) -> Vector | None:
        """A geodetic place, NED [m]; None until home is known, or the vehicle's own place."""
        if self.start is not None:
            return *_level(self.start, place), (0.0 if self.home is None else self.home.alt - place.alt)
        if self.home is None:
            return None
        north, east, down = LocalFrame(self.home).to_ned(place)
        return north + self.home_p[0], east + self.home_p[1], down + self.home_p[2]

    def local_by_own_place(self, place: Geodetic) -> Vector | None:
        """A place in the local frame [m], from where the vehicle is in both: ArduPilot's origin need not be home."""
        if self.p is None or self.geodetic is None:
            return self.local(place)
        north, east, down = LocalFrame(self.geodetic).to_ned(place)
        return north + self.p[0], east + self.p[1], down + self.p[2]


def _level(start: Geodetic, place: Geodetic) -> tuple[float, float]:
    """North and east of a start [m]."""
    return LocalFrame(start).to_ned(place)[:2]


UNOBSERVED_WIND = 1.5  # standard deviation from which on a wind is only a guess [m/s]


class Estimates(NamedTuple):
    """Air, and the navigation filter's own errors."""

    airspeed: float | None = None  # [m/s]
    wind: Vector | None = None  # velocity of the air, NED [m/s]
    wind_deviation: float | None = None  # standard deviation of it, level [m/s]
    air: Air | None = None
    truth: Truth | None = None  # sent only while it is asked for
    doubt: Doubt | None = None  # None of a vehicle that estimates nothing
    test_ratio: float | None = None  # worst of the filter's readings; above 1 one is refused
    worst_reading: str = ""  # that it is of
    is_place_lost: bool = False  # nothing tells north and east: they are dead reckoning

    @property
    def is_wind_unobserved(self) -> bool:
        """True while the vehicle itself hardly knows the wind: a hover does not tell it."""
        return self.wind_deviation is not None and self.wind_deviation >= UNOBSERVED_WIND


class GuidanceStatus(NamedTuple):
    """Target of the vehicle, and the choice by which it flies there."""

    target: Vector | None = None  # in the vehicle's local frame, NED [m]
    target_place: Geodetic | None = None  # of vehicles that tell it so
    navigation: Navigation | None = None
    decision: Decision | None = None


class HybridAutomaton(NamedTuple):
    """Law in force, Lyapunov values, jumps."""

    state: HybridState | None = None
    law_since: float | None = None  # vehicle's time of the last change of law [s]
    v_history: tuple[tuple[float, float, float], ...] = ()  # (vehicle's time [s], V hover, V forward)
    jumps: tuple[Jump, ...] = ()

    @property
    def law(self) -> str | None:
        """Label of the law in force."""
        return None if self.state is None else law_label(self.state.law)

    @property
    def crashed(self) -> bool:
        """True after the vehicle hit the ground too fast, until it is rebooted."""
        return self.state is not None and self.state.law == Law.CRASHED


class Actuation(NamedTuple):
    """Motors, elevons and other outputs."""

    actuators: Actuators | None = None
    saturated_at: Mapping[Saturation, float] = {}  # last time of each axis, vehicle's time [s]
    servos: tuple[int, ...] = ()  # pulses of the outputs [us]; 0: not driven
    throttle: float | None = None  # 0..1


class BatteryReading(NamedTuple):
    """Of one message about the battery."""

    voltage: float | None = None  # [V]
    current: float | None = None  # [A]
    charge_left: float | None = None  # 0..1


class Battery(NamedTuple):
    """Battery and energy."""

    system_status: BatteryReading = BatteryReading()  # of SYS_STATUS, for vehicles without BATTERY_STATUS
    battery_status: BatteryReading = BatteryReading()  # of BATTERY_STATUS
    energy: Energy | None = None

    @property
    def charge_left(self) -> float | None:
        """Charge of the battery left, 0..1."""
        told = self.battery_status.charge_left
        return self.system_status.charge_left if told is None else told

    @property
    def voltage(self) -> float | None:
        """Voltage of the battery [V]."""
        told = self.battery_status.voltage
        return self.system_status.voltage if told is None else told

    @property
    def power(self) -> float | None:
        """Power drawn from the battery [W]."""
        told = self.battery_status.current
        current = self.system_status.current if told is None else told
        return None if current is None or self.voltage is None else current * self.voltage


class ParameterTable(NamedTuple):
    """The vehicle's parameters, each mapping by name."""

    values: Mapping[str, float] = {}
    total: int | None = None  # in the vehicle's table
    types: Mapping[str, int] = {}  # MAV_PARAM_TYPE
    changes: Mapping[str, ParameterChange] = {}  # that this operator asked for
    metadata: Mapping[str, ParameterMetadata] = {}


class VehiclePlans(NamedTuple):
    """The vehicle's plans, as uploaded or downloaded."""

    mission: Items = ()
    fence: Items = ()
    rally: Items = ()
    transfer: tuple[str, int, int] | None = None  # direction, items done, items in total

    def of_type(self, plan_type: int) -> Items | None:
        """The plan of one MAV_MISSION_TYPE; None for another type."""
        return {MISSION: self.mission, FENCE: self.fence, RALLY: self.rally}.get(plan_type)

    def with_plan(self, plan_type: int, items: Items) -> VehiclePlans:
        """With another plan of a MAV_MISSION_TYPE; with ALL_PLANS, of all three types."""
        changed = {plan_type} if plan_type != ALL_PLANS else {MISSION, FENCE, RALLY}
        return self._replace(
            mission=items if MISSION in changed else self.mission,
            fence=items if FENCE in changed else self.fence,
            rally=items if RALLY in changed else self.rally,
        )


class MissionStatus(NamedTuple):
    """Progress of the vehicle in its mission."""

    total: int | None = None  # items
    current: int | None = None  # item
    state: int = 0  # MISSION_STATE
    reached: frozenset[int] = frozenset()  # items
    plan_ids: PlanIds | None = None
    leg_predictions: Mapping[LegChain, tuple[LegPrediction, ...]] = {}  # that were asked for
    began: tuple[float, float] | None = None  # vehicle's time [s], and energy used until then [J]
    flown: Mapping[int, FlownLeg] = {}  # by the item at the end of each leg


class OperatorStatus(NamedTuple):
    """Requests of this operator, and who is in control of the vehicle."""

    asked: Mapping[int, str] = {}  # what this operator asked for, by request, until answered; in a replay by MAV_CMD
    take_off_height: float | None = None  # above home, that this operator asked for last [m]
    speed_asked: SpeedOrder | None = None  # not yet answered
    speed_order: SpeedOrder | None = None  # the last one that was accepted, until another flight is commanded
    point_asked: Vector | None = None  # from home, that the vehicle was sent to; not yet answered [m]
    point_flown_to: Vector | None = None  # from home, that it accepted, until it is there or flies otherwise [m]
    in_progress: CommandProgress | None = None  # the command that the vehicle is executing
    in_control: int = 0  # system id of the ground station in control; 0: every station may command
    takeover_allowed: bool = False  # the station in control lets others take over
    control_asked_by: int = 0  # system id of another station that asked this one for control; 0: none


class MessageLog(NamedTuple):
    """Lines for the operator."""

    lines: tuple[LogLine, ...] = ()
    open_text: OpenText | None = None  # its next chunk continues the last line
