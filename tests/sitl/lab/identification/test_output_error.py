"""Output error mends what a wrong velocity does to the regression."""

import numpy as np
import pytest

from sitl.lab.identification.flight_log import SensorRecord, Series
from sitl.lab.identification.identify_flight import usable_stretches
from sitl.lab.identification.output_error import refined
from sitl.lab.identification.path_reconstruction import reconstructed
from sitl.lab.identification.regression import NORMAL_95, FitProblem, Solution, jackknife, solved
from sitl.lab.identification.result import EFFECTS, effect_values
from sitl.lab.identification.unknowns import unknowns_of
from sitl.model.airframe_files import load
from tests.support.lab.identified_flight import flown, read

PITCH_DAMPING = [effect.name for effect in EFFECTS].index("pitch damping, 15 m/s")


def thinned(series, every):
    return Series(series.time[::every], series.values[::every])


@pytest.mark.long
def test_poor_positions_bias_the_regression_and_not_the_output_error():
    base, true = load("nominal").parameters, flown("nominal", 7)[0]
    record = read("nominal", 7)
    motion = thinned(record.motion, 10)  # 5 a second, ten times as noisy
    noise = np.random.default_rng(1).standard_normal(motion.values.shape) * np.repeat([0.2, 0.3], 3)
    record = SensorRecord(
        thinned(record.imu, 2), record.commands, record.attitude, Series(motion.time, motion.values + noise), ("",) * 4
    )
    paths = [reconstructed(stretch, base.g) for stretch in usable_stretches(record, base)]
    problem = FitProblem(paths, base, unknowns_of(base))
    rough = solved(problem)
    better = refined(problem, rough)
    truth = effect_values(true, base)[PITCH_DAMPING]
    before, after = (
        abs(effect_values(problem.airframe(solution.x), base)[PITCH_DAMPING] / truth - 1.0)
        for solution in (rough, better)
    )
    assert before > 0.05
    assert after < 0.02


def test_an_answer_on_which_the_plant_cannot_fly_stays_as_it_is():
    base = load("nominal").parameters
    paths = [reconstructed(stretch, base.g) for stretch in usable_stretches(read("nominal", 7), base)]
    problem = FitProblem(paths[:1], base, unknowns_of(base))
    light = problem.start.copy()
    light[[one.key for one in problem.unknowns].index("J2")] = -25.0
    none = np.zeros(6)
    rough = Solution(light, np.eye(len(light)), problem.assumed, none, none, (none, none))
    assert refined(problem, rough) is rough


def test_of_white_residuals_the_jackknife_is_the_cramer_rao_bound():
    random = np.random.default_rng(2)
    slopes = random.standard_normal((400, 25, 3))
    left = random.standard_normal((400, 25))
    parts = [(J.T @ J, J.T @ r) for J, r in zip(slopes, left, strict=True)]
    found = jackknife(parts, np.zeros(3))
    bound = np.linalg.inv(sum(information for information, _ in parts))
    assert np.diag(found) == pytest.approx(np.diag(bound), rel=0.25)


def test_residuals_that_hang_together_make_the_interval_wider():
    random = np.random.default_rng(3)
    steady = random.standard_normal((60, 1)) * np.ones((1, 50))  # one value for a whole block
    parts = [(np.array([[50.0]]), np.array([r.sum()])) for r in steady]
    assert jackknife(parts, np.zeros(1))[0, 0] == pytest.approx(1.0 / 60.0, rel=0.3)


def test_an_error_that_outlasts_a_block_is_seen_by_blocks_twice_as_long():
    """Every two neighbours share one value: single blocks alone tell half of the variance, 1/60."""
    random = np.random.default_rng(4)
    shared = np.repeat(random.standard_normal(60), 2)
    parts = [(np.array([[1.0]]), np.array([value])) for value in shared]
    assert jackknife(parts, np.zeros(1))[0, 0] == pytest.approx(1.0 / 60.0, rel=0.3)


def test_a_few_blocks_widen_the_interval():
    """A constant that six blocks tell, each a different lot: with a normal quantile 89 % of the intervals hold."""
    random, weights, held = np.random.default_rng(5), 1.0 + np.arange(6.0), []
    for _ in range(2000):
        pulls = np.sqrt(weights) * random.normal(0.0, 2.0, 6)
        error = pulls.sum() / weights.sum()
        left = pulls - weights * error  # at the answer
        parts = [(np.array([[weight]]), np.array([pull])) for weight, pull in zip(weights, left, strict=True)]
        held.append(abs(error) <= NORMAL_95 * np.sqrt(jackknife(parts, np.zeros(1))[0, 0]))
    assert np.mean(held) > 0.915
