"""``python -m tests.support.kernels``: compile what flies, unless it is kept, before several processes need it."""

from sitl.process.warm_up import first_start, make_ready
from sitl.simulation.simulation import Simulation
from sitl.tools.kernel_cache import is_complete
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration
from tests.support.flights.recorded_flight import NOMINAL, WORLD

if __name__ == "__main__" and not is_complete():
    with first_start() as helper:
        make_ready(Aircraft(Simulation(NOMINAL), WORLD, Configuration()), print, helper)
