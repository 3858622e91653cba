"""Disturbances that a person orders, by the command line and while it runs."""

import pytest

from sitl.errors import SitlError
from sitl.motion_capture.cameras import Disturbances, Trouble, read_disturbance


def test_it_lasts_from_its_start_to_its_end():
    planned = Disturbances((read_disturbance("lost@2+1.5"), read_disturbance("swap@3")))
    assert [planned.now(t) for t in (1.99, 2.0, 3.2, 3.5)] == [
        set(), {Trouble.LOST}, {Trouble.LOST, Trouble.SWAP}, {Trouble.SWAP}
    ]  # fmt: skip


@pytest.mark.parametrize(
    "text",
    ["", "lost", "lost@", "gone@1", "lost@-1", "lost@1+", "lost@1+2+3", "lost@1.2.3", "lost@9e9", "lost@2000000"],
)
def test_what_is_none_is_refused_and_shown(text):
    with pytest.raises(SitlError) as caught:
        read_disturbance(text)
    assert repr(text) in str(caught.value)


def test_a_line_that_is_typed_begins_and_ends_them():
    ordered = Disturbances()
    assert ordered.order("dropped 2", 10.0) == "dropped for 2 s"
    assert ordered.order("lost", 11.0) == "lost until ok"
    assert ordered.now(11.5) == {Trouble.DROPPED, Trouble.LOST}
    assert ordered.order("ok", 12.0) == "all disturbances ended"
    assert ordered.now(12.0) == set()


@pytest.mark.parametrize("words", ["what", "lost x", "lost -1", "@@@"])
def test_a_line_that_says_nothing_is_answered(words):
    ordered = Disturbances()
    assert "type lost, swap or dropped" in ordered.order(words, 1.0)
    assert ordered.now(1.0) == set()
