"""A vehicle that flies a flight plan, headless and as fast as it can."""

import numpy as np

from protocol.flight_plans.flight_plan import FlightPlan
from protocol.flight_plans.plan_check import check_flown
from protocol.frames import Geodetic, LocalFrame
from protocol.names import Mode
from sitl.autopilot.flight_plan.aims import BlockEntered, ExceptionFired, PlanEvent
from sitl.autopilot.settings import Settings
from sitl.autopilot.watches import LinkSilence
from sitl.autopilot.world import ARENAS, World
from sitl.model.airframe import Array
from sitl.model.airframe_files import load
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS, Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings


class PlannedFlight:
    """One flight of a plan from the ground.

    Args:
        plan: The plan.
        mapping: What names of a build mean.
        arena: Where it flies.
        settings: Of the autopilot.
        up: Begin hovering so high [m]; 0: on the ground.
    """

    def __init__(self, plan: FlightPlan, *, mapping=None, arena="voliere", settings=None, up=0.0, world_settings=None):
        vehicle = Simulation(
            load("nominal").parameters, start=Start(up=up, airborne=up > 0.0), navigation=Navigation.TRUTH
        )
        world = World(LocalFrame(Geodetic(plan.lat0, plan.lon0, plan.ground_alt)), ARENAS[arena])
        configuration = Configuration(settings or Settings(), Tuning(), world_settings or WorldSettings())
        self.aircraft = Aircraft(vehicle, world, configuration, airborne=up > 0.0)
        self.autopilot = self.aircraft.autopilot
        self.plan = self.autopilot.flight_plan
        self.plan.load(check_flown(plan, mapping), mapping)
        if up > 0.0:
            self.plan.jump_to_block(0)
        assert self.autopilot.set_mode(Mode.FLIGHT_PLAN).accepted
        self.positions: list[Array] = []
        self.blocks: list[str] = []
        self.events: list[PlanEvent] = []
        self.notices: list[str] = []
        self.forward: list[bool] = []

    @property
    def time(self):
        return self.aircraft.vehicle.time

    @property
    def block(self):
        status = self.plan.status()
        assert status is not None
        return status.block_name

    @property
    def p(self):
        """Position of the vehicle: east, north and up."""
        north, west, up = self.autopilot.view.p
        return np.array([-west, north, up])

    def silence(self, seconds):
        """Let the ground station be silent for so long."""
        self.autopilot.failsafes.silence = LinkSilence(ground=seconds)

    def advance(self, seconds):
        for _ in range(round(seconds / 0.02)):
            self.aircraft.advance(AUTOPILOT_PERIODS)
            self.positions.append(self.p)
            self.forward.append(self.autopilot.view.forward)
            self.notices += [notice.text for notice in self.autopilot.notices()]
            for event in self.plan.take_events():
                self.events.append(event)
                if isinstance(event, BlockEntered):
                    self.blocks.append(event.name)

    def advance_until(self, condition, limit):
        """Fly until a condition holds; fails if it does not within so many seconds."""
        for _ in range(round(limit / 0.1)):
            if condition():
                return
            self.advance(0.1)
        raise AssertionError(f"not within {limit} s: {self.plan.status()}, at {self.p}, {self.notices[-5:]}")

    def wait_for_block(self, name, limit):
        self.advance_until(lambda: self.block == name, limit)

    def go_to_block(self, name):
        answer = self.plan.jump_to_block(name)
        assert answer.accepted, answer.text

    @property
    def fired(self):
        """Exceptions that ended a block: from and to."""
        return [(event.from_block, event.to_block) for event in self.events if isinstance(event, ExceptionFired)]
