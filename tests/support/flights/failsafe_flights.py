"""Flights in which a link is lost or the battery runs low: how each begins, and what became of it."""

from collections.abc import Callable
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode, Regime
from protocol.names import Mode
from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.manual import Sticks
from sitl.autopilot.settings import Settings
from sitl.autopilot.watches import LinkSilence
from sitl.guidance.setpoints import KEEP_HEADING
from sitl.simulation.situation import regime
from sitl.vehicle.aircraft import is_forward
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.mission_items import item, waypoint

TIMEOUT = 2.0  # of both links [s]
FORWARD = Settings(leg_mode=LegMode.FORWARD, link_timeout=TIMEOUT, companion_timeout=TIMEOUT)
HOVER = FORWARD._replace(leg_mode=LegMode.HOVER)
FAR = (400.0, 0.0, HIGH)


def nothing():
    """Stream nothing."""


class LinkFlight(Flight):
    """A flight with both links, which can be lost; ``modes`` are those it was in, in order."""

    def __init__(self, **begun):
        super().__init__(**begun)
        self.stream = nothing  # called at every sample
        self.modes = [self.autopilot.mode]
        self._heard = {"ground": 0.0, "companion": 0.0}
        self._lost = set()

    def lose(self, *links):
        """These links are silent from now on."""
        self._lost |= set(links)

    def find(self, *links):
        """These links are back."""
        self._lost -= set(links)

    def fly(self, seconds, each=nothing):
        """Fly on for a time, streaming what there is to stream."""

        def live():
            self._heard |= {link: self.vehicle.time for link in self._heard if link not in self._lost}
            silent = {link: self.vehicle.time - heard for link, heard in self._heard.items()}
            self.autopilot.failsafes.silence = LinkSilence(**silent)
            if self.autopilot.mode is not self.modes[-1]:
                self.modes.append(self.autopilot.mode)
            self.stream()
            each()

        super().fly(seconds, live)

    @property
    def alarms(self):
        """Texts about lost links."""
        return [text for text in self.texts if text.startswith("No ")]

    def land(self, limit=150.0):
        """Fly until the vehicle stands on the ground."""
        self.fly_until(lambda: not self.autopilot.flying, limit)
        return self


def hovering(settings, **begun):
    """Holding."""
    flight = LinkFlight(settings=settings, **begun)
    flight.fly(1.0)
    return flight


def taking_off(settings, **begun):
    """Climbing, 3 m above the ground."""
    flight = LinkFlight(airborne=False, settings=settings, **begun)
    flight.fly(0.5)
    assert flight.autopilot.arming.arm().accepted
    assert flight.autopilot.guided.take_off(HIGH).accepted
    flight.fly_until(lambda: flight.vehicle.truth.body.position.z > 3.0, 20.0)
    return flight


def in_front_transition(settings, **begun):
    """Between hover and forward flight."""
    flight = hovering(settings, **begun)
    assert flight.autopilot.guided.go_to(FAR).accepted
    flight.fly_until(lambda: regime(flight.vehicle) is Regime.FRONT_TRANSITION, 10.0)
    flight.fly(0.6)
    assert regime(flight.vehicle) is Regime.FRONT_TRANSITION
    return flight


def in_back_transition(settings, **begun):
    """Between forward flight and hover."""
    flight = in_cruise(settings, **begun)
    flight.autopilot.guided.hold()
    flight.fly_until(lambda: regime(flight.vehicle) is Regime.BACK_TRANSITION, 20.0)
    return flight


def in_cruise(settings, **begun):
    """In forward flight to a far point."""
    flight = hovering(settings, **begun)
    assert flight.autopilot.guided.go_to(FAR).accepted
    flight.fly(7.0)
    assert is_forward(flight.vehicle)
    return flight


def _on_mission(settings, **begun):
    flight = hovering(settings, **begun)
    flight.autopilot.missions.load([waypoint(*FAR), waypoint(0.0, 0.0, HIGH), item(mavlink.MAV_CMD_NAV_LAND)])
    assert flight.autopilot.missions.start().accepted
    return flight


def on_forward_mission(settings, **begun):
    """On the first leg of a mission, in forward flight."""
    flight = _on_mission(settings, **begun)
    flight.fly(7.0)
    assert is_forward(flight.vehicle)
    return flight


def on_hovered_mission(settings, **begun):
    """On the first leg of a mission, hovering."""
    flight = _on_mission(settings._replace(leg_mode=LegMode.HOVER), **begun)
    flight.fly(5.0)
    assert not flight.autopilot.view.forward
    return flight


def landing_on_mission(settings, **begun):
    """At the last item of a mission."""
    flight = _on_mission(settings, **begun)
    assert flight.autopilot.missions.start(2).accepted
    flight.fly_until(lambda: flight.autopilot.landing, 30.0)
    flight.fly(1.0)
    return flight


def _streaming(flight, stream, seconds=0.0, mode=Mode.OFFBOARD):
    flight.stream = stream
    stream()
    assert flight.autopilot.set_mode(mode).accepted
    flight.fly(seconds)
    return flight


def _offboard(velocity, settings, seconds, **begun):
    flight = hovering(settings, **begun)
    return _streaming(flight, lambda: flight.autopilot.offboard.set_velocity(velocity), seconds)


def offboard_hovering(settings, **begun):
    """A program streams a velocity of the hover."""
    return _offboard((2.0, 0.0, 0.0), settings, 3.0, **begun)


def offboard_forward(settings, **begun):
    """A program streams a velocity of forward flight."""
    return _offboard((15.0, 0.0, 0.0), settings, 7.0, **begun)


def offboard_accelerating(settings, **begun):
    """A program streams accelerations, which are flown as attitudes."""
    flight = hovering(settings, **begun)
    a = (0.4, 0.0, 0.0)
    return _streaming(flight, lambda: flight.autopilot.offboard.set_acceleration(a, KEEP_HEADING), 2.0)


def by_sticks(settings, **begun):
    """A pilot flies by sticks."""
    flight = hovering(settings, **begun)
    sticks = Sticks(forward=0.7)
    return _streaming(flight, lambda: flight.autopilot.manual.take_sticks(sticks), 3.0, Mode.POSCTL)


def returning(settings, **begun):
    """On the way home, in forward flight."""
    flight = in_cruise(settings, **begun)
    assert flight.autopilot.guided.return_to_launch().accepted
    flight.fly(1.0)
    return flight


def landing(settings, **begun):
    """Descending where it hovered."""
    flight = hovering(settings, **begun)
    assert flight.autopilot.guided.land().accepted
    flight.fly(1.0)
    return flight


def landing_from_cruise(settings, **begun):
    """Ordered to land in the cruise: it comes to rest first."""
    flight = in_cruise(settings, **begun)
    assert flight.autopilot.guided.land().accepted
    flight.fly(0.2)
    return flight


class Situation(NamedTuple):
    """A kind of flight, and its action that no lesser alarm may stop."""

    name: str
    start: Callable[..., LinkFlight]
    under_way: SafetyAction = SafetyAction.NONE


SITUATIONS = (
    Situation("hover", hovering),
    Situation("take-off, at 3 m", taking_off),
    Situation("front transition", in_front_transition),
    Situation("cruise", in_cruise),
    Situation("back transition", in_back_transition),
    Situation("mission, hovering", on_hovered_mission),
    Situation("mission, forward flight", on_forward_mission),
    Situation("OFFBOARD, 2 m/s", offboard_hovering),
    Situation("OFFBOARD, 15 m/s", offboard_forward),
    Situation("OFFBOARD, by attitudes", offboard_accelerating),
    Situation("POSCTL", by_sticks),
    Situation("returning", returning, SafetyAction.RETURN),
    Situation("landing", landing, SafetyAction.LAND),
    Situation("landing, from the cruise", landing_from_cruise, SafetyAction.LAND),
    Situation("landing, at a mission's end", landing_on_mission, SafetyAction.LAND),
)
MODE_OF_ACTION = {SafetyAction.HOLD: Mode.HOLD, SafetyAction.RETURN: Mode.RTL, SafetyAction.LAND: Mode.LAND}


# The battery

AWAY = (1490.0, 0.0, HIGH)
CRITICAL = 0.1  # share of the battery to be home with


def _go_away(flight):
    assert flight.autopilot.guided.go_to(AWAY).accepted


def _fly_mission_away(flight):
    flight.autopilot.missions.load([waypoint(*AWAY), waypoint(0.0, 0.0, HIGH), item(mavlink.MAV_CMD_NAV_LAND)])
    assert flight.autopilot.missions.start().accepted


def _stream_north(speed):
    return lambda flight: _streaming(flight, lambda: flight.autopilot.offboard.set_velocity((speed, 0.0, 0.0)))


class Errand(NamedTuple):
    """A flight away from home, too far for its battery."""

    name: str
    begin: Callable[[LinkFlight], None]
    capacity: float  # [J]
    wind: float = 0.0  # [m/s], from behind on the way out
    gusts: float = 0.0  # rms [m/s]
    leg_mode: LegMode = LegMode.FORWARD

    def fly(self, seed=1):
        """Fly until the vehicle stands on the ground, wherever."""
        settings = Settings(leg_mode=self.leg_mode, battery_low=0.3, battery_critical=CRITICAL)
        flight = LinkFlight(settings=settings, seed=seed, wind_speed=self.wind, wind_from=180.0, gusts=self.gusts)
        flight.aircraft.configure(flight.aircraft.configuration.replaced({"SIM_BAT_ENERGY": self.capacity}))
        self.begin(flight)
        return flight.land(500.0)


ERRANDS = (
    Errand("go-to", _go_away, 10e3),
    Errand("go-to", _go_away, 20e3),
    Errand("go-to", _go_away, 30e3, wind=4.0, gusts=0.7),
    Errand("go-to", _go_away, 30e3, wind=7.0, gusts=1.0),
    Errand("mission", _fly_mission_away, 12e3),
    Errand("mission", _fly_mission_away, 25e3, wind=4.0, gusts=0.7),
    Errand("OFFBOARD, 15 m/s", _stream_north(15.0), 12e3),
    Errand("OFFBOARD, 15 m/s", _stream_north(15.0), 30e3, wind=4.0, gusts=0.7),
    Errand("OFFBOARD, 2 m/s", _stream_north(2.0), 16e3, leg_mode=LegMode.HOVER),
)
