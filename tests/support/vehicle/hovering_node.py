"""A vehicle on the link, hovering in gusts, with a stored mission and a stored parameter."""

from protocol.plans import load
from sitl.mavlink.node import Node
from sitl.tools.persistence import StateFolder
from sitl.vehicle.parameters import WorldSettings
from tests.support.paths import DATA
from tests.support.vehicle.fake_station import PEER, make_aircraft


def hovering(folder) -> Node:
    aircraft = make_aircraft(up=3.0, seed=4, world_settings=WorldSettings(gusts=0.5))
    state_folder = StateFolder(folder)
    state_folder.save_mission(load(DATA / "square.plan").items)
    state_folder.save_parameters({"SIM_WIND_SPD": 1.0})
    return Node(aircraft, state_folder, [PEER])
