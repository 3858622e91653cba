"""Closed loops whose plant is integrated anew: nearly exactly by DOP853, or in steps of another length.

``python -m tests.support.flights.exact_plant`` prints how far flights are from exact ones, as docs/model.md says.
"""

from itertools import pairwise

import numpy as np
from scipy.integrate import ode

from sitl.compiled import entry
from sitl.estimation.sensing import observe
from sitl.lab.scenarios import ORIGIN_HEIGHT, SCENARIOS, next_reference
from sitl.model.actuators import limited, moved
from sitl.model.airframe_files import load
from sitl.model.ground import feet_aloft
from sitl.model.plant import derivative, step
from sitl.model.quaternions import Quaternion, normalised
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector, scaled, subtract
from sitl.sensors.draws import PERIOD
from sitl.simulation.simulation import Simulation

NOMINAL = load("nominal").parameters
CALM = Vector(0.0, 0.0, 0.0)
RTOL, ATOL = 1e-10, 1e-12
FLIGHTS = {"forward-to-hover": 16.0, "hover": 6.0}  # scenarios of the report, and how much of them [s]
STEPS = (2.0, 1.0, 0.5)  # of the plant [ms]


@entry
def rates_of_change(t, x, now, wanted, a):
    """Of the body, (13,), a time after its actuators were at ``now``, (4,)."""
    body = Body(
        Vector(x[0], x[1], x[2]),
        Vector(x[3], x[4], x[5]),
        Quaternion(x[6], x[7], x[8], x[9]),
        Vector(x[10], x[11], x[12]),
    )
    begun = Actuators(now[0], now[1], now[2], now[3])
    actuators = moved(begun, Actuators(wanted[0], wanted[1], wanted[2], wanted[3]), t, a)
    p, v, q, w = derivative(body, actuators, CALM, CALM, CALM, a)
    return np.array((p.x, p.y, p.z, v.x, v.y, v.z, q.w, q.x, q.y, q.z, w.x, w.y, w.z))


@entry
def steps(plant, wanted, a, count):
    """One control period in so many steps of the plant."""
    for _ in range(count):
        plant = step(plant, wanted, CALM, True, a, PERIOD / count)
    return plant


def exactly(plant, wanted, a):
    """One control period, piece by piece between the times at which an actuator comes to rest."""
    now, goal = np.array(plant.actuators), np.array(wanted)
    rests = np.abs(goal - now) / (a.omega_rate, a.omega_rate, a.delta_rate, a.delta_rate)
    cuts = [0.0, *sorted({rest for rest in rests.tolist() if 0.0 < rest < PERIOD}), PERIOD]
    x = np.concatenate(plant.body)
    for begin, end in pairwise(cuts):
        solver = ode(rates_of_change).set_integrator("dop853", rtol=RTOL, atol=ATOL, first_step=end - begin)
        x = solver.set_f_params(now, goal, a).set_initial_value(x, begin).integrate(end)
        assert solver.successful()
    p, v, q, w = (x[first:last].tolist() for first, last in ((0, 3), (3, 6), (6, 10), (10, 13)))
    body = Body(Vector(*p), Vector(*v), normalised(Quaternion(*q)), Vector(*w))
    return Plant(body, moved(plant.actuators, wanted, PERIOD, a), feet_aloft())


def in_steps(milliseconds):
    """A mover like ``exactly``, by the plant's own step of another length."""
    count = round(1000.0 * PERIOD / milliseconds)
    return lambda plant, wanted, a: steps(plant, wanted, a, count)


def flown(name, move=None, seconds=None):
    """Positions after every period of the beginning of a scenario, (n, 3), and its jumps.

    Args:
        name: Of the scenario.
        move: Gives the plant a control period later; by default the simulation's own.
        seconds: How much of it; that of ``FLIGHTS`` by default.

    The laws, the supervisor and the estimate are the simulation's own, compiled as ever. It moves its plant as well,
    which is forgotten; but a jump may look at that plant instead, a single step away from the one put in its place.
    """
    scenario = SCENARIOS[name]
    start = scenario.start._replace(up=scenario.start.up + ORIGIN_HEIGHT, airborne=True)
    simulation = Simulation(NOMINAL, start=start, tuning=scenario.tuning)
    simulation.begin_flight(scenario.law)
    begun, event = scenario.first_reference(), scenario.events[0]
    assert event.target is not None
    simulation.reference = next_reference(begun, event.target, event.airspeed)
    positions = []
    for _ in range(round((seconds or FLIGHTS[name]) / PERIOD)):
        before = None if move is None else simulation.flight
        simulation.advance(1)
        if before is not None:
            wanted = limited(before.controller.command, before.controller.is_armed, NOMINAL)
            put(simulation, before.plant, move(before.plant, wanted, NOMINAL))
        positions.append(simulation.truth.body.position)
    return np.array(positions), [(jump.name, jump.time) for jump in simulation.jumps]


def put(simulation, before, plant):
    """Put a plant in the place of the simulation's own, as it does itself."""
    flight = simulation.flight
    acceleration = scaled(subtract(plant.body.velocity, before.body.velocity), 1.0 / PERIOD)
    estimate = observe(plant, acceleration, flight.estimate.wind, False)
    simulation._arrays.flight = flight._replace(plant=plant, estimate=estimate)


def farthest(one, other):
    """The greatest distance between two flights [mm]."""
    return 1000.0 * float(np.linalg.norm(one - other, axis=1).max())


def main():
    """Print the errors at several steps."""
    for name, seconds in FLIGHTS.items():
        exact, jumps = flown(name, exactly)
        for length in STEPS:
            positions, others = flown(name, in_steps(length))
            said = "same jumps" if jumps == others else f"other jumps: {others} for {jumps}"
            print(f"{name}, {seconds:g} s: {length:g} ms: {farthest(positions, exact):.2g} mm, {said}")


if __name__ == "__main__":
    main()
