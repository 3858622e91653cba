"""The page of the laws of plan transfers names tests that exist, in the files it says."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SECTION = (ROOT / "docs" / "hostile.md").read_text(encoding="utf-8").split("### The laws of plan transfers")[1]
ROWS = [line.strip("|").split("|") for line in SECTION.split("\n## ")[0].splitlines() if line.startswith("|")]


def names(cell):
    return set(re.findall(r"`(test_\w+)`", cell))


@pytest.mark.parametrize("column", [1, 2])
def test_every_law_has_its_tests_and_they_are_there(column):
    (path,) = re.findall(r"`(tests/\S+)`", ROWS[0][column])
    defined = set(re.findall(r"^def (test_\w+)", (ROOT / path).read_text(encoding="utf-8"), re.MULTILINE))
    told = set().union(*[names(row[column]) for row in ROWS[2:]])
    assert told - defined == set()
    assert all(names(row[1]) | names(row[2]) for row in ROWS[2:])
