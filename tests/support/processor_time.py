"""Processor time of the test run: seconds by file and by test, those of started processes among them."""

from collections import Counter
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from typing import Any

import pytest

FILES = 40
TESTS = 30


def seconds_used():
    """Seconds of all cores that this process and those that it started and saw end have used."""
    own, children = getrusage(RUSAGE_SELF), getrusage(RUSAGE_CHILDREN)
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


class ProcessorTime:
    """Adds what each phase of a test used to its report, and prints the sums at the end.

    A fixture counts for the test that needs it first, the compiling of a function for the first that calls it.
    """

    def __init__(self):
        self.mark = seconds_used()
        self.of_test: Any = Counter()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self):
        report = yield
        now = seconds_used()
        report.processor_seconds, self.mark = now - self.mark, now
        return report

    def pytest_collection_finish(self):
        self.mark = seconds_used()

    def pytest_runtest_logreport(self, report):
        self.of_test[report.nodeid] += getattr(report, "processor_seconds", 0.0)  # none where a worker has crashed

    def pytest_terminal_summary(self, terminalreporter):
        of_file: Any = Counter()
        for test, seconds in self.of_test.items():
            of_file[test.partition("::")[0]] += seconds
        terminalreporter.section(f"processor time: {of_file.total():.0f} s without the collection")
        for seconds_of, lines in (of_file, FILES), (self.of_test, TESTS):
            for name, seconds in seconds_of.most_common(lines):
                terminalreporter.line(f"{seconds:8.1f} s  {name}")
            terminalreporter.line("")
