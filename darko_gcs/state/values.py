"""Values that a snapshot is made of: one record per message, in SI units, with labels for MAVLink's own states."""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, LegMode, Limit, Regime, Saturation
from protocol.frames import Quaternion, Vector
from protocol.names import as_member
from protocol.plans import MissionItem

AIRBORNE_STATES = frozenset(
    {mavlink.MAV_LANDED_STATE_IN_AIR, mavlink.MAV_LANDED_STATE_TAKEOFF, mavlink.MAV_LANDED_STATE_LANDING}
)
VTOL_LABELS = {
    mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW: "front transition",
    mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC: "back transition",
    mavlink.MAV_VTOL_STATE_MC: "hover",
    mavlink.MAV_VTOL_STATE_FW: "forward",
}


class SigningState(Enum):
    """State of the link's message signing."""

    PRIVATE = "unsigned, loopback"  # no other machine can reach it
    OPEN = "unsigned"
    SIGNED = "signed"
    NO_KEY = "signed by the vehicle, no key here"
    UNSIGNED_VEHICLE = "the vehicle does not sign with our key"


class Simulator(Enum):
    """The vehicle process that this ground station started."""

    NONE = "none"
    STARTING = "starting"
    RUNNING = "running"
    ENDED = "ended"


class Alert(NamedTuple):
    """Something that calls the pilot."""

    kind: str  # crash, link, failsafe, battery, estimator, failure
    text: str
    time: float  # on the caller's clock [s]
    over: float | None = None  # when its reason was last there, once that is gone [s]


class NetArena(NamedTuple):
    """The net that the vehicle flies under: a box on the ground."""

    name: str
    centre: tuple[float, float]  # north, east in the vehicle's own local frame [m]
    heading: float  # of its length, clockwise from north [rad]
    length: float  # [m]
    width: float  # [m]
    height: float  # above the local frame's origin [m]
    margin: float  # how far inside of it targets must be [m]


class LogLine(NamedTuple):
    """One line of the message log."""

    time: float  # of arrival, on the caller's clock [s]
    severity: int  # MAV_SEVERITY, 0 (worst) to 7
    text: str


class OpenText(NamedTuple):
    """A STATUSTEXT in several chunks, not all of which have arrived."""

    component: int
    number: int  # of the text, the same in all its chunks
    next_chunk: int  # number of the chunk that is expected next
    line: LogLine  # with the chunks so far


class Jump(NamedTuple):
    """One jump of the vehicle's hybrid automaton (DARKO_JUMP)."""

    time: float  # since boot [s]
    number: int
    source: int  # Law
    target: int  # Law
    reason: int  # Reason
    name: str
    v: float  # Lyapunov value at the jump


class Thresholds(NamedTuple):
    """Lyapunov values at which a linear law is entered and left."""

    enter: float
    leave: float


class HybridState(NamedTuple):
    """DARKO_HYBRID_STATE. A Lyapunov value that is not defined now is NaN."""

    time: float  # since boot [s]
    law: int  # Law, or a number that only a newer vehicle knows
    jumps: int
    v_hover: float
    v_forward: float
    v_attitude: float  # [rad^2]
    hover: Thresholds  # of the linear hover law
    forward: Thresholds  # of the linear forward law
    governor: float  # share of the position error that the reference governor removes, 0..1
    last_law: int  # Law before the last jump
    last_reason: int  # Reason of the last jump

    @property
    def is_forward(self) -> bool:
        """True if V is the Lyapunov value of the linear forward law."""
        return uses_forward_v(self.law)

    @property
    def v(self) -> float:
        """The Lyapunov value that the next jump depends on; NaN under an unknown law."""
        law = as_member(Law, self.law)
        if law is None:
            return math.nan
        if law is Law.HOVER_ATTITUDE:
            return self.v_attitude
        return self.v_forward if self.is_forward else self.v_hover


def uses_forward_v(law: int) -> bool:
    """True if V under a law is that of the linear forward law: in forward flight and in the front transition."""
    member = as_member(Law, law)
    return member is not None and member.regime in {Regime.FRONT_TRANSITION, Regime.FORWARD}


class Actuators(NamedTuple):
    """DARKO_ACTUATORS; pairs are left, right."""

    motor: tuple[float, float]  # [rad/s]
    motor_command: tuple[float, float]  # [rad/s]
    thrust: tuple[float, float]  # [N]
    elevon: tuple[float, float]  # [rad]
    elevon_command: tuple[float, float]  # [rad]
    motor_min: float  # [rad/s]
    motor_max: float  # [rad/s]
    elevon_max: float  # [rad]
    limits: Limit
    saturation: Saturation = Saturation(0)


class Energy(NamedTuple):
    """DARKO_ENERGY."""

    power: float  # [W]
    total: float  # [J]
    by_law: tuple[float, ...]  # index is Law [J]
    time: float | None = None  # since boot [s]


class Decision(NamedTuple):
    """DARKO_DECISION: hover or forward flight on the leg to item ``seq``. The time of an impossible one is infinite."""

    time: float  # since boot [s]
    seq: int | None  # mission item at the end of the leg
    leg_mode: int  # LegMode
    reason: int  # DecisionReason
    distance: float  # [m]
    climb: float  # [m]
    tail_wind: float  # [m/s]
    cross_wind: float  # positive from the left [m/s]
    hover_time: float  # [s]
    hover_energy: float  # [J]
    forward_time: float  # [s]
    forward_energy: float  # [J]

    @property
    def chosen(self) -> tuple[float, float] | None:
        """Time [s] and energy [J] of the choice; None without one, or if it is impossible."""
        hover, forward = (self.hover_time, self.hover_energy), (self.forward_time, self.forward_energy)
        chosen = {int(LegMode.HOVER): hover, int(LegMode.FORWARD): forward}.get(self.leg_mode)
        return chosen if chosen is not None and all(map(math.isfinite, chosen)) else None

    @property
    def saving(self) -> float:
        """Energy saved by the choice, as a share of the alternative's energy; NaN if either is impossible."""
        if self.chosen_and_other is None:
            return math.nan
        (_, energy), (_, other) = self.chosen_and_other
        return 1.0 - energy / other if other > 0.0 else math.nan

    @property
    def chosen_and_other(self) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """Time [s] and energy [J] of the choice, then of the alternative; None if either is impossible."""
        hover, forward = (self.hover_time, self.hover_energy), (self.forward_time, self.forward_energy)
        if self.leg_mode not in {LegMode.HOVER, LegMode.FORWARD} or not all(map(math.isfinite, (*hover, *forward))):
            return None
        return (hover, forward) if self.leg_mode == LegMode.HOVER else (forward, hover)


class FlownLeg(NamedTuple):
    """A leg of the mission, and what the vehicle predicted as it began."""

    began: float  # since boot [s]
    energy_before: float  # used until then [J]
    predicted_time: float  # [s]
    predicted_energy: float  # [J]
    time: float = math.nan  # that it took; NaN until it is over [s]
    energy: float = math.nan  # [J]
    distance: float = math.nan  # level, as it began; NaN: not told [m]
    climb: float = math.nan  # likewise [m]

    @property
    def is_over(self) -> bool:
        """True once its item is reached."""
        return math.isfinite(self.time)


class SpeedOrder(NamedTuple):
    """A speed that an operator commanded (MAV_CMD_DO_CHANGE_SPEED)."""

    speed: float  # [m/s]; below 0: the vehicle's own again
    over_ground: bool = False
    mode: str | None = None  # in which it was accepted: with another one it is over
    item: int | None = None  # the mission's then


class Air(NamedTuple):
    """DARKO_AIR: velocity of the air (NED) and airspeed [m/s]."""

    wind_estimate: Vector
    wind_true: Vector
    airspeed_estimate: float
    airspeed_true: float


class Truth(NamedTuple):
    """DARKO_TRUTH: what only a simulation knows."""

    time: float  # since boot [s]
    p: Vector  # NED [m]
    v: Vector  # NED [m/s]
    q: Quaternion  # FRD -> NED, x along the nose
    rates: Vector  # about the axes of ``q`` [rad/s]
    wind: Vector  # velocity of the air, NED [m/s]


class Doubt(NamedTuple):
    """ODOMETRY: standard deviations that the navigation filter states of itself; NaN for one that it does not."""

    p: Vector  # north, east, down [m]
    v: float  # of the worst axis [m/s]
    attitude: float  # of the worst axis [rad]


class Navigation(NamedTuple):
    """NAV_CONTROLLER_OUTPUT."""

    cross_track: float  # [m]
    altitude_error: float  # [m]
    distance: float  # to the waypoint [m]
    bearing: float  # to the waypoint [rad]


class PlanIds(NamedTuple):
    """MISSION_CURRENT: ids of the vehicle's plans; an id changes with the content of its plan."""

    time: float  # of arrival, on the caller's clock [s]
    mission: int
    fence: int
    rally: int


MISSION: int = mavlink.MAV_MISSION_TYPE_MISSION
FENCE: int = mavlink.MAV_MISSION_TYPE_FENCE
RALLY: int = mavlink.MAV_MISSION_TYPE_RALLY
ALL_PLANS: int = mavlink.MAV_MISSION_TYPE_ALL
PLAN_TYPES = (MISSION, FENCE, RALLY)
PLAN_TITLES = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally plan", ALL_PLANS: "Mission, fence and rally plan"}

Items = tuple[MissionItem, ...]


class LegChain(NamedTuple):
    """Legs in a row without a stop between them: the question."""

    points: tuple[Vector, ...]  # where the first begins and each ends, NED in the vehicle's local frame [m]
    asked: tuple[LegMode, ...]  # how each is to be flown
    heading: float | None = None  # before the first, clockwise from north [rad]; None: as it is
    hover_speed: float | None = None  # [m/s]; None: the vehicle's own
    airspeed: float | None = None  # of the cruise [m/s]; None: the vehicle's own


class LegPrediction(NamedTuple):
    """One leg of the answer. What is not possible takes an infinite time."""

    hover_time: float  # [s]
    hover_energy: float  # at the shafts [J]
    forward_time: float  # [s]
    forward_energy: float  # [J]
    leg_mode: int  # LegMode that the vehicle would fly
    reason: int  # DecisionReason

    @property
    def chosen(self) -> tuple[float, float]:
        """Time [s] and energy [J] by the leg mode that would be flown; NaN if the vehicle does not say which."""
        hover, forward = (self.hover_time, self.hover_energy), (self.forward_time, self.forward_energy)
        return {LegMode.HOVER: hover, LegMode.FORWARD: forward}.get(LegMode(self.leg_mode), (math.nan, math.nan))
