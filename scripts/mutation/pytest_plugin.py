"""Pytest plugin of mutation testing: records which functions each test calls, or runs the tests of one mutant.

The environment says which: ``MUTATION_RECORD`` is a file to write, ``MUTATION_PLAN`` one to read.
"""

from __future__ import annotations

import importlib
import json
import os
import signal
import sys
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType

import pytest


class TooSlow(BaseException):
    """A test took longer than it may; no handler in a test may swallow it."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TooSlow in the main thread after so many seconds."""

    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise TooSlow

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


class Recorder:
    """Writes, for every test that passes in its time, how long it took and which functions of the package it called."""

    def __init__(self, out: Path, package: Path, seconds: float) -> None:
        self.out, self.prefix, self.limit = out, f"{package}{os.sep}", seconds
        self.root = str(package)[: -len(os.environ["MUTATION_PACKAGE"])]
        self.codes: dict[int, CodeType] = {}
        self.shared: dict[Path, set[int]] = {}  # called for all tests below a path: imports and shared fixtures
        self.called: dict[str, set[int]] = {}
        self.seconds: dict[str, float] = {}
        self.paths: dict[str, Path] = {}
        self.unfit: set[str] = set()
        self.current = self.shared.setdefault(Path(self.root), set())
        sys.settrace(self.trace)

    def trace(self, frame: FrameType, _event: str, _arg: object) -> None:
        """Note the function that is called; its lines are not followed."""
        code = frame.f_code
        if code.co_filename.startswith(self.prefix):
            self.codes[id(code)] = code
            self.current.add(id(code))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Note what a test calls, and how long it takes."""
        before, self.current = self.current, self.called.setdefault(item.nodeid, set())
        self.paths[item.nodeid] = item.path
        sys.settrace(self.trace)  # a test may have set another
        begun = time.perf_counter()
        try:
            return (yield)
        finally:
            self.seconds[item.nodeid] = time.perf_counter() - begun
            self.current = before

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self) -> Generator[None, object, object]:
        """Stop a test that takes too long."""
        with time_limit(self.limit):
            return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[object], request: pytest.FixtureRequest
    ) -> Generator[None, object, object]:
        """Count the calls of a shared fixture for all tests that may share it."""
        before = self.current
        if fixturedef.scope != "function":
            self.current = self.shared.setdefault(request.node.path, set())
        try:
            return (yield)
        finally:
            self.current = before

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Only tests that pass can tell a mutant from the original."""
        if not report.passed:
            self.unfit.add(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        """Write what was recorded."""
        sys.settrace(None)
        names = sorted({self.name_of(code) for code in self.codes.values()})
        numbers = {key: names.index(self.name_of(code)) for key, code in self.codes.items()}
        tests = {}
        for test, called in self.called.items():
            path = self.paths[test]
            shared = [keys for above, keys in self.shared.items() if path.is_relative_to(above)]
            calls = sorted({numbers[key] for key in called.union(*shared)})
            tests[test] = {"fit": test not in self.unfit, "seconds": self.seconds[test], "calls": calls}
        self.out.write_text(json.dumps({"functions": names, "tests": tests}), encoding="utf-8")

    def name_of(self, code: CodeType) -> str:
        """File and qualified name of the outermost function."""
        return f"{code.co_filename[len(self.root) :]}:{code.co_qualname.split('.<locals>')[0]}"


class Runner:
    """Runs the planned tests, the likeliest to fail first, each within its time."""

    def __init__(self, plan: Path) -> None:
        made = json.loads(plan.read_text(encoding="utf-8"))
        self.limits: dict[str, float] = made["limits"]  # in the order to run
        self.known = set(made["known"])

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Keep the planned tests, and those that exist only with this mutant: it changed what they are named after."""
        order = {test: index for index, test in enumerate(self.limits)}
        kept = [item for item in items if item.nodeid in order or item.nodeid not in self.known]
        config.hook.pytest_deselected(items=[item for item in items if item not in kept])
        items[:] = sorted(kept, key=lambda item: order.get(item.nodeid, len(order)))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, object, object]:
        """Stop a test that a mutant made endless."""
        with time_limit(self.limits.get(item.nodeid, 10.0)):
            return (yield)


def pytest_configure(config: pytest.Config) -> None:
    """Check which tree is tested, and take up the work that the environment asks for."""
    package = config.rootpath / os.environ["MUTATION_PACKAGE"]
    top = importlib.import_module(package.relative_to(config.rootpath).parts[0])
    if not str(top.__file__).startswith(f"{config.rootpath}{os.sep}"):
        raise pytest.UsageError(f"{top.__file__} is tested instead of {package}")
    if out := os.environ.get("MUTATION_RECORD"):
        recorder = Recorder(Path(out), package, float(os.environ["MUTATION_SECONDS"]))
        config.pluginmanager.register(recorder, "mutation-recorder")
    else:
        config.pluginmanager.register(Runner(Path(os.environ["MUTATION_PLAN"])), "mutation-runner")
