"""A vehicle on the wire, hovering in gusts, with a mission and a parameter that are kept."""

from protocol.frames import Geodetic, LocalFrame
from protocol.plans import load
from sitl.airframe import load as load_airframe
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft
from sitl.memory import Memory
from sitl.parameters import Bindings, Surroundings
from sitl.simulation.simulation import Simulation, Start, Tuning
from sitl.wire.node import Node
from tests.support.paths import DATA

STEP = 0.02  # [s] between looks at the link
GROUND = "ground"


def hovering(folder) -> Node:
    vehicle = Simulation(load_airframe("nominal").parameters, seed=4, start=Start(up=3.0, airborne=True))
    bindings = Bindings(Settings(), Tuning(), Surroundings(gusts=0.5))
    world = World(LocalFrame(Geodetic(43.5648, 1.4811, 150.0)), ARENAS["open"])
    memory = Memory(folder)
    memory.keep_mission(load(DATA / "square.plan").items)
    memory.keep_parameters({"SIM_WIND_SPD": 1.0})
    return Node(Craft(vehicle, world, bindings, airborne=True), memory, [GROUND])
