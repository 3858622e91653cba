"""Speed of the flight core beside its own bare plant, JSBSim and plain Python, in one run.

``python scripts/bench/core.py [--quick] [--airframe SET] [--runs N]`` prints one table of plant steps a second and
ratios, as medians over interleaved runs: single flights by law, a mission through all regimes, batches, vectors of
environments for agents (``step``, and the compiled call in it), the plant alone, JSBSim's c172x at 1 kHz with its
logging off, the same loop in plain Python, and how long starts take. What flies on one core is timed by processor time,
so that other work on the machine counts less.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl import Navigation, Simulation, SitlError, Start, along, fly_batch, hover_at, leg, load_airframe
from sitl.compiled import entry
from sitl.control.reference import Reference
from sitl.lab.scenarios import SCENARIOS, fly
from sitl.model.airframe import Airframe
from sitl.model.battery import drawn_power
from sitl.model.plant import inflow, step
from sitl.model.state import Actuators, Plant
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.simulation.flight import SUBSTEPS
from sitl.storage import record_of, value_of, writer

STEP = 1e-3
put_plant = writer(Plant, lambda plant: plant)


class Row(NamedTuple):
    """One line of the table: a name and plant steps a second."""

    name: str
    measure: Callable[[], float]


@entry
def plant_only(plants: Any, airframes: Any, command: Actuators, wind: Vector, periods: int) -> float:  # noqa: ANN401
    """The plant without a law, all steps in one call; gives the energy that its battery has given up [J].

    As in the flight loop, the battery is asked once in a control period of two steps.
    """
    plant, a, energy = value_of(plants[0]), value_of(airframes[0]), 0.0
    for _ in range(periods):
        plant = step(plant, command, wind, True, a, STEP)
        plant = step(plant, command, wind, True, a, STEP)
        energy += drawn_power(plant.actuators, inflow(plant.body, wind), a) * PERIOD
    put_plant(plants[0], plant)
    return energy


def hovering(
    airframe: Airframe, law: Law, seed: int = 1, north: float = 0.0, navigation: Navigation = Navigation.TRUTH
) -> Simulation:
    """A simulation in the air under a law."""
    made = Simulation(airframe, seed=seed, start=Start(up=200.0, airborne=True), navigation=navigation)
    made.begin_flight(law)
    made.reference = hover_at((north, 0.0, 200.0), 0.0)
    return made


def rate(work: Callable[[], object], steps: float, clock: Callable[[], float] = time.process_time) -> float:
    """Plant steps a second of some work."""
    began = clock()
    work()
    return steps / (clock() - began)


def bare_plant(airframe: Airframe, steps: int) -> Row:
    """The plant alone, from a hover so high that it never meets the ground."""
    high = Simulation(airframe, start=Start(up=1e7, airborne=True))
    plants, airframes = record_of(Plant, high.truth), record_of(Airframe, airframe)
    command, wind = high.truth.actuators, Vector(0.1, 0.0, 0.0)
    periods = steps // SUBSTEPS
    return Row("plant alone", lambda: rate(lambda: plant_only(plants, airframes, command, wind, periods), steps))


def single(
    airframe: Airframe,
    name: str,
    law: Law,
    reference: Reference | None,
    seconds: float,
    wind: float = 0.0,
    navigation: Navigation = Navigation.TRUTH,
) -> Row:
    """One flight under one law, recorded at 50 Hz."""

    def measure() -> float:
        made = hovering(airframe, law, navigation=navigation)
        made.set_wind((-wind, 0.0, 0.0), 0.0)
        if reference is not None:
            made.reference = reference
        return rate(lambda: made.record(seconds), seconds / STEP)

    return Row(name, measure)


def mission(airframe: Airframe) -> Row:
    """Hover, transition, cruise, stop, hover: the scenario forward-to-hover."""
    scenario = SCENARIOS["forward-to-hover"]
    return Row(
        "hover, wing, hover (scenario forward-to-hover)",
        lambda: scenario.duration / STEP / fly(scenario, airframe=airframe).wall_time,
    )


def batch(airframe: Airframe, name: str, flights: int, seconds: float, threads: int) -> Row:
    """Many flights from up to 5 m off, each with its own seed: zero-moment law, then the linear one."""

    def measure() -> float:
        made = [hovering(airframe, Law.HOVER_ZERO_MOMENT, seed, 5.0 * seed / flights) for seed in range(flights)]
        return rate(lambda: fly_batch(made, seconds, threads=threads), flights * seconds / STEP, time.perf_counter)

    return Row(name, measure)


def environments(observe: str, count: int, steps: int) -> list[Row]:
    """A vector of environments by random body rates, resets included, and its compiled call; none without gymnasium."""
    try:
        from sitl.gym.environments import DarkoVectorEnv  # noqa: PLC0415 - gymnasium may be missing
    except SitlError:
        return []
    env = DarkoVectorEnv(count, "Hover", observe=observe, actions="rates")
    env.reset(seed=1)
    batch, random = env.batch, np.random.default_rng(1)
    flown = count * batch.options.periods * SUBSTEPS

    def stepped() -> float:
        drawn, moved = random.uniform(-0.2, 0.2, (steps, count, 4)), 0.0
        began = time.process_time()
        for actions in drawn:
            env.step(actions)
            moved += float(batch.outcome.flies.mean())
        return moved * flown / (time.process_time() - began)

    def compiled() -> float:
        env.reset()
        batch.outcome.flies[:] = True
        actions = np.zeros((count, 4))

        def fly() -> None:
            for _ in range(steps):
                batch.fly(actions, batch.options.periods)

        return rate(fly, steps * flown)

    return [Row(f"{count} environments, {observe}", stepped), Row(f"  their compiled call, {observe}", compiled)]


def jsbsim(steps: int) -> Row | None:
    """JSBSim's c172x, open loop; None where it is not installed."""
    try:
        import jsbsim as package  # noqa: PLC0415 - a development dependency
    except ImportError:
        return None
    package.FGJSBBase().debug_lvl = 0  # type: ignore[no-untyped-call]
    aircraft = package.FGFDMExec(None)
    aircraft.set_output_path(tempfile.gettempdir())
    aircraft.load_model("c172x")
    aircraft.disable_output()
    aircraft.set_dt(STEP)
    for name, value in {"ic/h-sl-ft": 5000.0, "ic/vc-kts": 100.0, "propulsion/set-running": -1.0}.items():
        aircraft[name] = value
    aircraft.run_ic()

    def work() -> None:
        for _ in range(steps):
            aircraft.run()

    return Row("JSBSim c172x, open loop", lambda: rate(work, steps))


PYTHON = """
import time
from sitl import Law, Simulation, Start, load_airframe
made = Simulation(load_airframe("{airframe}").parameters, start=Start(up=200.0, airborne=True))
made.begin_flight(Law.HOVER_LINEAR)
began = time.perf_counter()
made.step({seconds})
print({seconds} / 1e-3 / (time.perf_counter() - began))
"""
START = """
import time
began = time.perf_counter()
from sitl import Law, Simulation, load_airframe
Simulation(load_airframe("collage").parameters).warm_up()
print(time.perf_counter() - began)
"""


def other_process(code: str, **environment: str) -> float:
    """Number that a script prints."""
    done = subprocess.run(  # noqa: S603 - this interpreter, on scripts written above
        [sys.executable, "-c", code], env={**os.environ, **environment}, capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def table(rows: list[Row], runs: int) -> dict[str, float]:
    """Medians of interleaved runs, printed with the ratios to the plant alone and to JSBSim."""
    for row in rows:
        row.measure()  # warm
    taken: dict[str, list[float]] = {row.name: [] for row in rows}
    for _ in range(runs):
        for row in rows:
            taken[row.name].append(row.measure())
    medians = {name: statistics.median(values) for name, values in taken.items()}

    def ratio(name: str, to: str) -> float:
        pairs = zip(taken[name], taken.get(to, []), strict=False)
        return statistics.median([a / b for a, b in pairs] or [float("nan")])

    print(f"{'plant steps per second, median of ' + str(runs):<52}{'M/s':>8}{'plant cost':>12}{'x JSBSim':>10}")
    for row in rows:
        cost, faster = 1.0 / ratio(row.name, "plant alone"), ratio(row.name, "JSBSim c172x, open loop")
        print(f"{row.name:<52}{medians[row.name] / 1e6:8.3f}{cost:12.2f}{faster:10.1f}")
    return medians


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--quick", action="store_true", help="under a minute: fewer and shorter runs, no cold start")
    parser.add_argument("--airframe", default="collage", metavar="SET", help="what flies [the default set]")
    args = parser.parse_args()
    try:
        airframe = load_airframe(args.airframe).parameters
    except SitlError as error:
        parser.error(str(error))
    seconds = 20.0 if args.quick else 100.0
    flights = 512 if args.quick else 2048
    far, cruise = hover_at((1000.0, 0.0, 200.0), 0.0), leg((0.0, 0.0, 200.0), (5000.0, 0.0, 200.0), 15.0, stop=False)
    forward = along(hover_at((5000.0, 0.0, 200.0), 0.0), cruise, 0.0)
    one = partial(single, airframe)
    rows = [
        bare_plant(airframe, round(seconds / STEP)),
        one("linear hover", Law.HOVER_LINEAR, None, seconds),
        one("zero-moment law, far target", Law.HOVER_ZERO_MOMENT, far, seconds),
        one("cruise on a leg (line of sight, then linear)", Law.FORWARD_LINE_OF_SIGHT, forward, seconds),
        one("hover in 6 m/s of wind (TO_HOVER)", Law.TO_HOVER, None, seconds, wind=6.0),
        mission(airframe),
        one("linear hover on satellites", Law.HOVER_LINEAR, None, seconds, navigation=Navigation.SENSORS),
        one("linear hover on motion capture", Law.HOVER_LINEAR, None, seconds, navigation=Navigation.MOCAP),
        one("cruise on satellites", Law.FORWARD_LINE_OF_SIGHT, forward, seconds, navigation=Navigation.SENSORS),
        batch(airframe, f"batch of {flights}, one core", flights, 10.0, 1),
        batch(airframe, f"batch of {flights}, two cores", flights, 10.0, 2),
    ]
    for observe in ("truth", "sensors"):
        rows += environments(observe, 256 if args.quick else 1024, 20)
    peer = jsbsim(round(seconds / STEP / 10.0))
    if peer is not None:
        rows.append(peer)
    table(rows, 3 if args.quick else args.runs)
    print(f"{'plain Python (NUMBA_DISABLE_JIT=1), linear hover':<52}", end="", flush=True)
    print(f"{other_process(PYTHON.format(seconds=1.0, airframe=args.airframe), NUMBA_DISABLE_JIT='1') / 1e6:8.4f}")
    print(f"{'start with kernels kept: import, make, ready':<52}{other_process(START):8.2f} s")
    if not args.quick:
        with tempfile.TemporaryDirectory() as folder:
            cold = other_process(START, NUMBA_CACHE_DIR=folder)
        print(f"{'start that compiles the loop':<52}{cold:8.2f} s")
    print(f"numpy {np.__version__}, Python {sys.version.split()[0]}, load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
