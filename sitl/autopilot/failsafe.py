"""What the vehicle does by itself when its pilot, its set-points or its battery fail it, or it leaves its fence.

Every watch tells its :class:`~sitl.autopilot.alarm.Alarm` once, with why and what is done about it. What the pilot
asks for afterwards is done; an alarm comes again only after its cause was gone. The graver action wins: a landing is
never stopped for a return, nor a return for a hold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.modes import Mode
from sitl.autopilot.alarm import Action, Alarm
from sitl.autopilot.fence import FenceWatch
from sitl.autopilot.guidance import FAST_DESCENT, SLOW_BELOW, View
from sitl.autopilot.legs import BREEZE
from sitl.autopilot.link_watch import LinkWatches, Silence
from sitl.autopilot.mission_items import World
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point
from sitl.model.airframe import Airframe
from sitl.prediction.chooser import Chooser

EVERY = 0.1  # between looks at the fence [s]
BATTERY_EVERY = 1.0  # between looks at the battery [s]
FASTEST_LOSS = 10.0  # hover powers at which what is beyond the way home can shrink, flying away downwind
MAX_WAIT = 30.0  # between predictions of the way home [s]
MARGIN = 1.1  # on the predicted energy
TOUCHDOWN = 1.5  # until the ground is felt [s]
IN_A_WIND = 2.0  # times the energy of still air that most landings take in gusty winds of 3 to 6 m/s, flown
IN_ANY_WIND = 4.0  # and all but one in sixty
RECOVERED = 0.02  # share of the battery above a threshold that ends its alarm
WARNING, CRITICAL = mavlink.MAV_SEVERITY_WARNING, mavlink.MAV_SEVERITY_CRITICAL


# What the numbers of the parameters mean; they are PX4's.
FENCE_ACTIONS = {1: Action.NONE, 2: Action.HOLD, 3: Action.RETURN, 5: Action.LAND}
OFFBOARD_ACTIONS = {3: Action.RETURN, 4: Action.LAND, 5: Action.HOLD}
BATTERY_WARN, BATTERY_LAND, BATTERY_RETURN = 0, 2, 3


class Reserve(NamedTuple):
    """The battery against what is left to fly."""

    left: float  # [J]
    home: float  # predicted to fly home and land there [J]
    kept: float  # for what cannot be predicted: the critical share, and in a wind a landing that takes long [J]


@dataclass(slots=True)
class BatteryWatch:
    """Low, not enough to wait any longer with the way home, and critical: each is said once."""

    low: bool = False
    returned: bool = False
    critical: bool = False

    def check(self, share: float, reserve: Reserve | None, settings: Settings, mode: Mode) -> list[Alarm]:
        """Alarms that begin now.

        Args:
            share: Of the battery left, 0..1.
            reserve: What it is to be held against; None: it lands already, and there is nothing more to decide.
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
        for name, threshold in (("low", settings.battery_low), ("critical", settings.battery_critical)):
            setattr(self, name, share < threshold + (RECOVERED if getattr(self, name) else 0.0))
        return alarms

    def _way_home(self, reserve: Reserve, mode: Mode) -> list[Alarm]:
        if not math.isfinite(reserve.home):  # not known, as in a wind that is too strong at the moment
            return []
        needed = MARGIN * reserve.home + reserve.kept
        said = f"{reserve.left:.0f} J left, home takes {reserve.home:.0f} J"
        if reserve.left < reserve.home and (mode is Mode.RTL or not self.returned):
            self.returned = True
            return [Alarm(Action.LAND, CRITICAL, f"Battery: {said}, out of reach")]
        if reserve.left < needed and not self.returned:
            self.returned = True
            return [Alarm(Action.RETURN, CRITICAL, f"Battery: {said}, {reserve.kept:.0f} J are kept")]
        missing = mode is Mode.RTL or reserve.left < (1.0 + RECOVERED) * needed
        self.returned = self.returned and missing
        return []

    def _at_critical(self, share: float, reserve: Reserve | None, settings: Settings, mode: Mode) -> Alarm:
        lands = settings.battery_action >= BATTERY_LAND
        if reserve is None:
            lands = True
        elif mode is Mode.RTL and reserve.left >= reserve.home:
            lands = False
        action = Action.LAND if lands else Action.NONE
        return Alarm(action, CRITICAL, f"Battery critical: {100 * share:.0f} % left")


@dataclass(slots=True)
class WayHome:
    """The prediction of the way home, made again before it can have become wrong enough to matter: it takes 6 ms."""

    home: float = 0.0  # [J]
    slack: float = 0.0  # beyond what is needed, when it was made [J]
    until: float = -math.inf  # [s]
    to: Point | None = None  # where it leads, world NWU [m]

    def reserve(self, view: View, mode: Mode, to: Point, settings: Settings, chooser: Chooser) -> Reserve:
        """The battery against the way to a point, world NWU [m]."""
        capacity = view.energy / view.energy_left if view.energy_left > 0.0 else 0.0
        kept = settings.battery_critical * capacity
        if _is_windy(view):
            kept += (IN_ANY_WIND - IN_A_WIND) * landing_energy(view, to, settings, chooser.airframe)
        spent = view.energy - MARGIN * self.home - kept < 0.5 * self.slack
        if view.time >= self.until or spent or to != self.to:
            self.to = to
            self.home = energy_home(view, to, settings, chooser, on_its_way=mode is Mode.RTL)
            self.slack = view.energy - MARGIN * self.home - kept
            lasts = self.slack / (FASTEST_LOSS * hover_power(chooser.airframe))
            self.until = view.time + min(max(lasts, 0.0), MAX_WAIT) if math.isfinite(lasts) else -math.inf
        return Reserve(view.energy, self.home, kept)


@dataclass(slots=True)
class Failsafes:
    """All watches of one vehicle. ``silence`` is the owner's to set: it is counted on the link's time."""

    silence: Silence = field(default_factory=Silence)
    links: LinkWatches = field(default_factory=LinkWatches)
    fence: FenceWatch = field(default_factory=FenceWatch)
    battery: BatteryWatch = field(default_factory=BatteryWatch)
    _fence_at: float = -math.inf
    _battery_at: float = -math.inf
    _way_home: WayHome = field(default_factory=WayHome)

    def check(
        self,
        view: View,
        mode: Mode,
        world: World,
        settings: Settings,
        chooser: Chooser | None,
        *,
        landing: bool,
    ) -> list[Alarm]:
        """Alarms that begin at this tick of a flight."""
        alarms = self.links.check(self.silence, settings)
        if settings.fence_action and view.time - self._fence_at >= EVERY:
            self._fence_at = view.time
            if breach := self.fence.check(view, world.fence):
                action = FENCE_ACTIONS[settings.fence_action]
                alarms.append(Alarm(action, WARNING, f"Fence: {breach.text}", stop=True))
        if chooser is not None and view.time - self._battery_at >= BATTERY_EVERY:
            self._battery_at = view.time
            home = world.safe_point(view.p, settings.return_altitude)
            reserve = None if landing else self._way_home.reserve(view, mode, home, settings, chooser)
            alarms += self.battery.check(view.energy_left, reserve, settings, mode)
        return alarms

    @property
    def is_critical(self) -> bool:
        """Whether a link is lost, the fence about to be left, or the battery no longer free to use."""
        return self.links.lost or self.fence.breached or self.battery.returned or self.battery.critical

    def rest(self) -> None:
        """Forget link losses on the ground; the next flight reports them anew."""
        self.links = LinkWatches()


def energy_home(view: View, to: Point, settings: Settings, chooser: Chooser, *, on_its_way: bool = False) -> float:
    """Predicted shaft energy of the way to a point and of the landing there [J].

    The climb to the return altitude and the landing are hovered at the power of still air, the landing for longer in a
    wind; the leg is the decision's (:mod:`sitl.prediction.mode_choice`), the cheaper way, in the wind as estimated.

    Args:
        view: The vehicle as it is now.
        to: Where it lands, and the height that it arrives at at least, world NWU [m].
        settings: Rates and altitudes.
        chooser: Predicts the leg.
        on_its_way: The vehicle is returning already. Before that a return costs a start from the hover, from the wing
            as well: it has to stop or to turn round.
    """
    power = hover_power(chooser.airframe)
    high = max(view.p[2], to[2])
    climb = 0.0 if view.forward else (high - view.p[2]) / settings.climb_rate
    landing = landing_energy(view, to, settings, chooser.airframe) * (IN_A_WIND if _is_windy(view) else 1.0)
    leg = chooser.energy(
        view, (view.p[0], view.p[1], high), (to[0], to[1], high), settings, flying=on_its_way and view.forward
    )
    return power * climb + landing + leg


def landing_energy(view: View, to: Point, settings: Settings, airframe: Airframe) -> float:
    """Shaft energy of a landing in still air from the height of the return [J]; arguments as of ``energy_home``."""
    high = max(view.p[2], to[2])
    slowly = min(high, SLOW_BELOW)
    time = slowly / settings.descent_rate + (high - slowly) / FAST_DESCENT + TOUCHDOWN
    return hover_power(airframe) * time


def _is_windy(view: View) -> bool:
    return math.hypot(view.wind[0], view.wind[1]) > BREEZE


def hover_power(a: Airframe) -> float:
    """Shaft power of a hover in still air [W]: the thrust carries the weight and the drag in the slipstream."""
    thrust = a.m * a.g / (2.0 * (1.0 - a.S_ratio * a.C_d0))
    return float(2.0 * a.k_m * (thrust / a.k_f) ** 1.5)
