"""Aircraft that hover in an arena of a test's own, flown tick by tick."""

from protocol.frames import LocalFrame
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import World
from sitl.defaults import HOME
from sitl.enclosure.arena_files import Arena, Obstacle
from sitl.model.airframe_files import load
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration

CAGE = Arena("cage", 5.0, 5.0, 7.0, has_net=True, margin=1.2)
FIELD = Arena("field", 1500.0, 1500.0, 1500.0)
PILLAR = Obstacle("pillar", True, 0.0, 0.0, 0.0, 0.3, 0.3, 0.0, 7.0)


class EnclosedFlight:
    """An aircraft that hovers, on the exact state.

    Args:
        arena: Where.
        at: World NWU [m].
        parameters: Changes, by parameter name.
    """

    def __init__(self, arena=CAGE, at=(0.0, 0.0, 2.0), **parameters):
        north, west, up = at
        vehicle = Simulation(load("collage").parameters, start=Start(north, west, up, airborne=True))
        configuration = Configuration(Settings(), vehicle.tuning).replaced(parameters)
        self.aircraft = Aircraft(vehicle, World(LocalFrame(HOME), arena), configuration, airborne=True)
        self.autopilot, self.vehicle = self.aircraft.autopilot, vehicle
        self.texts, self.gap, self.room = [], float("inf"), float("inf")

    def fly(self, seconds, until=lambda: False, each=lambda: None):
        """Fly on, noting texts and the least distances of the truth from obstacles and from everything."""
        for _ in range(round(seconds / 0.02)):
            each()
            self.aircraft.advance(10)
            place, arena = self.vehicle.truth.body.position, self.autopilot.world.arena
            self.gap = min([self.gap, *(obstacle.gap(place) for obstacle in arena.obstacles)])
            self.room = min(self.room, arena.room(place)[0])
            self.texts += [notice.text for notice in self.autopilot.notices()]
            if until() or self.vehicle.crash is not None:
                break
        return self

    @property
    def place(self):
        """Position of the vehicle."""
        return self.vehicle.truth.body.position
