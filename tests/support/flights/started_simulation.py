"""Simulations that have begun: hovering in gusts, standing on the ground, in forward flight."""

from protocol.dialect.vocabulary import Law
from sitl.control.reference import along, hover_at, leg
from sitl.model.airframe_files import load
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from tests.support.flights.tunings import BY_REPORT

NOMINAL = load("nominal").parameters
UP = 50.0  # [m]


def vehicle(seed=1, gusts=1.0, airframe=NOMINAL, design_model=None, tuning=BY_REPORT):
    """Hovering in wind and gusts, on its way to a point."""
    start = Start(up=UP, airborne=True)
    made = Simulation(airframe, seed=seed, start=start, design_model=design_model, tuning=tuning)
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.set_wind((1.0, 0.5, 0.0), gusts)
    made.reference = hover_at((2.0, 1.0, UP), 0.5, 3.0)
    return made


def standing():
    """On the ground, armed, about to take off."""
    made = Simulation(NOMINAL, tuning=BY_REPORT)
    made.armed = made.flying = True
    made.reference = hover_at((0.0, 0.0, 2.0), 0.0)
    return made


def in_forward_flight():
    """Asked to fly a leg forward."""
    made = vehicle()
    made.reference = along(made.reference, leg((0.0, 0.0, UP), (300.0, 0.0, UP), 15.0), 0.0)
    return made


def state(simulation):
    """Everything, to the bit, but the limits met in the last call."""
    record = simulation._arrays.flights.copy()
    record["limits"] = 0
    return simulation.flight._replace(limits=0), simulation.jumps, record.tobytes()
