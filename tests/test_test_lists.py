"""What conftest.py says of the test files: which are left out by ``--quick``, and which come first."""

from pathlib import Path

import pytest

from tests.conftest import LONGEST, SLOW

TESTS = Path(__file__).parent


@pytest.mark.parametrize("path", sorted({*SLOW, *LONGEST}))
def test_every_listed_file_or_folder_is_there(path):
    """One that was moved would be run by ``--quick`` again, unnoticed."""
    assert (TESTS / path).is_dir() if path.endswith("/") else (TESTS / path).is_file()
