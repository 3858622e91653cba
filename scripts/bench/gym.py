"""Speed of the environments for agents beside the bare core, in one run.

``python scripts/bench/gym.py [--quick] [--envs N] [--runs N]`` prints plant steps a second (1 kHz) of one core, as
medians over interleaved runs timed by processor time: the plant alone, hovers under the linear law and on sensors as
``Simulation`` flies them, and a vector of N hovering environments by truth and by sensors, each by its compiled call
alone and by its ``step``. What is over the compiled call is Python's share.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from collections.abc import Callable

import numpy as np
from core import bare_plant, hovering  # beside this file

from protocol.dialect.vocabulary import Law
from sitl import Navigation, load_airframe
from sitl.defaults import STUDY_AIRFRAME
from sitl.gym.environments import DarkoVectorEnv
from sitl.model.airframe import Airframe

STEPS_PER_PERIOD = 2


def timed(work: Callable[[], object]) -> float:
    """Processor time of some work [s]."""
    began = time.process_time()
    work()
    return time.process_time() - began


def law_rate(airframe: Airframe, navigation: Navigation, seconds: float) -> float:
    """Plant steps a second of one hover as ``Simulation`` flies it."""
    made = hovering(airframe, Law.HOVER_LINEAR, navigation=navigation)
    made.step(0.1)
    return 1e3 * seconds / timed(lambda: made.step(seconds))


class VectorRates:
    """A vector of environments that hover by their linear actions, and its rates."""

    def __init__(self, observe: str, count: int, steps: int) -> None:
        self._env = DarkoVectorEnv(count, "Hover", observe=observe, actions="rates")
        self._steps = steps
        self._seen, _ = self._env.reset(seed=1)

    def _actions(self) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        """Rates against the tilt and the deviation: it hovers roughly."""
        x = self._seen.astype(float)
        acted = np.zeros((len(x), 4))
        acted[:, 1] = 1.0 * x[:, 8] - 0.5 * x[:, 2] - 1.0 * x[:, 5]
        acted[:, 2] = -1.0 * x[:, 7] + 0.5 * x[:, 1] + 1.0 * x[:, 4]
        acted[:, 3] = -2.0 * x[:, 0] - 4.0 * x[:, 3]
        return acted

    def rates(self) -> tuple[float, float]:
        """Plant steps a second of the compiled call alone, and of ``step`` with its resets."""
        env, batch, compiled, whole, flown = self._env, self._env.batch, 0.0, 0.0, 0
        inner = batch._call  # noqa: SLF001 - what is measured

        def measured(actions: np.ndarray[tuple[int, ...], np.dtype[np.float64]], periods: int) -> None:
            nonlocal compiled
            compiled += timed(lambda: inner(actions, periods))

        batch._call = measured  # type: ignore[method-assign]  # noqa: SLF001
        for _ in range(self._steps):
            actions = self._actions()
            began = time.process_time()
            self._seen = env.step(actions)[0]
            whole += time.process_time() - began
            flown += int(batch.outcome.flies.sum())
        batch._call = inner  # type: ignore[method-assign]  # noqa: SLF001
        plant_steps = flown * batch.options.periods * STEPS_PER_PERIOD
        return plant_steps / compiled, plant_steps / whole


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--envs", type=int, default=1024)
    parser.add_argument("--quick", action="store_true", help="shorter")
    args = parser.parse_args()
    airframe = load_airframe(STUDY_AIRFRAME).parameters
    steps, seconds = (20, 10.0) if args.quick else (60, 50.0)
    bare = bare_plant(airframe, round(seconds * 1e3))
    vectors = {
        "truth": VectorRates("truth", args.envs, steps),
        "sensors": VectorRates("sensors", args.envs, max(steps // 4, 3)),
    }
    taken: dict[str, list[float]] = {}
    ratios: dict[str, list[float]] = {}
    for _ in range(args.runs):
        found = {"plant alone": bare.measure()}
        for name, navigation in (("truth", Navigation.TRUTH), ("sensors", Navigation.SENSORS)):
            found[f"Simulation, linear hover, {name}"] = law_rate(airframe, navigation, 0.2 * seconds)
            compiled, whole = vectors[name].rates()
            found[f"{args.envs} environments, {name}: compiled call"] = compiled
            found[f"{args.envs} environments, {name}: step"] = whole
            ratios.setdefault(name, []).append(1.0 - whole / compiled)
        for row, rate in found.items():
            taken.setdefault(row, []).append(rate)
            ratios.setdefault(row, []).append(found["plant alone"] / rate)
    print(f"{'plant steps a second, one core, median of ' + str(args.runs):<52}{'M/s':>8}{'plant cost':>12}")
    for row, rates in taken.items():
        print(f"{row:<52}{statistics.median(rates) / 1e6:8.3f}{statistics.median(ratios[row]):12.2f}")
    for name in vectors:
        print(f"Python's share of a step, {name}: {100.0 * statistics.median(ratios[name]):.1f} %")
    print(f"numpy {np.__version__}, load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
