"""Test run: the lists of conftest.py name existing files, and processor time is summed."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.conftest import LONGEST, SLOW
from tests.support.processor_time import ProcessorTime
from tests.support.scheduling import TOGETHER, WAITING, FolderScheduling

TESTS = Path(__file__).parent
SHARED = [folder.removeprefix("tests/") for folder in (*TOGETHER, *WAITING)]


@pytest.mark.parametrize("path", sorted({*SLOW, *LONGEST, *SHARED}))
def test_every_listed_file_or_folder_is_there(path):
    """One that was moved would be run by ``--quick`` again, unnoticed."""
    assert (TESTS / path).is_dir() if path.endswith("/") else (TESTS / path).is_file()


class Process:
    """Stand-in for a test process of xdist; keeps the places of the tests that it was sent."""

    shutting_down = False
    gateway = SimpleNamespace(id="a")

    def __init__(self):
        self.sent, self.finished = [], 0

    def run_one(self, scheduling):
        if self.finished < len(self.sent):
            self.finished += 1
            scheduling.mark_test_complete(self, self.sent[self.finished - 1])

    def send_runtest_some(self, places):
        self.sent += places

    def shutdown(self):
        self.shutting_down = True


def scheduled(tests):
    """Three processes among which the tests are shared, and what shares them."""
    config = SimpleNamespace(getvalue=lambda _: ["popen"] * 3, option=SimpleNamespace(loadscopereorder=False))
    scheduling, processes = FolderScheduling(config), [Process() for _ in range(3)]
    for process in processes:
        scheduling.add_node(process)
    for process in processes:
        scheduling.add_node_collection(process, tests)
    scheduling.schedule()
    return scheduling, processes


def files_sent(process, tests):
    return list(dict.fromkeys(tests[place].partition("::")[0] for place in process.sent))


@pytest.mark.parametrize("folder", TOGETHER)
def test_one_process_takes_a_folder_whose_files_share_and_each_other_file_is_taken_by_itself(folder):
    tests = [f"{folder}test_{file}.py::a{n}" for file in "abc" for n in range(3)]
    tests += [f"tests/sitl/test_{file}.py::a{n}" for file in "abc" for n in range(3)]
    _scheduling, processes = scheduled(tests)
    assert [files_sent(process, tests) for process in processes] == [
        [f"{folder}test_{file}.py" for file in "abc"],
        ["tests/sitl/test_a.py"],
        ["tests/sitl/test_b.py"],
    ]


def test_each_kind_that_waits_is_begun_by_one_process_and_what_computes_by_another():
    folders = ("sitl", "darko_gcs/tui", "e2e")
    tests = [f"tests/{folder}/test_{file}.py::a{n}" for folder in folders for file in "ab" for n in range(3)]
    scheduling, processes = scheduled(tests)
    for _ in tests:
        for process in processes:
            process.run_one(scheduling)
    for process, folder in zip(processes, ("e2e", "darko_gcs/tui", "sitl"), strict=True):
        assert files_sent(process, tests) == [f"tests/{folder}/test_{file}.py" for file in "ab"]
        assert process.shutting_down
    assert scheduling.tests_finished


def test_who_is_done_with_the_first_takes_of_the_rest():
    tests = [f"tests/sitl/test_{file}.py::a{n}" for file in "abcdef" for n in range(3)]
    scheduling, processes = scheduled(tests)
    for _ in tests:
        processes[0].run_one(scheduling)
    assert sorted(place for process in processes for place in process.sent) == list(range(len(tests)))
    assert len(files_sent(processes[0], tests)) == 4


def test_processor_time_is_summed_by_file_and_by_test_the_greatest_first():
    counted, printed = ProcessorTime(), []
    for test, seconds in (("a.py::one", 1.0), ("b.py::one", 3.5), ("a.py::one", 0.5), ("a.py::two", 1.0)):
        counted.pytest_runtest_logreport(SimpleNamespace(nodeid=test, processor_seconds=seconds))
    counted.pytest_runtest_logreport(SimpleNamespace(nodeid="c.py::crashed"))
    counted.pytest_terminal_summary(
        SimpleNamespace(section=printed.append, line=lambda line: printed.append(line.split()))
    )
    assert printed[0] == "processor time: 6 s without the collection"
    files, tests = ["3.5", "s", "b.py"], ["3.5", "s", "b.py::one"]
    assert printed[1:4] == [files, ["2.5", "s", "a.py"], ["0.0", "s", "c.py"]]
    assert printed[5:8] == [tests, ["1.5", "s", "a.py::one"], ["1.0", "s", "a.py::two"]]


def test_a_phase_of_a_test_counts_what_was_used_since_the_one_before():
    counted, phases = ProcessorTime(), []
    for work in (3_000_000, 0):
        sum(range(work))
        phase = counted.pytest_runtest_makereport()
        next(phase)
        with pytest.raises(StopIteration) as ended:
            phase.send(SimpleNamespace())
        phases.append(ended.value.value.processor_seconds)
    assert phases[0] > phases[1] >= 0.0
