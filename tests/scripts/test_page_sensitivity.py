"""Count of changed verdicts of the report page."""

import importlib.util
from pathlib import Path

from sitl.lab.reproduction.experiment import Verdict
from sitl.model.airframe_files import load

SCRIPT = Path(__file__).parents[2] / "scripts" / "page_sensitivity.py"
specification = importlib.util.spec_from_file_location("page_sensitivity", SCRIPT)
page_sensitivity = importlib.util.module_from_spec(specification)
specification.loader.exec_module(page_sensitivity)
Change, change = page_sensitivity.Change, page_sensitivity.change
BEFORE = {"a": Verdict.REPRODUCED, "b": Verdict.CAUSE_COMPUTED, "c": Verdict.OPEN}


def test_a_verdict_that_changes_is_counted_by_name():
    after = BEFORE | {"b": Verdict.UNEXPLAINED, "c": Verdict.REPRODUCED}
    assert change(BEFORE, after) == Change(["b", "c"], 1)
    assert change(BEFORE, BEFORE) == Change([], 0)


def test_a_statement_that_can_no_longer_be_computed_is_unexplained():
    assert change(BEFORE, {"a": Verdict.REPRODUCED, "b": Verdict.CAUSE_COMPUTED}) == Change(["c"], 1)


def test_only_parameters_that_are_not_zero_are_altered():
    published = load("published").parameters
    assert len(set(page_sensitivity.PARAMETERS)) >= 20
    assert all(getattr(published, name) != 0.0 for name in page_sensitivity.PARAMETERS)
