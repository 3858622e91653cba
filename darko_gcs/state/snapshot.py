"""All the ground station knows at one moment, as immutable values. None means "never received"."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

from darko_gcs.state.flight_plan_state import FlightPlanState
from darko_gcs.state.parameters import ParameterChange, ParameterMetadata
from darko_gcs.state.values import (
    AIRBORNE_STATES,
    ALL_PLANS,
    FENCE,
    MISSION,
    RALLY,
    Actuators,
    Air,
    Decision,
    Doubt,
    Energy,
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
    Truth,
)
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Saturation
from protocol.events import CommandProgress
from protocol.frames import Geodetic, LocalFrame, Quaternion, Vector
from protocol.names import Mode, law_label
from protocol.plans import MissionItem
from protocol.wire.message import Source

TAIL_SITTERS = frozenset(
    {
        mavlink.MAV_TYPE_VTOL_DUOROTOR,
        mavlink.MAV_TYPE_VTOL_QUADROTOR,
        mavlink.MAV_TYPE_VTOL_RESERVED3,  # MAV_TYPE_VTOL_TAILSITTER since 2021
    }
)
NOSE_FORWARD_STATES = frozenset({mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC, mavlink.MAV_VTOL_STATE_FW})


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """State that the screens show. Angles are in radians, all else in SI units.

    Positions are NED in the vehicle's local frame. Those of a vehicle that tells only its place on the globe are from
    its first place (``start``), at the height of its home.
    """

    source: Source | None = None  # (system, component) of the vehicle
    autopilot: int = 0  # MAV_AUTOPILOT
    capabilities: int = 0  # MAV_PROTOCOL_CAPABILITY
    kind: int = 0  # MAV_TYPE
    armed: bool | None = None
    mode: str | None = None
    heartbeat_at: float | None = None  # arrival of the last HEARTBEAT, on the caller's clock [s]
    lost: bool = False
    critical: bool = False  # a failsafe of the vehicle reports a critical state
    landed_state: int = 0  # MAV_LANDED_STATE
    vtol_state: int = 0  # MAV_VTOL_STATE
    boot: float | None = None  # vehicle's time since boot [s]
    late_messages: int = 0  # messages in a row whose time since boot was long before ``boot``
    restarts: int = 0  # restarts of the vehicle seen so far
    arrivals: Mapping[str, float] = field(default_factory=dict)  # of the last message of each kind, caller's clock [s]

    q: Quaternion | None = None  # FRD -> NED, x along the nose
    q_time: float | None = None  # vehicle's time of a quaternion on the wire [s]
    repr_offset: Quaternion | None = None  # what the vehicle wants shown: q * repr_offset
    p: Vector | None = None  # NED [m]
    p_time: float | None = None  # vehicle's time of position and velocity [s]
    v: Vector | None = None  # NED [m/s]
    target: Vector | None = None  # NED [m]
    target_place: Geodetic | None = None  # of vehicles that tell it so
    geodetic: Geodetic | None = None
    relative_altitude: float | None = None  # [m]
    start: Geodetic | None = None  # zero of the map, of a vehicle that tells its place on the globe alone
    origin: Geodetic | None = None  # zero of the vehicle's local frame, where it tells it
    home: Geodetic | None = None
    told_home_p: Vector = (0.0, 0.0, 0.0)  # in the vehicle's local frame, NED [m]
    airspeed: float | None = None  # [m/s]
    ground_speed: float | None = None  # [m/s]
    throttle: float | None = None  # 0..1
    wind: Vector | None = None  # velocity of the air, NED [m/s]
    heading: float | None = None  # [rad]
    air: Air | None = None
    truth: Truth | None = None  # sent only while it is asked for
    doubt: Doubt | None = None  # None of a vehicle that estimates nothing
    test_ratio: float | None = None  # worst of the filter's readings; above 1 one is refused
    navigation: Navigation | None = None
    decision: Decision | None = None

    hybrid: HybridState | None = None
    law_since: float | None = None  # vehicle's time of the last change of law [s]
    parameters: Mapping[str, float] = field(default_factory=dict)
    parameter_count: int | None = None  # in the vehicle's table
    parameter_types: Mapping[str, int] = field(default_factory=dict)  # MAV_PARAM_TYPE
    parameter_changes: Mapping[str, ParameterChange] = field(default_factory=dict)  # that this operator asked for
    parameter_metadata: Mapping[str, ParameterMetadata] = field(default_factory=dict)
    v_history: tuple[tuple[float, float, float], ...] = ()  # (vehicle's time [s], V hover, V forward)
    jumps: tuple[Jump, ...] = ()
    actuators: Actuators | None = None
    saturated_at: Mapping[Saturation, float] = field(default_factory=dict)  # last time of each axis, vehicle's time [s]
    energy: Energy | None = None
    servos: tuple[int, ...] = ()  # pulses of the outputs [us]; 0: not driven
    system_voltage: float | None = None  # of SYS_STATUS, for vehicles without BATTERY_STATUS [V]
    system_current: float | None = None  # of SYS_STATUS [A]
    system_battery: float | None = None  # of SYS_STATUS: charge left, 0..1
    voltage: float | None = None  # of BATTERY_STATUS [V]
    current: float | None = None  # [A]
    battery: float | None = None  # of BATTERY_STATUS: charge left, 0..1
    prearm_ok: bool | None = None
    in_control: int = 0  # system id of the ground station in control; 0: every station may command
    takeover_allowed: bool = False  # the station in control lets others take over
    control_asked_by: int = 0  # system id of another station that asked this one for control; 0: none

    track: tuple[tuple[float, float], ...] = ()  # (north, east) [m]
    mission: tuple[MissionItem, ...] = ()  # as uploaded or downloaded
    fence: tuple[MissionItem, ...] = ()
    rally: tuple[MissionItem, ...] = ()
    plan_ids: PlanIds | None = None
    leg_predictions: Mapping[LegChain, tuple[LegPrediction, ...]] = field(default_factory=dict)  # that were asked for
    mission_count: int | None = None
    mission_current: int | None = None
    mission_state: int = 0  # MISSION_STATE
    reached: frozenset[int] = frozenset()  # mission items
    transfer: tuple[str, int, int] | None = None  # direction, items done, items in total

    flight_plan: FlightPlanState | None = None  # that the vehicle has loaded

    asked: Mapping[int, str] = field(default_factory=dict)  # what this operator asked for, by request, until answered
    in_progress: CommandProgress | None = None  # the command that the vehicle is executing

    messages: tuple[LogLine, ...] = ()
    open_text: OpenText | None = None  # its next chunk continues the last line
    received: int = 0  # messages
    rate: float = math.nan  # messages per second
    loss: float = 0.0  # share of frames lost, 0..1
    unrecorded: bool = False  # the recording failed, or could not begin
    is_replay: bool = False  # of a recorded flight
    sends_to: str = ""  # where a replay sends its frames to; empty: nowhere
    simulator: Simulator = Simulator.NONE  # the vehicle process that we started
    signing: SigningState = SigningState.PRIVATE
    refused: int = 0  # frames dropped because their signature was missing or wrong

    @property
    def is_airborne(self) -> bool:
        """True in flight, also during take-off and landing."""
        return self.landed_state in AIRBORNE_STATES

    @property
    def charge_left(self) -> float | None:
        """Charge of the battery left, 0..1."""
        return self.system_battery if self.battery is None else self.battery

    @property
    def battery_voltage(self) -> float | None:
        """Voltage of the battery [V]."""
        return self.system_voltage if self.voltage is None else self.voltage

    @property
    def battery_power(self) -> float | None:
        """Power drawn from the battery [W]."""
        current = self.system_current if self.current is None else self.current
        return None if current is None or self.battery_voltage is None else current * self.battery_voltage

    @property
    def goal(self) -> Vector | None:
        """Present target of the vehicle, NED [m], in whichever way it tells so."""
        if self.target is not None:
            return self.from_vehicle_frame(self.target)
        return None if self.target_place is None else self._local_by_own_place(self.target_place)

    @property
    def home_p(self) -> Vector:
        """Home, NED [m]."""
        if self.start is None:
            return self.told_home_p
        return (0.0, 0.0, 0.0) if self.home is None else (*_level(self.start, self.home), 0.0)

    def from_vehicle_frame(self, p: Vector) -> Vector | None:
        """A position in the vehicle's local frame, NED [m]; None if nobody has told where that frame lies."""
        if self.start is None:
            return p
        if self.origin is None:
            return None
        north, east = _level(self.start, self.origin)
        return p[0] + north, p[1] + east, p[2] + (0.0 if self.home is None else self.home.alt - self.origin.alt)

    def _local_by_own_place(self, place: Geodetic) -> Vector | None:
        """A place in the local frame [m], from where the vehicle is in both: ArduPilot's origin need not be home."""
        if self.p is None or self.geodetic is None:
            return self.local(place)
        north, east, down = LocalFrame(self.geodetic).to_ned(place)
        return north + self.p[0], east + self.p[1], down + self.p[2]

    @property
    def from_home(self) -> Vector | None:
        """Position of the vehicle, NED from home [m]."""
        if self.p is None:
            return None
        return self.p[0] - self.home_p[0], self.p[1] - self.home_p[1], self.p[2] - self.home_p[2]

    def local(self, place: Geodetic) -> Vector | None:
        """A geodetic place, NED [m]; None until home is known, or the vehicle's own place."""
        if self.start is not None:
            return *_level(self.start, place), (0.0 if self.home is None else self.home.alt - place.alt)
        if self.home is None:
            return None
        north, east, down = LocalFrame(self.home).to_ned(place)
        return north + self.home_p[0], east + self.home_p[1], down + self.home_p[2]

    @property
    def is_forward(self) -> bool:
        """True in forward flight, until the back transition ends: it switches once per transition, at its end."""
        return self.vtol_state in NOSE_FORWARD_STATES

    @property
    def tells_hover_frame(self) -> bool:
        """True if attitudes on the wire are of the hover frame: of a tail-sitter that is not an ArduPilot."""
        return self.kind in TAIL_SITTERS and self.autopilot != mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA

    @property
    def flies_plan(self) -> bool:
        """True while the vehicle flies its flight plan."""
        return self.flight_plan is not None and self.mode == Mode.FLIGHT_PLAN.name

    @property
    def crashed(self) -> bool:
        """True after the vehicle hit the ground too fast, until it is rebooted."""
        return self.hybrid is not None and self.hybrid.law == Law.CRASHED

    @property
    def law(self) -> str | None:
        """Label of the law in force."""
        return None if self.hybrid is None else law_label(self.hybrid.law)

    def age(self, now: float) -> float | None:
        """Time since the last HEARTBEAT [s]."""
        return None if self.heartbeat_at is None else max(0.0, now - self.heartbeat_at)

    def silence(self, now: float, kinds: Iterable[str]) -> float | None:
        """Time since the last message of some kinds [s]; None if there was none."""
        heard = [self.arrivals[kind] for kind in kinds if kind in self.arrivals]
        return max(0.0, now - max(heard)) if heard else None


def _level(start: Geodetic, place: Geodetic) -> tuple[float, float]:
    """North and east of a start [m]."""
    return LocalFrame(start).to_ned(place)[:2]


EMPTY_SNAPSHOT = Snapshot()
_NAMES = frozenset(one.name for one in fields(Snapshot))

if TYPE_CHECKING:
    from dataclasses import replace

    updated = replace
else:

    def updated(s: Snapshot, /, **values: object) -> Snapshot:
        """``dataclasses.replace`` of a snapshot, which takes twenty times as long over its many fields.

        Raises:
            TypeError: A snapshot has no such field.
        """
        if not _NAMES.issuperset(values):
            raise TypeError(f"a snapshot has no {', '.join(sorted(values.keys() - _NAMES))}")
        new = object.__new__(Snapshot)
        new.__dict__.update(s.__dict__, **values)
        return new


def plan_of(s: Snapshot, plan_type: int) -> Items | None:
    """The vehicle's plan of one MAV_MISSION_TYPE; None for another type."""
    return {MISSION: s.mission, FENCE: s.fence, RALLY: s.rally}.get(plan_type)


def with_plan(s: Snapshot, plan_type: int, items: Items) -> Snapshot:
    """The snapshot with another plan of a MAV_MISSION_TYPE; with ALL_PLANS, of all three types."""
    if plan_type in {MISSION, ALL_PLANS}:
        s = updated(s, mission=items)
    if plan_type in {FENCE, ALL_PLANS}:
        s = updated(s, fence=items)
    if plan_type in {RALLY, ALL_PLANS}:
        s = updated(s, rally=items)
    return s
