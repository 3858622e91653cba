"""Sensitivity of the report page's verdicts to the model's parameters: the figures of docs/report.md.

``python scripts/page_sensitivity.py [--jobs N] [--seed N]`` multiplies one parameter after the other by 1.1, in every
set that the page uses, runs the experiments that have statements, and counts the verdicts that change; then it takes
all damping away, and reverses the propellers' torque.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

from sitl.lab.reproduction.experiment import Conditions, Verdict
from sitl.lab.reproduction.experiments.experiment_list import EXPERIMENTS
from sitl.simulation.failures import DivergedError

FACTOR = 1.1
# What the report states or uses, as far as it is not zero in the set 'published'.
PARAMETERS = (
    "m", "J1", "J2", "J3", "g", "rho", "S", "b", "c", "S_ratio", "C_l", "C_d0", "xi_f", "xi_m", "Delta_r", "a_y", "p_x",
    "p_y", "k_f", "k_m", "C_lp", "C_lr", "C_mq", "C_np", "C_nr", "omega_min", "omega_max", "omega_rate", "delta_max",
    "delta_rate",
)  # fmt: skip
DAMPING = ("C_lp", "C_lr", "C_mq", "C_np", "C_nr", "mu")
WITHOUT_STATEMENTS = frozenset({"motors"})  # illustrations only, and slow
Verdicts = Mapping[str, Verdict]


class Change(NamedTuple):
    """Effect of an alteration on the page."""

    changed: list[str]  # names of the statements whose verdict changes
    unexplained: int


def verdicts(conditions: Conditions) -> dict[str, Verdict]:
    """Verdicts of the page by name of the statement; of an experiment that cannot be flown there are none."""
    found: dict[str, Verdict] = {}
    for name, experiment in EXPERIMENTS.items():
        if name in WITHOUT_STATEMENTS:
            continue
        try:
            result = experiment.run(conditions)
        except DivergedError:
            continue
        found |= {f"{statement.place}: {statement.name}": statement.verdict for statement in result.statements}
    return found


def change(before: Verdicts, after: Verdicts) -> Change:
    """The difference between two pages."""
    changed = [name for name in before if after.get(name, Verdict.UNEXPLAINED) is not before[name]]
    return Change(changed, sum(after.get(name, Verdict.UNEXPLAINED) is Verdict.UNEXPLAINED for name in before))


def main() -> None:
    """Measure and print the table."""
    options = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    options.add_argument("--jobs", type=int, default=1, help="processes at once [1]")
    options.add_argument("--seed", type=int, default=1, help="seed of the experiments [1]")
    args = options.parse_args()
    altered = {name: Conditions(args.seed, ((name, FACTOR),)) for name in PARAMETERS}
    altered["no damping"] = Conditions(args.seed, tuple((name, 0.0) for name in DAMPING))
    altered["torque reversed"] = Conditions(args.seed, (("k_m", -1.0),))
    before = verdicts(Conditions(args.seed))
    print(
        f"{len(before)} statements\n\n| altered | verdicts that change | unexplained then | the first of them |\n"
        "|---|---|---|---|"
    )
    sensitive = 0
    with ProcessPoolExecutor(args.jobs) as pool:
        for name, after in zip(altered, pool.map(verdicts, altered.values()), strict=True):
            found = change(before, after)
            sensitive += bool(found.changed) and name in PARAMETERS
            first = found.changed[0] if found.changed else ""
            print(f"| {name} | {len(found.changed)} | {found.unexplained} | {first} |", flush=True)
    print(f"\n{sensitive} of {len(PARAMETERS)} parameters change a verdict")


if __name__ == "__main__":
    main()
