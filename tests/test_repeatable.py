"""Property tests draw the same examples whatever ran before them."""

import importlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.conftest import PROFILE

CONSTANTS = range(700_000, 700_200)


def drawn():
    """Numbers that a property test is given."""
    numbers = []

    @settings(max_examples=300)
    @given(st.integers())
    def look(number):
        numbers.append(number)

    look()
    return numbers


@pytest.mark.skipif(PROFILE != "repeatable", reason="new examples are asked for")
def test_a_module_imported_in_between_changes_no_example(tmp_path, monkeypatch):
    before = drawn()
    (tmp_path / "imported_in_between.py").write_text("\n".join(f"C{n} = {n}" for n in CONSTANTS))
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("imported_in_between")
    assert drawn() == before
    assert not set(before) & set(CONSTANTS)
