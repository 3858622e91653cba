"""The page about plan transfers names tests that exist, in the files it names."""

import re

import pytest

from tests.support.paths import DATA

ROOT = DATA.parents[1]
SECTION = (ROOT / "docs" / "hostile.md").read_text(encoding="utf-8").split("### The laws of plan transfers")[1]
ROWS = [line.strip("|").split("|") for line in SECTION.split("\n## ")[0].splitlines() if line.startswith("|")]


def names(cell):
    return set(re.findall(r"`(test_\w+)`", cell))


@pytest.mark.parametrize("column", [1, 2])
def test_every_law_names_existing_tests(column):
    files = [(ROOT / path).read_text(encoding="utf-8") for path in re.findall(r"`(tests/\S+)`", ROWS[0][column])]
    defined = set(re.findall(r"^def (test_\w+)", "".join(files), re.MULTILINE))
    named = set().union(*[names(row[column]) for row in ROWS[2:]])
    assert named - defined == set()
    assert all(names(row[1]) | names(row[2]) for row in ROWS[2:])
