"""A tenth of a second under each law, ground and gusts included, and a hash of every bit: also a process of its own."""

import hashlib
import json

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl.control.reference import AttitudeReference, along, circle, hover_at, leg, steer
from sitl.enclosure.arena_files import Arena, Obstacle, WindWall, outlet_of
from sitl.model.airframe_files import load
from sitl.model.quaternions import from_euler, hover
from sitl.model.state import Body
from sitl.model.vectors import Vector
from sitl.simulation.simulation import Simulation
from sitl.simulation.situation import governor
from sitl.simulation.start import Start
from sitl.simulation.tuning import CONTROLLERS, Tuning
from tests.support.flights.tunings import BY_REPORT, EVERY_LAW

NOMINAL = load("nominal").parameters
SECONDS = 0.12
TO_REST = 0.32  # until the ground is felt for long enough
DWELT = 0.45  # nearly as long as the laws must dwell [s]
UP = 60.0  # [m]
STILL = Vector(0.0, 0.0, 0.0)
BY_INCREMENTS = Tuning(controller=CONTROLLERS["indi"])
BY_OUTPUTS = Tuning(controller=CONTROLLERS["robust-pi"])
FORWARD = from_euler(0.02, -0.25, 0.03)
ON_A_LEG = along(hover_at((0.0, 0.0, UP), 0.3), leg((0.0, 1.0, UP), (90.0, 0.0, UP + 5.0), 13.0, low=1.0), 0.1)
ROUND = along(hover_at((0.0, 0.0, UP), 0.3), circle((0.0, 40.0, UP), 40.0, 12.0), 0.0)
TILTED = AttitudeReference(from_euler(0.1, -1.2, 0.2), Vector(0.1, 0.0, 0.2), 0.5)


def begun(
    law, reference, *, v=STILL, q=None, w=STILL, wind=(1.0, -0.5, 0.2), gusts=0.7, law_time=0.0, tuning=EVERY_LAW
):
    """A simulation in the air, for some time under a law."""
    made = Simulation(NOMINAL, seed=3, start=Start(up=UP, airborne=True), tuning=tuning)
    made.place(Body(Vector(0.0, 0.0, UP), v, hover(0.2) if q is None else q, w))
    made.begin_flight(law)
    made._arrays.flights["controller"]["law_time"] = law_time
    made.set_wind(wind, gusts)
    made.reference = reference
    return made


def standing():
    """On the ground, about to take off."""
    made = Simulation(NOMINAL, seed=4, start=Start(heading=0.4), tuning=BY_REPORT)
    made.set_wind((2.0, 1.0, 0.0), 0.5)
    made.armed = made.flying = True
    made.reference = hover_at((0.5, 0.0, 3.0), 0.0)
    return made


def touching_down():
    """Just above the ground, sinking."""
    made = Simulation(NOMINAL, seed=4, start=Start(up=0.002), tuning=BY_REPORT)
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.place(made.truth.body._replace(velocity=Vector(0.05, 0.02, -0.1), rates=Vector(0.1, 0.2, 0.0)))
    made.landing = True
    made.reference = hover_at((0.0, 0.0, -1.0), 0.0)
    return made


def fallen():
    """On its way into the ground, nose down."""
    made = begun(Law.CRASHED, hover_at((0.0, 0.0, UP), 0.0))
    made.place(Body(Vector(0.0, 0.0, 0.5), Vector(2.0, 1.0, -11.0), from_euler(0.2, 1.2, 0.1), Vector(1.0, 0.5, -0.5)))
    return made


def in_a_jet():
    """At the edge of a wind wall's jet, in a gust of it and in turbulence of the open air."""
    made = begun(Law.HOVER_ZERO_MOMENT, hover_at((0.0, 1.2, UP), 0.2))
    outlet = outlet_of(4.0, 0.0, UP, 3.0, 3.0, 2.5)
    made.surroundings.put_wall(WindWall(outlet, 0.1, 0.3, ((0.0, 2.0), (0.1, 4.0)), ((0.02, 0.3, 2.0),)))
    made.surroundings.set_open_air(6.0)
    return made


def into_a_net():
    """On its way into a net that hangs in the wind wall's jet."""
    made = in_a_jet()
    net = Obstacle("net", False, 0.4, 0.0, 0.3, 0.02, 3.0, 0.0, 2.0 * UP)
    made.surroundings.enclose(Arena("room", 20.0, 20.0, 2.0 * UP, has_net=True, obstacles=(net,)))
    made.place(made.truth.body._replace(velocity=Vector(4.0, 0.2, 0.1)))
    return made


def flights():
    """Flights of the digest, by name."""
    fast = Vector(12.5, 0.3, 0.2)
    return {
        "hover linear": begun(Law.HOVER_LINEAR, hover_at((2.0, -1.0, UP + 1.0), 0.4)),
        "zero moment": begun(Law.HOVER_ZERO_MOMENT, hover_at((40.0, 10.0, UP), 1.0), q=from_euler(0.3, -0.9, 0.2)),
        "into the linear law": begun(Law.HOVER_ZERO_MOMENT, hover_at((0.2, 0.1, UP), 0.2), gusts=0.0),
        "alignment": begun(Law.ALIGN, ON_A_LEG, gusts=0.0, q=hover(0.0), law_time=DWELT),
        "transition": begun(Law.TO_FORWARD, ON_A_LEG, v=Vector(5.0, 0.2, 0.5), q=from_euler(0.0, -0.9, 0.0)),
        "cruise": begun(Law.FORWARD_LINE_OF_SIGHT, ON_A_LEG, v=fast, q=FORWARD, law_time=DWELT),
        "circle": begun(Law.FORWARD_LINE_OF_SIGHT, ROUND, v=fast, q=FORWARD),
        "cruise linear": begun(Law.FORWARD_LINEAR, ON_A_LEG, v=Vector(13.2, -0.2, 0.6), q=FORWARD, gusts=0.1),
        "braking": begun(Law.TO_HOVER, ON_A_LEG._replace(forward=False), v=Vector(7.0, 0.1, 1.0), q=FORWARD),
        "failsafe": begun(Law.FAILSAFE, ON_A_LEG, v=Vector(2.0, 1.0, -16.0), q=from_euler(1.0, -0.5, 0.0)),
        "attitude": begun(Law.HOVER_ATTITUDE, steer(hover_at((0.0, 0.0, UP), 0.0), TILTED)),
        "by increments": begun(Law.INDI, ON_A_LEG, v=fast, q=FORWARD, tuning=BY_INCREMENTS),
        "by outputs": begun(Law.ROBUST_PI, hover_at((0.5, -0.3, UP + 0.5), 0.2), tuning=BY_OUTPUTS),
        "crash": fallen(),
        "take-off": standing(),
        "touch-down": touching_down(),
        "jet": in_a_jet(),
        "net": into_a_net(),
    }


RECORDED = ("position", "velocity", "attitude", "rates", "actuators", "law", "v_hover", "energy", "wind", "pointing")


def digest(simulation):
    """Hash over a recorded flight, its jumps and its end."""
    rows = simulation.record(TO_REST if simulation.landing else SECONDS, 50.0)
    found = hashlib.sha256(simulation._arrays.flights.tobytes())
    for name in RECORDED:
        found.update(np.ascontiguousarray(getattr(rows, name)).tobytes())
    found.update(repr([(*jump[:5], jump.v.hex()) for jump in simulation.jumps]).encode())
    found.update(repr((simulation.v_hover, governor(simulation), simulation.diagnostics)).encode())
    return found.hexdigest()


def digests():
    """Hash and jumps of every flight, by name."""
    return {name: [digest(made), [jump.name for jump in made.jumps]] for name, made in flights().items()}


if __name__ == "__main__":
    print(json.dumps(digests()))
