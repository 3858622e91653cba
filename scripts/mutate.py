"""Sampled mutation testing: change the code in small ways and see whether the tests notice.

Each change is one mutant: another comparison, another arithmetic or boolean operator, a negated condition, another
number. A mutant is killed when a test fails or does not end. A mutant that survives points at behaviour that no test
holds, or at code that makes no difference.

Mutants are drawn at random from one package, the same ones for the same seed. They are tried in copies of the tree,
never in the working tree itself, and only by the tests that call the changed function. Numba is switched off, so
kernels run as plain Python; tests that are too slow then are left out.

    python scripts/mutate.py --package protocol --count 200 --seed 1
    python scripts/mutate.py --package sitl/model --count 60 --json model.json
    python scripts/mutate.py --package sitl/model --again model.json
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import queue
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import cache_from_source
from pathlib import Path
from typing import Any

from mutation import pytest_plugin
from mutation.mutants import Mutant, mutants_of

ROOT = Path(__file__).resolve().parent.parent
IGNORED = shutil.ignore_patterns(".*", "__pycache__", "dist", "build")
START_TIME = 20.0  # what pytest may take to start, on a loaded machine [s]
SLOWER = 10.0  # a test may take this many times as long as without a change, and two seconds


@dataclass(frozen=True)
class Verdict:
    """Outcome of a mutant."""

    mutant: Mutant
    outcome: str  # killed, timeout or survived
    tests: int  # how many tests call the changed function


@dataclass(frozen=True)
class Coverage:
    """Functions that each test calls, as the pytest plugin records it."""

    functions: list[str]  # file:qualified name
    tests: dict[str, dict[str, Any]]  # fit, seconds and calls: indices of the functions


@dataclass(frozen=True)
class Trial:
    """Mutated package and the tests for it."""

    package: str
    tests: list[str]  # folders or files
    seconds: float  # slower tests are left out

    def environment(self, tree: Path) -> dict[str, str]:
        """For a run of pytest on a tree."""
        return {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(tree), str(Path(__file__).resolve().parent)]),
            "NUMBA_DISABLE_JIT": "1",
            "MUTATION_PACKAGE": self.package,
            "MUTATION_SECONDS": str(self.seconds),
        }


def main() -> int:
    """Draw mutants, try them and print which survive."""
    args = _arguments()
    tree, trial = args.tree.resolve(), Trial(args.package, args.tests or [f"tests/{args.package}"], args.test_seconds)
    mutants = _drawn(_candidates(tree, args.package), args.count, args.seed)
    if args.again:
        mutants = _again(_candidates(tree, args.package), json.loads(args.again.read_text(encoding="utf-8")))
    if args.list:
        print(*mutants, sep="\n")
        return 0
    with tempfile.TemporaryDirectory(prefix="mutants-") as made:
        copy = Path(made) / "original"
        shutil.copytree(tree, copy, ignore=IGNORED)
        covered = _recorded(copy, trial)
        verdicts = _tried(mutants, copy, trial, covered, args.jobs)
    _report(verdicts, args.package, args.seed)
    if args.json:
        args.json.write_text(json.dumps([_row(verdict) for verdict in verdicts], indent=1) + "\n", encoding="utf-8")
    return 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--package", required=True, help="folder to mutate: protocol, sitl/supervisor, sitl/model, ...")
    parser.add_argument("--count", type=int, default=100, help="how many mutants to draw [100]")
    parser.add_argument("--seed", type=int, default=1, help="seed of the draw [1]")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="mutants tried at once [one per core]")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every mutant and its outcome to a file")
    parser.add_argument("--again", type=Path, metavar="FILE", help="try only the survivors of an earlier --json file")
    parser.add_argument("--list", action="store_true", help="print the mutants and stop")
    parser.add_argument("--tests", action="append", metavar="PATH", help="tests to run, repeatable [tests/PACKAGE]")
    parser.add_argument("--test-seconds", type=float, default=10.0, help="leave out tests slower than this [10]")
    parser.add_argument("--tree", type=Path, default=ROOT, help="tree to copy and mutate [this one]")
    return parser.parse_args()


def _candidates(tree: Path, package: str) -> list[Mutant]:
    """All mutants of a package; generated files have none.

    Raises:
        SystemExit: There are none.
    """
    project = tomllib.loads((tree / "pyproject.toml").read_text(encoding="utf-8"))
    generated = project["tool"]["hatch"]["build"]["artifacts"]
    found: list[Mutant] = []
    for path in sorted((tree / package).rglob("*.py")):
        file = path.relative_to(tree).as_posix()
        if file not in generated:
            found += mutants_of(file, path.read_bytes())
    if not found:
        raise SystemExit(f"nothing to change in {tree / package}")
    return found


def _drawn(candidates: list[Mutant], count: int, seed: int) -> list[Mutant]:
    """A sample, in the order of the files."""
    drawn = random.Random(seed).sample(candidates, min(count, len(candidates)))  # noqa: S311 - to be repeated
    return sorted(drawn)


def _again(candidates: list[Mutant], rows: list[dict[str, Any]]) -> list[Mutant]:
    """The survivors of an earlier run: the same changes in the same places, or else all like them on the same line.

    Where the line has none, all like them in the same function.
    """
    found: dict[Mutant, None] = {}
    for row in rows:
        if row["outcome"] == "survived":
            wanted = [row[key] for key in ("file", "function", "before", "after")]
            alike = [m for m in candidates if [m.file, m.function, m.before, m.after] == wanted]
            here = [m for m in alike if m.start == row["start"]] or [m for m in alike if m.line == row["line"]]
            found |= dict.fromkeys(here or alike)
    return sorted(found)


def _recorded(copy: Path, trial: Trial) -> Coverage:
    """Functions that each test calls, from the last run on the same sources if there was one.

    Raises:
        SystemExit: No test passes.
    """
    digest = hashlib.sha256(repr(trial).encode() + Path(pytest_plugin.__file__).read_bytes())
    for path in sorted(copy.rglob("*.py")):
        digest.update(path.relative_to(copy).as_posix().encode() + path.read_bytes())
    kept = Path(tempfile.gettempdir()) / f"mutation-coverage-{digest.hexdigest()[:16]}.json"
    if not kept.exists():
        print(f"recording what the tests of {trial.package} call ...", flush=True)
        out = copy.parent / "record.json"
        environment = trial.environment(copy) | {"MUTATION_RECORD": str(out)}
        ended = subprocess.run(_pytest(*trial.tests), cwd=copy, env=environment, capture_output=True, check=False)  # noqa: S603
        if not out.exists():
            raise SystemExit(ended.stdout.decode() + ended.stderr.decode())
        shutil.copy(out, kept)
    coverage = Coverage(**json.loads(kept.read_text(encoding="utf-8")))
    fit = [test for test in coverage.tests.values() if test["fit"]]
    if not fit:
        raise SystemExit(f"no test of {trial.tests} passes within {trial.seconds:g} s")
    print(f"{len(fit)} tests, {len(coverage.tests) - len(fit)} left out: skipped, failing or slow", flush=True)
    return coverage


def _pytest(*arguments: str) -> list[str]:
    """A command that runs tests without what they do not need."""
    plugins = [word for name in ("no:cacheprovider", "no:xdist", "mutation.pytest_plugin") for word in ("-p", name)]
    return [sys.executable, "-m", "pytest", "-q", "--tb=no", *plugins, *arguments]


def _tried(mutants: list[Mutant], original: Path, trial: Trial, covered: Coverage, jobs: int) -> list[Verdict]:
    """Try all mutants, several at once, each worker in a copy of its own.

    Raises:
        SystemExit: The tests fail without any change.
    """
    unchanged = Mutant(f"{trial.package}/__init__.py", 1, "", 0, 0, "", "")
    if _try(unchanged, original, trial, covered).outcome != "survived":
        raise SystemExit("the tests fail without any change")
    copies: queue.SimpleQueue[Path] = queue.SimpleQueue()
    for number in range(jobs):
        copies.put(Path(shutil.copytree(original, original.parent / f"copy{number}")))

    def tried(mutant: Mutant) -> Verdict:
        copy = copies.get()
        try:
            verdict = _try(mutant, copy, trial, covered)
        finally:
            copies.put(copy)
        print(f"{verdict.outcome:8}  {mutant}", flush=True)
        return verdict

    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(tried, mutants))


def _try(mutant: Mutant, copy: Path, trial: Trial, covered: Coverage) -> Verdict:
    """Run the tests of one mutant in a copy of the tree."""
    tests = _tests_of(mutant, covered)
    limits = {test: SLOWER * covered.tests[test]["seconds"] + 2.0 for test in tests}
    plan = copy / "plan.json"
    plan.write_text(json.dumps({"limits": limits, "known": list(covered.tests)}), encoding="utf-8")
    files = list(dict.fromkeys(test.split("::")[0] for test in tests))
    if not files:
        return Verdict(mutant, "survived", 0)
    environment = trial.environment(copy) | {"MUTATION_PLAN": str(plan)}
    limit = START_TIME + SLOWER * sum(covered.tests[test]["seconds"] for test in tests)
    with _applied(mutant, copy):
        code = _run(_pytest("-x", *files), copy, environment, limit)
    outcome = "timeout" if code is None else "survived" if code in (0, 5) else "killed"
    return Verdict(mutant, outcome, len(tests))


def _tests_of(mutant: Mutant, covered: Coverage) -> list[str]:
    """The tests that call the changed function, file by file, quick files first.

    What is computed when a module is imported may concern any test: those that call the module's functions come first.
    """
    fit = {test: found for test, found in covered.tests.items() if found["fit"]}
    name = f"{mutant.file}:{mutant.function}"
    if not mutant.function:
        own = {index for index, function in enumerate(covered.functions) if function.startswith(name)}
        return sorted(fit, key=lambda test: own.isdisjoint(fit[test]["calls"]))
    number = covered.functions.index(name) if name in covered.functions else None
    calling = [test for test, found in fit.items() if number in found["calls"]]
    seconds: dict[str, float] = {}
    for test in calling:
        file = test.split("::")[0]
        seconds[file] = seconds.get(file, 0.0) + fit[test]["seconds"]
    return sorted(calling, key=lambda test: seconds[test.split("::")[0]])


@contextmanager
def _applied(mutant: Mutant, copy: Path) -> Iterator[None]:
    """The copy with the change in it; compiled files of the changed module never outlive it."""
    path = copy / mutant.file
    source, compiled = path.read_bytes(), Path(cache_from_source(str(path)))
    compiled.unlink(missing_ok=True)
    if mutant.after:
        path.write_bytes(mutant.applied(source))
    try:
        yield
    finally:
        path.write_bytes(source)
        compiled.unlink(missing_ok=True)


def _run(command: list[str], folder: Path, environment: dict[str, str], seconds: float) -> int | None:
    """Run a command and what it starts; its exit code, or nothing if it had to be stopped."""
    with subprocess.Popen(  # noqa: S603
        command,
        cwd=folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    ) as process:
        try:
            return process.wait(seconds)
        except subprocess.TimeoutExpired:
            return None
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)


def _report(verdicts: list[Verdict], package: str, seed: int) -> None:
    survivors = [verdict for verdict in verdicts if verdict.outcome == "survived"]
    killed = len(verdicts) - len(survivors)
    share = 100.0 * killed / max(1, len(verdicts))
    print(f"\n{package}, seed {seed}: {killed} of {len(verdicts)} mutants killed ({share:.0f} %)")
    for verdict in survivors:
        print(f"{verdict.mutant}  ({verdict.tests} tests)")


def _row(verdict: Verdict) -> dict[str, object]:
    return {**verdict.mutant._asdict(), "outcome": verdict.outcome, "tests": verdict.tests}


if __name__ == "__main__":
    sys.exit(main())
