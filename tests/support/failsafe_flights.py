"""Flights in which a link is lost: how each begins, and what became of it."""

from collections.abc import Callable
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Way
from protocol.modes import Mode
from sitl.autopilot.alarm import Action
from sitl.autopilot.link_watch import Silence
from sitl.autopilot.manual import Sticks
from sitl.autopilot.settings import Settings
from sitl.autopilot.streamed import KEEP_FACING
from sitl.craft import is_forward
from tests.support.wing_flight import HIGH, Flight, item, waypoint

TIMEOUT = 2.0  # of both links [s]
ON_THE_WING = Settings(way=Way.FORWARD, link_timeout=TIMEOUT, companion_timeout=TIMEOUT)
UPRIGHT = ON_THE_WING._replace(way=Way.HOVER)
FAR = (400.0, 0.0, HIGH)


def nothing():
    """What is streamed where nothing is."""


class LinkFlight(Flight):
    """A flight with both links, which can be lost; ``modes`` are those it was in, in order."""

    def __init__(self, **begun):
        super().__init__(**begun)
        self.stream = nothing  # sent at every sample
        self.modes = [self.autopilot.mode]
        self._heard = {"ground": 0.0, "companion": 0.0}
        self._lost = set()

    def lose(self, *links):
        """From now on these are silent."""
        self._lost |= set(links)

    def find(self, *links):
        """They are back."""
        self._lost -= set(links)

    def fly(self, seconds, each=nothing):
        """Fly on for a time, streaming what there is to stream."""

        def live():
            self._heard |= {link: self.vehicle.time for link in self._heard if link not in self._lost}
            silent = {link: self.vehicle.time - heard for link, heard in self._heard.items()}
            self.autopilot.failsafes.silence = Silence(**silent)
            if self.autopilot.mode is not self.modes[-1]:
                self.modes.append(self.autopilot.mode)
            self.stream()
            each()

        super().fly(seconds, live)

    @property
    def alarms(self):
        """What was said of lost links."""
        return [text for text in self.said if text.startswith("No ")]

    def land(self, limit=150.0):
        """Fly until it stands on the ground."""
        self.fly_until(lambda: not self.autopilot.flying, limit)
        return self


def hovering(settings, **begun):
    """It holds."""
    flight = LinkFlight(settings=settings, **begun)
    flight.fly(1.0)
    return flight


def taking_off(settings, **begun):
    """On its way up, 3 m above the ground."""
    flight = LinkFlight(airborne=False, settings=settings, **begun)
    flight.fly(0.5)
    assert flight.autopilot.arm().accepted
    assert flight.autopilot.take_off(HIGH).accepted
    flight.fly_until(lambda: flight.vehicle.truth.body.position.z > 3.0, 20.0)
    return flight


def tipping_over(settings, **begun):
    """On its way from the hover to the wing."""
    flight = hovering(settings, **begun)
    assert flight.autopilot.go_to(FAR).accepted
    flight.fly_until(lambda: flight.vehicle.law is Law.TO_FORWARD, 10.0)
    flight.fly(0.6)
    assert flight.vehicle.law is Law.TO_FORWARD
    return flight


def standing_up(settings, **begun):
    """On its way from the wing to the hover."""
    flight = on_the_wing(settings, **begun)
    flight.autopilot.hold()
    flight.fly_until(lambda: flight.vehicle.law is Law.TO_HOVER, 20.0)
    return flight


def on_the_wing(settings, **begun):
    """In the cruise to a far point."""
    flight = hovering(settings, **begun)
    assert flight.autopilot.go_to(FAR).accepted
    flight.fly(7.0)
    assert is_forward(flight.vehicle.law)
    return flight


def _on_a_mission(settings, **begun):
    flight = hovering(settings, **begun)
    flight.autopilot.load_mission([waypoint(*FAR), waypoint(0.0, 0.0, HIGH), item(mavlink.MAV_CMD_NAV_LAND)])
    assert flight.autopilot.start_mission().accepted
    return flight


def on_a_winged_mission(settings, **begun):
    """On the first leg of a mission, in the cruise."""
    flight = _on_a_mission(settings, **begun)
    flight.fly(7.0)
    assert is_forward(flight.vehicle.law)
    return flight


def on_a_hovered_mission(settings, **begun):
    """On the first leg of a mission, upright."""
    flight = _on_a_mission(settings._replace(way=Way.HOVER), **begun)
    flight.fly(5.0)
    assert not flight.autopilot.view.forward
    return flight


def landing_on_a_mission(settings, **begun):
    """At the last item of a mission."""
    flight = _on_a_mission(settings, **begun)
    assert flight.autopilot.start_mission(2).accepted
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
    return _streaming(flight, lambda: flight.autopilot.set_offboard_velocity(velocity), seconds)


def offboard_upright(settings, **begun):
    """A program flies it, upright."""
    return _offboard((2.0, 0.0, 0.0), settings, 3.0, **begun)


def offboard_on_the_wing(settings, **begun):
    """A program flies it, on the wing."""
    return _offboard((15.0, 0.0, 0.0), settings, 7.0, **begun)


def offboard_tilted(settings, **begun):
    """A program flies it by accelerations, that is by attitudes."""
    flight = hovering(settings, **begun)
    a = (0.4, 0.0, 0.0)
    return _streaming(flight, lambda: flight.autopilot.set_offboard_acceleration(a, KEEP_FACING), 2.0)


def by_sticks(settings, **begun):
    """A pilot flies it."""
    flight = hovering(settings, **begun)
    return _streaming(flight, lambda: flight.autopilot.take_sticks(Sticks(forward=0.7)), 3.0, Mode.POSCTL)


def returning(settings, **begun):
    """On its way home, on the wing."""
    flight = on_the_wing(settings, **begun)
    assert flight.autopilot.return_to_launch().accepted
    flight.fly(1.0)
    return flight


def landing(settings, **begun):
    """On its way down, where it hovered."""
    flight = hovering(settings, **begun)
    assert flight.autopilot.land().accepted
    flight.fly(1.0)
    return flight


def landing_from_the_wing(settings, **begun):
    """Told to land in the cruise: it comes to rest first."""
    flight = on_the_wing(settings, **begun)
    assert flight.autopilot.land().accepted
    flight.fly(0.2)
    return flight


class Begun(NamedTuple):
    """A way of flying, and what of it no lesser alarm may stop."""

    name: str
    start: Callable[..., LinkFlight]
    under_way: Action = Action.NONE


WAYS = (
    Begun("hover", hovering),
    Begun("take-off, at 3 m", taking_off),
    Begun("tipping over", tipping_over),
    Begun("on the wing", on_the_wing),
    Begun("standing up", standing_up),
    Begun("mission, upright", on_a_hovered_mission),
    Begun("mission, on the wing", on_a_winged_mission),
    Begun("OFFBOARD, 2 m/s", offboard_upright),
    Begun("OFFBOARD, 15 m/s", offboard_on_the_wing),
    Begun("OFFBOARD, by attitudes", offboard_tilted),
    Begun("POSCTL", by_sticks),
    Begun("returning", returning, Action.RETURN),
    Begun("landing", landing, Action.LAND),
    Begun("landing, from the wing", landing_from_the_wing, Action.LAND),
    Begun("landing, at a mission's end", landing_on_a_mission, Action.LAND),
)
MODES = {Action.HOLD: Mode.HOLD, Action.RETURN: Mode.RTL, Action.LAND: Mode.LAND}


# The battery

AWAY = (1490.0, 0.0, HIGH)
CRITICAL = 0.1  # share to be home with


def _sent(flight):
    assert flight.autopilot.go_to(AWAY).accepted


def _on_errand(flight):
    flight.autopilot.load_mission([waypoint(*AWAY), waypoint(0.0, 0.0, HIGH), item(mavlink.MAV_CMD_NAV_LAND)])
    assert flight.autopilot.start_mission().accepted


def _streamed(speed):
    return lambda flight: _streaming(flight, lambda: flight.autopilot.set_offboard_velocity((speed, 0.0, 0.0)))


class Errand(NamedTuple):
    """A flight away from home that its battery does not last for there and back."""

    name: str
    begin: Callable[[LinkFlight], None]
    capacity: float  # [J]
    wind: float = 0.0  # [m/s], behind on the way out
    gusts: float = 0.0  # rms [m/s]
    way: Way = Way.FORWARD

    def fly(self, seed=1):
        """Fly until it stands on the ground, wherever."""
        settings = Settings(way=self.way, battery_low=0.3, battery_critical=CRITICAL)
        flight = LinkFlight(settings=settings, seed=seed, wind_speed=self.wind, wind_from=180.0, gusts=self.gusts)
        flight.craft.bind(flight.craft.bindings.replaced({"SIM_BAT_ENERGY": self.capacity}))
        self.begin(flight)
        return flight.land(500.0)


ERRANDS = (
    Errand("go-to", _sent, 10e3),
    Errand("go-to", _sent, 20e3),
    Errand("go-to", _sent, 30e3, wind=4.0, gusts=0.7),
    Errand("go-to", _sent, 30e3, wind=7.0, gusts=1.0),
    Errand("mission", _on_errand, 12e3),
    Errand("mission", _on_errand, 25e3, wind=4.0, gusts=0.7),
    Errand("OFFBOARD, 15 m/s", _streamed(15.0), 12e3),
    Errand("OFFBOARD, 15 m/s", _streamed(15.0), 30e3, wind=4.0, gusts=0.7),
    Errand("OFFBOARD, 2 m/s", _streamed(2.0), 16e3, way=Way.HOVER),
)
