"""A scenario flown live: its asks become the guidance of the autopilot in the vehicle process.

The autopilot asks its guidance once per tick of 20 ms, which is when the fast run looks at its asks too, so that
both fly the same trajectory. Whoever watches sees a vehicle in HOLD under the usual telemetry, and a line of text at
the start, at each ask and for every figure at the end. A person stays in command: a request that gives the
autopilot something else to fly ends the scenario, and so does a change of the controller's or the world's parameters.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping

from protocol.dialect import mavlink
from protocol.events import CommandRequested
from protocol.modes import Mode
from sitl.airframe import load
from sitl.autopilot.guidance import View
from sitl.autopilot.mission import World
from sitl.autopilot.outcome import Outcome
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point, Reference, hover_at
from sitl.craft import Craft
from sitl.errors import SitlError
from sitl.parameters import TABLE, Bindings, Surroundings
from sitl.simulation.recording import Recording
from sitl.simulation.simulation import Simulation, Tuning, whole_periods
from sitl.studies.report import SCENARIOS
from sitl.studies.scenario import ALOFT, Ask, Figure, Scenario, Track, joined, next_reference, whole_samples
from sitl.wire.node import Node

NOTICE, INFO, WARNING = mavlink.MAV_SEVERITY_NOTICE, mavlink.MAV_SEVERITY_INFO, mavlink.MAV_SEVERITY_WARNING


def named(name: str) -> Scenario:
    """The scenario of a name.

    Raises:
        SitlError: If there is none.
    """
    if name not in SCENARIOS:
        raise SitlError(
            f"no live scenario {name!r}: there are {', '.join(SCENARIOS)} ('darko-sitl scenario' runs the studies)"
        )
    return SCENARIOS[name]


class LiveScenario:
    """A guidance that flies a scenario, records it, and says how it went.

    ``complete`` once the duration is over; then ``flown`` and ``figures`` are what the fast run gives.
    """

    landing = False

    def __init__(self, scenario: Scenario, craft: Craft) -> None:
        self.scenario = scenario
        self.complete = self.interrupted = False
        self._track: Track | None = None
        self.figures: list[Figure] = []
        self._craft = craft
        self._asks = sorted(scenario.asks)
        self._reference = hover_at((0.0, 0.0, ALOFT), scenario.start.heading, scenario.speed)
        self._samples: list[Recording] = []
        self._asked_at = -1  # step of the last tick
        self._steps = whole_periods(whole_samples(scenario.duration))
        self._began = time.perf_counter()
        self._bindings = craft.bindings

    @property
    def flown(self) -> Track:
        """What was recorded, once it is complete.

        Raises:
            SitlError: If it is not.
        """
        if self._track is None:
            raise SitlError(f"scenario {self.scenario.name} is not complete")
        return self._track

    # What the autopilot asks

    def update(self, view: View) -> Reference:
        """The reference of this tick; takes the asks that are due, the wind's as well."""
        vehicle = self._craft.vehicle
        if self._asked_at < 0:
            self._begin()
        self._asked_at = vehicle.periods
        if self._changed():
            self._interrupt(view.time, "a parameter was changed")
        elif vehicle.periods >= self._steps:
            self._end()
        else:
            while self._asks and self._asks[0].time <= vehicle.time + 1e-9:
                self._take(self._asks.pop(0))
            vehicle.reference = self._reference
            vehicle.advance(0)  # samples are taken after the jumps of their instant, as in a recording
            self._samples.append(vehicle.sample())
        return self._reference

    def done(self, view: View) -> bool:  # noqa: ARG002 - a scenario ends by its duration
        """Never: the end is a hold."""
        return False

    def look(self) -> None:
        """Notice that the autopilot flies something else; to be called after each of its ticks."""
        flying = not (self.complete or self.interrupted)
        if flying and self._asked_at != self._craft.vehicle.periods:
            self._interrupt(self._craft.vehicle.time, "the autopilot was told otherwise", hold=False)

    # Inside

    def _begin(self) -> None:
        self._began = time.perf_counter()
        self._say(NOTICE, f"Scenario {self.scenario.name}: {self.scenario.duration:g} s, origin {ALOFT:g} m up")

    def _take(self, ask: Ask) -> None:
        if ask.target is not None:
            self._reference = next_reference(self._reference, ask.target, ask.airspeed)
        if ask.wind is not None:
            self._craft.vehicle.set_wind(ask.wind)
            self._craft.bindings = self._bindings = _with_wind(self._craft.bindings, ask.wind)
        self._say(INFO, "; ".join(_words(ask)))

    def _changed(self) -> bool:
        bound = self._craft.bindings
        return (bound.tuning, bound.world) != (self._bindings.tuning, self._bindings.world)

    def _interrupt(self, now: float, why: str, *, hold: bool = True) -> None:
        self.interrupted = True
        self._say(WARNING, f"Scenario {self.scenario.name} ended at {now:.1f} s: {why}")
        if hold:
            self._craft.autopilot.hold()

    def _end(self) -> None:
        self.complete = True
        jumps = tuple(self._craft.vehicle.jumps)
        self._track = joined(self._samples, jumps, time.perf_counter() - self._began)
        self.figures = self.scenario.figures(self._track)
        for figure in self.figures:
            self._say(INFO if figure.holds else WARNING, _verdict(figure))
        expected = [figure for figure in self.figures if figure.expected]
        held = sum(bool(figure.holds) for figure in expected)
        self._say(NOTICE, f"Scenario complete: {held} of {len(expected)} as expected")
        self._craft.bind(self._craft.bindings)  # from here on the vehicle flies by the parameters it shows
        self._craft.autopilot.hold()

    def _say(self, severity: int, text: str) -> None:
        self._craft.autopilot.say(severity, text)


class ScenarioCraft(Craft):
    """A craft in the air that flies a scenario, then holds."""

    def __init__(
        self,
        scenario: Scenario,
        world: World,
        *,
        seed: int = 1,
        airframe: str | None = None,
        parameters: Mapping[str, float] | None = None,
    ) -> None:
        """Put the vehicle at the scenario's start.

        Args:
            scenario: What to fly.
            world: Where the origin is.
            seed: Of the gusts.
            airframe: Parameter set or TOML file; None: the scenario's own.
            parameters: Changes to the scenario's tuning and calm air, by name.

        Raises:
            SitlError: If the airframe or a parameter is not usable.
        """
        start = scenario.start._replace(up=scenario.start.up + ALOFT, airborne=True)
        vehicle = Simulation(load(airframe or scenario.airframe).parameters, seed=seed, start=start)
        asked = Bindings(Settings(), scenario.tuning, Surroundings()).replaced(parameters or {})
        super().__init__(vehicle, world, asked, airborne=True)
        self.bindings = asked._replace(tuning=_within_bounds(asked.tuning))
        vehicle.begin_flight(scenario.law)
        self.live = LiveScenario(scenario, self)
        self.autopilot._enter(Mode.HOLD, self.live)  # noqa: SLF001 - as every manoeuvre enters

    def _decide(self) -> None:
        super()._decide()
        self.live.look()


class ScenarioNode(Node):
    """The node of a scenario: says the wind that an ask brings as the parameters that hold it, and does not reboot."""

    def advance(self, periods: int) -> None:
        """Fly, and queue what is to be told."""
        before = self.craft.bindings
        super().advance(periods)
        after = self.craft.bindings
        for entry in TABLE if after is not before else ():
            if after.value(entry.name) != before.value(entry.name):
                self._endpoint.set_parameter(entry.name, after.value(entry.name))

    def _leave(self, event: CommandRequested) -> Outcome:  # noqa: ARG002 - whatever is asked
        return Outcome(mavlink.MAV_RESULT_DENIED, "A scenario is begun and stopped from its terminal")


def _within_bounds(tuning: Tuning) -> Tuning:
    """The tuning as parameters can show it: a threshold at infinity is none of their values."""
    clipped = {
        entry.field: min(max(getattr(tuning, entry.field), entry.minimum), entry.maximum)
        for entry in TABLE
        if entry.group == "tuning"
    }
    return tuning._replace(**clipped)


def _with_wind(bindings: Bindings, wind: Point) -> Bindings:
    """The parameters that say this wind, so that a change of another one does not end it."""
    speed, come_from = _wind(wind)
    return bindings._replace(world=bindings.world._replace(wind_speed=speed, wind_direction=come_from))


def _wind(wind: Point) -> tuple[float, float]:
    """Level speed [m/s] of an air velocity (world NWU), and where it comes from, clockwise from north [deg]."""
    return math.hypot(wind[0], wind[1]), math.degrees(math.atan2(wind[1], -wind[0])) % 360.0


def _words(ask: Ask) -> list[str]:
    words = []
    if ask.target is not None:
        north, west, up = ask.target
        way = "" if ask.airspeed is None else f" on the wing, {ask.airspeed:g} m/s"
        words.append(f"Target [{north:g}, {west:g}, {up:g}]{way}")
    if ask.wind is not None:
        words.append("Wind {:.3g} m/s from {:.0f} deg".format(*_wind(ask.wind)))
    return words


def _verdict(figure: Figure) -> str:
    text = f"{figure.name}: {figure.value:.3g} {figure.unit}".rstrip()
    if not figure.expected:
        return text
    return f"{'ok' if figure.holds else 'MISSED'}, {text} ({figure.expected})"
