"""Test run: the lists of conftest.py name existing files, and processor time is summed."""

from pathlib import Path
from types import SimpleNamespace

import platformdirs
import pytest

from tests.conftest import LONGEST, SLOW, TOGETHER, WAITING, in_turn, leaves_out_long, long_ones, share
from tests.support.processor_time import ProcessorTime

TESTS = Path(__file__).parent


@pytest.mark.parametrize("path", sorted({*SLOW, *LONGEST, *TOGETHER, *WAITING}))
def test_every_listed_file_or_folder_is_there(path):
    """One that was moved would be run by ``--quick`` again, unnoticed."""
    assert (TESTS / path).is_dir() if path.endswith("/") else (TESTS / path).is_file()


@pytest.mark.parametrize(
    ("all_of_them", "named", "leaves_out"), [(False, [], True), (True, [], False), (False, ["tests/e2e"], False)]
)
def test_long_tests_are_run_by_all_or_where_their_file_is_named(all_of_them, named, leaves_out):
    options = {"--all": all_of_them, "file_or_dir": named}
    assert leaves_out_long(SimpleNamespace(getoption=options.get)) is leaves_out


def test_the_first_cases_of_a_long_test_are_run_as_often_as_its_mark_says():
    def item(name, **mark):
        return SimpleNamespace(nodeid=f"a.py::{name}", get_closest_marker=lambda _: SimpleNamespace(kwargs=mark))

    quick = SimpleNamespace(nodeid="a.py::quick", get_closest_marker=lambda _: None)
    items = [item("one"), item("two[a]", after=1), quick, item("two[b]", after=1), item("two[c]", after=1)]
    assert [left.nodeid for left in long_ones(items)] == ["a.py::one", "a.py::two[b]", "a.py::two[c]"]


@pytest.mark.parametrize("folder", TOGETHER)
def test_one_process_takes_a_folder_whose_files_share_and_each_other_file_is_taken_by_itself(folder):
    assert share(f"{folder}test_a.py") == share(f"{folder}test_b.py") == folder
    assert share("sitl/test_a.py") == "sitl/test_a.py"


def test_one_process_takes_this_file_as_a_whole(request):
    """By the end of its tests' names; else each process would make every fixture and load every kernel."""
    if not getattr(request.config.option, "loadgroup", False):
        pytest.skip("one process runs all")
    assert request.node.nodeid.endswith("@test_test_run.py")


@pytest.mark.parametrize("kind", ["config", "data", "state", "pictures"])
def test_the_folders_of_the_user_are_those_of_this_run(kind, tmp_path_factory):
    find = getattr(platformdirs, f"user_{kind}_path")
    assert find().is_relative_to(tmp_path_factory.getbasetemp())


def test_long_work_comes_first_and_what_waits_goes_in_turn_with_what_computes():
    computing, waiting = [f"sitl/test_{i}.py" for i in range(4)], [f"{WAITING[0]}test_{i}.py" for i in range(2)]
    ordered = in_turn([*waiting, *computing, LONGEST[1], LONGEST[0]])
    assert ordered[:2] == [*LONGEST[:2]]
    assert [path.startswith(WAITING) for path in ordered[2:]] == [True, False, False, True, False, False]


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
