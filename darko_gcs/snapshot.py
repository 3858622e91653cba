"""All the ground station knows at one moment, as immutable values. None means "never received"."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from darko_gcs.meanings import Meaning
from darko_gcs.signing import Signing
from darko_gcs.words import known, label
from protocol.codec import Source
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Limit, Regime, Saturation, Way
from protocol.events import CommandProgress
from protocol.frames import Geodetic, LocalFrame, Quaternion, Vector
from protocol.plans.mission import MissionItem

__all__ = [
    "EMPTY",
    "Actuators",
    "Air",
    "Decision",
    "Energy",
    "Hybrid",
    "Jump",
    "Line",
    "Navigation",
    "PlanIds",
    "Snapshot",
    "Thresholds",
    "counts_forward",
]

VTOL = {
    mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW: "to forward",
    mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC: "to hover",
    mavlink.MAV_VTOL_STATE_MC: "hover",
    mavlink.MAV_VTOL_STATE_FW: "forward",
}
NOSE_FORWARD = frozenset({mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC, mavlink.MAV_VTOL_STATE_FW})


class Line(NamedTuple):
    """One line of the message log."""

    time: float  # when it came [s], on the caller's clock
    severity: int  # MAV_SEVERITY, 0 worst to 7
    text: str


class OpenText(NamedTuple):
    """A STATUSTEXT in several chunks, of which more may come."""

    component: int
    number: int  # the text's, the same in all its chunks
    chunk: int  # the one that comes next
    line: Line  # with what came so far


class Jump(NamedTuple):
    """One jump of the vehicle's automaton."""

    time: float  # since boot [s]
    number: int
    source: int  # Law
    target: int  # Law
    reason: int  # Reason
    name: str
    v: float


class Thresholds(NamedTuple):
    """Values of V between which a linear law is kept once it flies."""

    enter: float
    leave: float


class Hybrid(NamedTuple):
    """DARKO_HYBRID_STATE. NaN is a Lyapunov value that is not defined now."""

    time: float  # since boot [s]
    law: int  # Law, or one that only a newer vehicle has
    jumps: int
    v_hover: float
    v_forward: float
    v_attitude: float  # [rad^2]
    hover: Thresholds  # of the linear hover law
    forward: Thresholds  # of the linear forward law
    governor: float  # share of the position error that it takes away, 0..1
    last_law: int  # Law before the last jump
    last_reason: int  # Reason of the last jump

    @property
    def is_forward(self) -> bool:
        """Whether V is that of the linear forward law."""
        return counts_forward(self.law)

    @property
    def v(self) -> float:
        """The Lyapunov value that the next jump depends on."""
        law = known(Law, self.law)
        if law is None:
            return math.nan
        if law is Law.HOVER_ATTITUDE:
            return self.v_attitude
        return self.v_forward if self.is_forward else self.v_hover


def counts_forward(law: int) -> bool:
    """Whether V under a law is that of the linear forward law: in forward flight and on the way there."""
    flown = known(Law, law)
    return flown is not None and flown.regime in {Regime.FRONT_TRANSITION, Regime.FORWARD}


class Actuators(NamedTuple):
    """DARKO_ACTUATORS; left, right."""

    motor: tuple[float, float]  # [rad/s]
    motor_command: tuple[float, float]
    thrust: tuple[float, float]  # [N]
    elevon: tuple[float, float]  # [rad]
    elevon_command: tuple[float, float]
    motor_min: float
    motor_max: float
    elevon_max: float
    limits: Limit
    saturation: Saturation = Saturation(0)


class Energy(NamedTuple):
    """DARKO_ENERGY."""

    power: float  # [W]
    total: float  # [J]
    by_law: tuple[float, ...]  # index is Law [J]


class Decision(NamedTuple):
    """DARKO_DECISION: how the leg to item ``seq`` is flown. An impossible way takes infinite time."""

    time: float  # since boot [s]
    seq: int | None  # mission item at the end of the leg
    way: int  # Way
    reason: int  # DecisionReason
    distance: float  # [m]
    climb: float  # [m]
    tail_wind: float  # [m/s]
    cross_wind: float  # positive from the left [m/s]
    hover_time: float  # [s]
    hover_energy: float  # [J]
    forward_time: float
    forward_energy: float

    @property
    def saving(self) -> float:
        """Energy the chosen way takes less than the other, as a share of the other's; NaN where one is impossible."""
        if self.chosen_and_other is None:
            return math.nan
        (_, energy), (_, other) = self.chosen_and_other
        return 1.0 - energy / other if other > 0.0 else math.nan

    @property
    def chosen_and_other(self) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """Time [s] and energy [J] of the chosen way and of the other; None where one is impossible."""
        hover, forward = (self.hover_time, self.hover_energy), (self.forward_time, self.forward_energy)
        if self.way not in {Way.HOVER, Way.FORWARD} or not all(map(math.isfinite, (*hover, *forward))):
            return None
        return (hover, forward) if self.way == Way.HOVER else (forward, hover)


class Air(NamedTuple):
    """DARKO_AIR: velocity of the air, NED, and airspeed [m/s]."""

    wind_estimate: Vector
    wind_true: Vector
    airspeed_estimate: float
    airspeed_true: float


class Navigation(NamedTuple):
    """NAV_CONTROLLER_OUTPUT."""

    cross_track: float  # [m]
    altitude_error: float  # [m]
    distance: float  # to the waypoint [m]
    bearing: float  # to the waypoint [rad]


class PlanIds(NamedTuple):
    """MISSION_CURRENT: which plans the vehicle has; an id changes with what the plan says."""

    time: float  # when it was told [s], on the caller's clock
    mission: int
    fence: int
    rally: int


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What the screens show. Positions are NED in the vehicle's local frame, angles radians, SI units."""

    source: Source | None = None
    autopilot: int = 0  # MAV_AUTOPILOT
    kind: int = 0  # MAV_TYPE
    armed: bool | None = None
    mode: str | None = None
    heartbeat_at: float | None = None  # when the last HEARTBEAT came, on the caller's clock [s]
    lost: bool = False
    critical: bool = False  # the vehicle's own failsafes see cause for alarm
    landed_state: int = 0  # MAV_LANDED_STATE
    vtol_state: int = 0  # MAV_VTOL_STATE
    boot: float | None = None  # vehicle's time since boot [s]
    earlier: int = 0  # messages in a row whose time since boot was long before that
    restarts: int = 0  # times the vehicle was seen to start anew

    q: Quaternion | None = None  # flying body frame FRD -> NED
    repr_offset: Quaternion | None = None
    p: Vector | None = None  # NED [m]
    v: Vector | None = None  # NED [m/s]
    target: Vector | None = None  # NED [m]
    geodetic: Geodetic | None = None
    relative_altitude: float | None = None
    home: Geodetic | None = None
    home_p: Vector = (0.0, 0.0, 0.0)  # NED [m]
    airspeed: float | None = None
    ground_speed: float | None = None
    throttle: float | None = None  # 0..1
    wind: Vector | None = None  # velocity of the air, NED [m/s]
    heading: float | None = None  # [rad]
    air: Air | None = None
    navigation: Navigation | None = None
    decision: Decision | None = None

    hybrid: Hybrid | None = None
    law_since: float | None = None  # vehicle time of the last change of law [s]
    parameters: Mapping[str, float] = field(default_factory=dict)
    parameter_count: int | None = None  # in the vehicle's table
    meanings: Mapping[str, Meaning] = field(default_factory=dict)  # of parameters, in the vehicle's words
    v_history: tuple[tuple[float, float, float], ...] = ()  # (vehicle time [s], V hover, V forward)
    jumps: tuple[Jump, ...] = ()
    actuators: Actuators | None = None
    saturated_at: Mapping[Saturation, float] = field(default_factory=dict)  # when last, vehicle time [s]
    energy: Energy | None = None
    voltage: float | None = None
    current: float | None = None
    battery: float | None = None  # share left, 0..1
    prearm_ok: bool | None = None
    in_control: int = 0  # system id of the ground station in control, 0: nobody's more than another's
    takeover: bool = False  # whether it lets others take control
    asks_for_control: int = 0  # system id of another one that asked this one

    track: tuple[tuple[float, float], ...] = ()  # (north, east) [m]
    mission: tuple[MissionItem, ...] = ()  # as uploaded or downloaded
    fence: tuple[MissionItem, ...] = ()
    rally: tuple[MissionItem, ...] = ()
    plan_ids: PlanIds | None = None
    mission_count: int | None = None
    mission_current: int | None = None
    mission_state: int = 0  # MISSION_STATE
    reached: frozenset[int] = frozenset()
    transfer: tuple[str, int, int] | None = None  # direction, done, total

    in_progress: CommandProgress | None = None  # the command that the vehicle is working on

    messages: tuple[Line, ...] = ()
    open_text: OpenText | None = None  # whose next chunk goes on with the last line
    received: int = 0  # messages
    rate: float = math.nan  # messages per second
    loss: float = 0.0  # share of frames lost, 0..1
    unrecorded: bool = False  # the recording failed, or could not begin
    signing: Signing = Signing.PRIVATE
    refused: int = 0  # frames dropped for want of a good signature

    @property
    def from_home(self) -> Vector | None:
        """Where the vehicle is, NED about home [m]."""
        if self.p is None:
            return None
        return self.p[0] - self.home_p[0], self.p[1] - self.home_p[1], self.p[2] - self.home_p[2]

    def local(self, place: Geodetic) -> Vector | None:
        """A place on the globe, NED in the vehicle's local frame [m]; None while its home is not known."""
        if self.home is None:
            return None
        north, east, down = LocalFrame(self.home).to_ned(place)
        return north + self.home_p[0], east + self.home_p[1], down + self.home_p[2]

    @property
    def is_forward(self) -> bool:
        """True on the wing, until a transition back to hover is over: one switch per transition, at its end."""
        return self.vtol_state in NOSE_FORWARD

    @property
    def law(self) -> str | None:
        """Name of the law in force."""
        return None if self.hybrid is None else label(Law, self.hybrid.law)

    def age(self, now: float) -> float | None:
        """Time since the last HEARTBEAT [s]."""
        return None if self.heartbeat_at is None else max(0.0, now - self.heartbeat_at)


EMPTY = Snapshot()
