"""A scenario flown live: its events become the guidance of the autopilot in the vehicle process.

The autopilot asks its guidance once per tick of 20 ms, the same instants at which the fast run looks at its events, so
both fly the same trajectory. A ground station sees a vehicle in HOLD with the usual telemetry, and a line of text at
the start, at each event and for every finding at the end. The pilot stays in command: a request that gives the
autopilot something else to fly ends the scenario, and so does a change of the controller's or the world's parameters.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Mapping

from protocol.dialect import mavlink
from protocol.names import Mode
from sitl import (
    Aircraft,
    Configuration,
    Navigation,
    Recording,
    Reference,
    Settings,
    Simulation,
    SitlError,
    WorldSettings,
    load_airframe,
)
from sitl.autopilot.world import World
from sitl.control.reference import Point
from sitl.guidance.view import VehicleView
from sitl.lab.scenarios import (
    ORIGIN_HEIGHT,
    SCENARIOS,
    Finding,
    Scenario,
    ScenarioEvent,
    Track,
    joined,
    next_reference,
    whole_samples,
)
from sitl.simulation.start import whole_periods
from sitl.vehicle.parameters import within_bounds

NOTICE, INFO, WARNING = mavlink.MAV_SEVERITY_NOTICE, mavlink.MAV_SEVERITY_INFO, mavlink.MAV_SEVERITY_WARNING


def named(name: str) -> Scenario:
    """The scenario of a name.

    Raises:
        SitlError: If there is no scenario of that name.
    """
    if name not in SCENARIOS:
        raise SitlError(
            f"no live scenario {name!r}: there are {', '.join(SCENARIOS)} (others: 'darko-sitl study scenario')"
        )
    return SCENARIOS[name]


class LiveScenario:
    """A guidance that flies a scenario, records it, and reports its findings.

    ``complete`` once the duration is over; then ``flown`` and ``findings`` are those of the fast run.
    """

    landing = False

    def __init__(self, scenario: Scenario, aircraft: Aircraft) -> None:
        self.scenario = scenario
        self.complete = self.interrupted = False
        self._track: Track | None = None
        self.findings: list[Finding] = []
        self._aircraft = aircraft
        self._events = sorted(scenario.events)
        self._reference = scenario.first_reference()
        self._samples: list[Recording] = []
        self._updated_at = -1  # control period of the last update
        self._duration = whole_periods(whole_samples(scenario.duration))  # in control periods
        self._began = time.perf_counter()
        self._configuration = aircraft.configuration

    @property
    def flown(self) -> Track:
        """The recorded track, once it is complete.

        Raises:
            SitlError: If it is not.
        """
        if self._track is None:
            raise SitlError(f"scenario {self.scenario.name} is not complete")
        return self._track

    # Called by the autopilot

    def update(self, view: VehicleView) -> Reference:
        """The reference of this tick; applies the events that are due, of the wind as well."""
        vehicle = self._aircraft.vehicle
        if self._updated_at < 0:
            self._begin()
        self._updated_at = vehicle.periods
        if self._changed():
            self._interrupt(view.time, "a parameter was changed")
        elif vehicle.periods >= self._duration:
            self._end()
        else:
            while self._events and self._events[0].time <= vehicle.time + 1e-9:
                self._apply(self._events.pop(0))
            vehicle.reference = self._reference
            vehicle.advance(0)  # samples are taken after the jumps of their instant, as in a recording
            self._samples.append(vehicle.sample())
        return self._reference

    def done(self, view: VehicleView) -> bool:  # noqa: ARG002 - a scenario ends by its duration
        """Never: it ends with a hold."""
        return False

    def look(self) -> None:
        """Notice that the autopilot flies something else; to be called after each of its ticks."""
        flying = not (self.complete or self.interrupted)
        if flying and self._updated_at != self._aircraft.vehicle.periods:
            self._interrupt(self._aircraft.vehicle.time, "another request was accepted", hold=False)

    # Inside

    def _begin(self) -> None:
        self._began = time.perf_counter()
        self._say(NOTICE, f"Scenario {self.scenario.name}: {self.scenario.duration:g} s, origin {ORIGIN_HEIGHT:g} m up")

    def _apply(self, event: ScenarioEvent) -> None:
        if event.target is not None:
            self._reference = next_reference(self._reference, event.target, event.airspeed)
        if event.wind is not None:
            self._aircraft.vehicle.set_wind(event.wind)
            self._aircraft.configuration = self._configuration = _with_wind(self._aircraft.configuration, event.wind)
        self._say(INFO, "; ".join(_describe(event)))

    def _changed(self) -> bool:
        now = self._aircraft.configuration
        return (now.tuning, now.world) != (self._configuration.tuning, self._configuration.world)

    def _interrupt(self, now: float, why: str, *, hold: bool = True) -> None:
        self.interrupted = True
        self._say(WARNING, f"Scenario {self.scenario.name} ended at {now:.1f} s: {why}")
        if hold:
            self._aircraft.autopilot.guided.hold()

    def _end(self) -> None:
        self.complete = True
        jumps = tuple(self._aircraft.vehicle.jumps)
        self._track = joined(self._samples, jumps, time.perf_counter() - self._began)
        self.findings = self.scenario.findings(self._track)
        for finding in self.findings:
            self._say(INFO if finding.holds else WARNING, _verdict(finding))
        expected = [finding for finding in self.findings if finding.expected]
        as_expected = sum(bool(finding.holds) for finding in expected)
        self._say(NOTICE, f"Scenario complete: {as_expected} of {len(expected)} as expected")
        self._aircraft.configure(self._aircraft.configuration)  # from here on the parameters it shows are in force
        self._aircraft.autopilot.guided.hold()

    def _say(self, severity: int, text: str) -> None:
        self._aircraft.autopilot.say(severity, text)


class ScenarioAircraft(Aircraft):
    """An aircraft in the air that flies a scenario, then holds."""

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
            parameters: Changes to the scenario's tuning and calm air, by parameter name.

        Raises:
            SitlError: If the airframe or a parameter is not usable.
        """
        airframe_parameters = load_airframe(airframe or scenario.airframe).parameters
        vehicle = Simulation(airframe_parameters, seed=seed, start=scenario.start_in_air())
        asked = Configuration(Settings(), scenario.tuning, WorldSettings()).replaced(parameters or {})
        super().__init__(vehicle, world, asked, airborne=True)
        self.configuration = asked._replace(tuning=within_bounds(asked.tuning))
        vehicle.begin_flight(scenario.law)
        scenario.put_wall(vehicle)
        self.live = LiveScenario(scenario, self)
        self.autopilot.fly(Mode.HOLD, self.live)

    def _decide(self) -> None:
        super()._decide()
        self.live.look()


def scenario_aircraft(args: argparse.Namespace, world: World, parameters: Mapping[str, float]) -> ScenarioAircraft:
    """The aircraft of ``darko-sitl run --scenario``; no stored parameter is used: one flight for everyone.

    Args:
        args: Of the command.
        world: Where the origin is.
        parameters: Those that the command line sets.

    Raises:
        SitlError: If an argument is not of scenarios.
    """
    if world.arena.has_net:
        raise SitlError(f"--arena: scenario {args.scenario} does not fly under a net")
    if args.start is not None:
        raise SitlError(f"--start: scenario {args.scenario} has its own start")
    if args.sensors is not None or args.mocap is not None or args.nav not in {None, Navigation.TRUTH.value}:
        option = (
            "--nav" if args.nav not in {None, Navigation.TRUTH.value} else "--sensors" if args.sensors else "--mocap"
        )
        raise SitlError(f"{option}: scenarios fly on the exact state, as the report's experiments do")
    return ScenarioAircraft(named(args.scenario), world, seed=args.seed, airframe=args.airframe, parameters=parameters)


def _with_wind(configuration: Configuration, wind: Point) -> Configuration:
    """The configuration with the parameters of this wind, so that a change of another parameter does not end it."""
    speed, come_from = _wind(wind)
    return configuration._replace(world=configuration.world._replace(wind_speed=speed, wind_direction=come_from))


def _wind(wind: Point) -> tuple[float, float]:
    """Horizontal speed [m/s] of an air velocity (world NWU), and where it comes from, clockwise from north [deg]."""
    return math.hypot(wind[0], wind[1]), math.degrees(math.atan2(wind[1], -wind[0])) % 360.0


def _describe(event: ScenarioEvent) -> list[str]:
    texts = []
    if event.target is not None:
        north, west, up = event.target
        forward = "" if event.airspeed is None else f" in forward flight at {event.airspeed:g} m/s"
        texts.append(f"Target [{north:g}, {west:g}, {up:g}]{forward}")
    if event.wind is not None:
        texts.append("Wind {:.3g} m/s from {:.0f} deg".format(*_wind(event.wind)))
    return texts


def _verdict(finding: Finding) -> str:
    text = f"{finding.name}: {finding.value:.3g} {finding.unit}".rstrip()
    if not finding.expected:
        return text
    return f"{'ok' if finding.holds else 'MISSED'}, {text} ({finding.expected})"
