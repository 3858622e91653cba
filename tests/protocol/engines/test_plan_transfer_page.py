"""The page about hostile peers names tests that exist, in files that exist."""

import re

import pytest

from tests.support.paths import DATA

ROOT = DATA.parents[1]
PAGE = (ROOT / "docs" / "hostile.md").read_text(encoding="utf-8")
FILES = sorted(set(re.findall(r"`(tests/[\w/]+\.py)`", PAGE)))


@pytest.mark.parametrize("path", FILES)
def test_every_file_that_the_page_names_holds_tests(path):
    assert re.search(r"^(async )?def test_", (ROOT / path).read_text(encoding="utf-8"), re.MULTILINE)


def test_every_test_that_the_page_names_stands_in_one_of_its_files():
    text = "".join((ROOT / path).read_text(encoding="utf-8") for path in FILES)
    named = set(re.findall(r"`(test_\w+)`", PAGE))
    assert named
    assert named - set(re.findall(r"def (test_\w+)", text)) == set()
