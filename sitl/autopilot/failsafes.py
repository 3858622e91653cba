"""Failsafes: the watches of links, fence and battery, and the energy that the way home takes.

Each watch raises its :class:`~sitl.autopilot.answers.Alarm` once, with the reason and what is done about it. The
pilot may overrule it; it is raised again only after its cause was gone. The graver action wins: a landing is never
stopped for a return, nor a return for a hold.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.names import Mode
from protocol.plans.plan import Refusal
from sitl.autopilot.answers import DOING, Alarm, SafetyAction
from sitl.autopilot.fence_watch import FenceWatch
from sitl.autopilot.flight_state import FlightState
from sitl.autopilot.path_watch import ArenaWatch, LiveObstacles, PathWatch
from sitl.autopilot.settings import Settings
from sitl.autopilot.watches import FailureDetector, LinkSilence, LinkWatches, NavigationWatch
from sitl.autopilot.world import World
from sitl.control.reference import Point, Reference, at
from sitl.guidance.landing import FAST_DESCENT_RATE, SLOW_DESCENT_HEIGHT
from sitl.guidance.legs import LIGHT_WIND
from sitl.guidance.manoeuvres import ComeToRest, Hold, ManoeuvreSequence
from sitl.guidance.view import VehicleView
from sitl.guidance.way_ahead import WayStretch
from sitl.model.airframe import Airframe
from sitl.model.battery import drawn_power
from sitl.model.propeller import hover_speed
from sitl.model.state import Actuators
from sitl.prediction.chooser import Chooser

FENCE_PERIOD = 0.1  # between checks of the fence [s]
BATTERY_PERIOD = 1.0  # between checks of the battery [s]
MAX_SLACK_LOSS = 10.0  # hover powers at which the energy beyond the way home can shrink, flying away downwind
MAX_PREDICTION_AGE = 30.0  # of the way home [s]
ENERGY_MARGIN = 1.1  # on the predicted energy
TOUCHDOWN_TIME = 1.5  # until the ground is felt [s]
# Energy of landings flown in gusty winds of 3 to 6 m/s, in multiples of that in still air:
USUAL_WINDY_LANDING = 2.0  # most of them
NEARLY_ALL_WINDY_LANDINGS = 4.0  # all but one in sixty
RECOVERY_SHARE = 0.02  # of the battery above a threshold, which ends its alarm
WARNING, CRITICAL = mavlink.MAV_SEVERITY_WARNING, mavlink.MAV_SEVERITY_CRITICAL

# What the numbers of the parameters mean; they are PX4's.
FENCE_ACTIONS = {1: SafetyAction.NONE, 2: SafetyAction.HOLD, 3: SafetyAction.RETURN, 5: SafetyAction.LAND}
BATTERY_LAND, BATTERY_RETURN = 2, 3  # of COM_LOW_BAT_ACT


class Reserve(NamedTuple):
    """The battery against what is left to fly."""

    remaining: float  # [J]
    home: float  # predicted to fly home and land there [J]
    margin: float  # for what cannot be predicted: the critical share, and in a wind a landing that takes long [J]


@dataclass(slots=True)
class BatteryWatch:
    """Low, just enough for the way home, and critical: each is reported once."""

    low: bool = False
    returned: bool = False
    critical: bool = False

    def check(self, share: float, reserve: Reserve | None, settings: Settings, mode: Mode) -> list[Alarm]:
        """Alarms that begin now.

        Args:
            share: Of the battery that is left, 0..1.
            reserve: Energy left and needed; None: the vehicle lands already, and there is nothing more to decide.
            settings: With the thresholds and the action.
            mode: The flight mode.
        """
        alarms = []
        if share < settings.battery_low and not self.low:
            alarms.append(Alarm(None, WARNING, f"Battery low: {100 * share:.0f} % left"))
        if settings.battery_action == BATTERY_RETURN and reserve is not None:
            alarms += self._way_home(reserve, mode)
        if share < settings.battery_critical and not self.critical:
            alarms.append(self._at_critical(share, reserve, settings, mode))
        self.low = _is_below(share, settings.battery_low, was_below=self.low)
        self.critical = _is_below(share, settings.battery_critical, was_below=self.critical)
        return alarms

    def _way_home(self, reserve: Reserve, mode: Mode) -> list[Alarm]:
        """Return while the battery's energy is enough for the way home, or land; the height does not matter."""
        if not math.isfinite(reserve.home):  # not known, as in a wind that is too strong at the moment
            return []
        needed = ENERGY_MARGIN * reserve.home + reserve.margin
        balance = f"{reserve.remaining:.0f} J left, home takes {reserve.home:.0f} J"
        if reserve.remaining < reserve.home and (mode is Mode.RTL or not self.returned):
            self.returned = True
            return [Alarm(SafetyAction.LAND, CRITICAL, f"Battery: {balance}, out of reach")]
        if reserve.remaining < needed and not self.returned:
            self.returned = True
            return [Alarm(SafetyAction.RETURN, CRITICAL, f"Battery: {balance}, margin {reserve.margin:.0f} J")]
        still_low = mode is Mode.RTL or reserve.remaining < (1.0 + RECOVERY_SHARE) * needed
        self.returned = self.returned and still_low
        return []

    def _at_critical(self, share: float, reserve: Reserve | None, settings: Settings, mode: Mode) -> Alarm:
        """Land at the critical share of the battery, or return, as the settings have it."""
        lands = settings.battery_action >= BATTERY_LAND
        if reserve is None:
            lands = True
        elif mode is Mode.RTL and reserve.remaining >= reserve.home:
            lands = False
        action = SafetyAction.LAND if lands else SafetyAction.NONE
        return Alarm(action, CRITICAL, f"Battery critical: {100 * share:.0f} % left")


def _is_below(share: float, threshold: float, *, was_below: bool) -> bool:
    return share < threshold + (RECOVERY_SHARE if was_below else 0.0)


@dataclass(slots=True)
class ReturnEnergy:
    """The predicted energy of the way home, predicted anew before it can be wrong enough to matter: it takes 6 ms."""

    home: float = 0.0  # [J]
    slack: float = 0.0  # beyond what is needed, at the time of the prediction [J]
    until: float = -math.inf  # [s]
    points: tuple[Point, ...] = ()  # by which the way leads, world NWU [m]

    def reserve(
        self,
        view: VehicleView,
        mode: Mode,
        to: Point,
        settings: Settings,
        chooser: Chooser,
        via: Sequence[Point] = (),
    ) -> Reserve:
        """The battery against the way to a point, world NWU [m], by others."""
        points = (*via, to)
        capacity = view.battery_energy / view.battery_remaining if view.battery_remaining > 0.0 else 0.0
        margin = settings.battery_critical * capacity
        if _is_windy(view):
            extra = NEARLY_ALL_WINDY_LANDINGS - USUAL_WINDY_LANDING
            margin += extra * landing_energy(view, to, settings, chooser.airframe)
        spent = view.battery_energy - ENERGY_MARGIN * self.home - margin < 0.5 * self.slack
        if view.time >= self.until or spent or points != self.points:
            self.points = points
            self.home = energy_home(view, to, settings, chooser, via, returning=mode is Mode.RTL)
            self.slack = view.battery_energy - ENERGY_MARGIN * self.home - margin
            lasts = self.slack / (MAX_SLACK_LOSS * hover_power(chooser.airframe))
            self.until = view.time + min(max(lasts, 0.0), MAX_PREDICTION_AGE) if math.isfinite(lasts) else -math.inf
        return Reserve(view.battery_energy, self.home, margin)


@dataclass(slots=True)
class Failsafes:
    """All watches of one vehicle. The owner sets ``silence``, which is counted on the link's time."""

    silence: LinkSilence = field(default_factory=LinkSilence)
    links: LinkWatches = field(default_factory=LinkWatches)
    navigation: NavigationWatch = field(default_factory=NavigationWatch)
    fence: FenceWatch = field(default_factory=FenceWatch)
    arena: ArenaWatch = field(default_factory=ArenaWatch)
    obstacles: LiveObstacles = field(default_factory=LiveObstacles)
    battery: BatteryWatch = field(default_factory=BatteryWatch)
    failures: FailureDetector = field(default_factory=FailureDetector)
    path: PathWatch = field(default_factory=PathWatch)
    _fence_checked: float = -math.inf  # [s]
    _battery_checked: float = -math.inf  # [s]
    _return_energy: ReturnEnergy = field(default_factory=ReturnEnergy)

    def check(
        self,
        view: VehicleView,
        mode: Mode,
        world: World,
        settings: Settings,
        chooser: Chooser | None,
        *,
        landing: bool,
        return_points: Callable[[], Sequence[Point]] | None = None,
        reference: Reference | None = None,
        stretches: Callable[[], Sequence[WayStretch]] = tuple,
    ) -> list[Alarm]:
        """Alarms that begin at this tick of a flight.

        ``return_points`` gives where a return leads, world NWU [m]; None: to home or a rally point. ``stretches`` gives
        the legs or the circle that are flown by a plan.
        """
        alarms = self.failures.check(view, settings) + self.links.check(self.silence, settings)
        alarms += self.navigation.check(view, settings.position_timeout)
        if reference is not None:
            alarms += self.path.check(view, reference, settings.path_room)
        if settings.fence_action and view.time - self._fence_checked >= FENCE_PERIOD:
            self._fence_checked = view.time
            if breach := self.fence.check(view, world.fence, stretches()):
                action = FENCE_ACTIONS[settings.fence_action]
                to = world.fence.return_point
                alarms.append(Alarm(action, WARNING, f"Fence: {breach.text}", stop=True, to=to))
        if settings.net_action and (world.arena.has_net or world.arena.obstacles):
            alarms += self.arena.check(view, world.arena, settings, landing=landing)
        alarms += self.obstacles.check(view, settings)
        if chooser is not None and view.time - self._battery_checked >= BATTERY_PERIOD:
            self._battery_checked = view.time
            home = world.safe_point(view.p, settings.return_altitude)
            *via, to = (home,) if return_points is None else return_points()
            reserve = None if landing else self._return_energy.reserve(view, mode, to, settings, chooser, via)
            alarms += self.battery.check(view.battery_remaining, reserve, settings, mode)
        return alarms

    @property
    def is_critical(self) -> bool:
        """Whether something fails or is lost, the fence is being left, or the battery is needed to come home."""
        lost = self.failures.is_critical or self.links.lost or self.navigation.lost or self.path.has_left
        return lost or self.fence.breached or self.arena.near or self.battery.returned or self.battery.critical

    def rest(self) -> None:
        """Forget losses and failures on the ground; the next flight reports them anew."""
        self.links, self.navigation = LinkWatches(), NavigationWatch()
        self.failures, self.arena, self.path = FailureDetector(), ArenaWatch(), PathWatch()


def energy_home(
    view: VehicleView,
    to: Point,
    settings: Settings,
    chooser: Chooser,
    via: Sequence[Point] = (),
    *,
    returning: bool = False,
) -> float:
    """Predicted energy of the way to a point and of the landing there [J].

    The climb to the return altitude and the landing are hovered at the power of still air, the landing for longer in a
    wind. The leg is the one that :mod:`sitl.prediction.mode_choice` would choose, in the wind as it is estimated.

    Args:
        view: The vehicle as it is now.
        to: Where it lands, and the height that it arrives at at least, world NWU [m].
        settings: Rates and altitudes.
        chooser: Predicts the leg.
        via: Points before, world NWU [m].
        returning: The vehicle is returning already. Before that a return costs a start from the hover, from forward
            flight as well: the vehicle has to stop or to turn round.
    """
    power = hover_power(chooser.airframe)
    high = max(view.p[2], to[2])
    climb = 0.0 if view.forward else (high - view.p[2]) / settings.climb_rate
    landing = landing_energy(view, to, settings, chooser.airframe) * (USUAL_WINDY_LANDING if _is_windy(view) else 1.0)
    here = view.p if returning else _turning_point(view)
    route = [(p[0], p[1], high) for p in (here, *via, to)]
    flying = returning and view.forward
    legs, seen = 0.0, view
    for a, b in itertools.pairwise(route):
        legs += chooser.energy(seen, a, b, settings, flying=flying)
        seen = view._replace(heading=math.atan2(b[1] - a[1], b[0] - a[0]), v=(0.0, 0.0, 0.0))  # as it ends the leg
    return power * climb + landing + legs


def _turning_point(view: VehicleView) -> Point:
    """The place, world NWU [m], that a vehicle in forward flight comes to before it has stopped or turned."""
    speed = math.hypot(view.v[0], view.v[1])
    share = view.stopping_distance / speed if view.forward and speed > 1.0 else 0.0
    return (view.p[0] + share * view.v[0], view.p[1] + share * view.v[1], view.p[2])


def landing_energy(view: VehicleView, to: Point, settings: Settings, airframe: Airframe) -> float:
    """Energy of a landing in still air from the height of the return [J]; arguments as of ``energy_home``."""
    high = max(view.p[2], to[2])
    slow = min(high, SLOW_DESCENT_HEIGHT)
    time = slow / settings.descent_rate + (high - slow) / FAST_DESCENT_RATE + TOUCHDOWN_TIME
    return hover_power(airframe) * time


def _is_windy(view: VehicleView) -> bool:
    return math.hypot(view.wind[0], view.wind[1]) > LIGHT_WIND


def hover_power(a: Airframe) -> float:
    """Power of a hover in still air [W]: the thrust carries the weight and the drag in the slipstream."""
    speed = hover_speed(a)
    return float(drawn_power(Actuators(speed, speed, 0.0, 0.0), 0.0, a))


# Response of the vehicle to alarms: it holds, returns, lands or cuts the motors; the graver action wins.


OFFBOARD_ACTIONS = {3: SafetyAction.RETURN, 4: SafetyAction.LAND, 5: SafetyAction.HOLD}  # by COM_OBL_RC_ACT


class FailsafeResponse:
    """Checks the failsafes of a flight, and does what they ask for."""

    def __init__(self, flight: FlightState, failsafes: Failsafes) -> None:
        self._flight, self._failsafes = flight, failsafes

    def check(self) -> None:
        """One tick of a flight: report the alarms that begin, and act on the gravest."""
        flight, under_way = self._flight, self._under_way()
        alarms = self._failsafes.check(
            flight.view,
            flight.mode,
            flight.world,
            flight.settings,
            flight.chooser,
            landing=under_way is SafetyAction.LAND,
            return_points=flight.return_points,
            reference=flight.reference,
            stretches=flight.stretches_ahead,
        )
        if not alarms:
            return
        gravest = max(alarms, key=lambda alarm: alarm.action or SafetyAction.NONE)
        if gravest.action is SafetyAction.TERMINATE:
            flight.terminate(gravest.reason)
            return
        if gravest.always and under_way is SafetyAction.RETURN:
            under_way = SafetyAction.NONE
        for alarm in alarms:
            flight.say(alarm.severity, alarm.text(gravest.action or SafetyAction.NONE, under_way))
        if (gravest.action or SafetyAction.NONE) > under_way:
            self._act(gravest.action or SafetyAction.NONE, stop=gravest.stop, retreat=gravest.retreat, to=gravest.to)

    def lose_setpoints(self, reason: str) -> None:
        """Set-points can no longer be flown, for a reason the pilot reads: do what the settings say."""
        action = OFFBOARD_ACTIONS[self._flight.settings.setpoint_action]
        self._flight.say(mavlink.MAV_SEVERITY_WARNING, f"{reason}: {DOING[action]}")
        if action > self._under_way():
            self._act(action, stop=False)

    def _under_way(self) -> SafetyAction:
        """The action in progress, which no lesser alarm may stop; LAND already as it comes to rest before one."""
        if self._flight.landing or self._flight.mode is Mode.LAND:
            return SafetyAction.LAND
        return SafetyAction.RETURN if self._flight.mode is Mode.RTL else SafetyAction.NONE

    def _act(self, action: SafetyAction, *, stop: bool, retreat: float = 0.0, to: Point | None = None) -> None:
        """Do what an alarm asks for.

        Args:
            action: What it asks for.
            stop: Whether a vehicle in forward flight stops before it turns elsewhere.
            retreat: How much farther inside the arena's net a hold is flown [m].
            to: Where a return ends and holds, world NWU [m]; None: it lands at home.
        """
        if action is SafetyAction.HOLD:
            self._flight.hold_here(retreat)
        elif action is SafetyAction.LAND:
            self._flight.land_here()
        elif to is None or not self._hold_at(to):
            self._return(stop=stop)

    def _hold_at(self, point: Point) -> bool:
        """Stop, fly to a point no lower than a return is flown, and hold there; False if there is no way."""
        flight = self._flight
        here, last = flight.hover_reference(flight.stop_point()), flight.view
        low = flight.world.home[2] + flight.settings.return_altitude
        there = at(here, flight.world.arena.clamped((point[0], point[1], max(point[2], low))))
        stopped = last._replace(p=here.position, v=(0.0, 0.0, 0.0), forward=False)
        route = flight.leg_to(there, stopped)
        if isinstance(route, Refusal):
            return False
        flight.say(mavlink.MAV_SEVERITY_INFO, "Flying to the fence's return point")
        flight.enter(Mode.HOLD, ManoeuvreSequence((ComeToRest(here), route, Hold(there))))
        return True

    def _return(self, *, stop: bool) -> None:
        flight = self._flight
        here = flight.hover_reference(flight.stop_point())
        first = (ComeToRest(here),) if flight.view.forward and stop else ()
        view = flight.view._replace(p=here.position, v=(0.0, 0.0, 0.0), forward=False) if first else flight.view
        flight.enter(Mode.RTL, ManoeuvreSequence((*first, *flight.route_home(view).steps)))
