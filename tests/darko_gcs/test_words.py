"""Numbers of the dialect in words, those of a newer vehicle too."""

import pytest

from darko_gcs.widgets.panels import LAW_STYLES
from darko_gcs.words import known, label, name
from protocol.dialect.vocabulary import DecisionReason, Law, Reason


def test_every_law_has_a_style():
    assert set(LAW_STYLES) == set(Law)
    assert LAW_STYLES[Law.FAILSAFE] == "bad"


@pytest.mark.parametrize(
    ("kind", "number", "words", "symbol"),
    [
        (Law, 5, "forward line-of-sight", "FORWARD_LINE_OF_SIGHT"),
        (Reason, 4, "take-off", "TAKEOFF"),
        (Law, 12, "law 12", "12"),
        (DecisionReason, 200, "decision reason 200", "200"),
    ],
)
def test_numbers_have_words_and_names_and_unknown_ones_stay_numbers(kind, number, words, symbol):
    assert (label(kind, number), name(kind, number)) == (words, symbol)


def test_an_unknown_number_is_no_member():
    assert known(Law, 1) is Law.HOVER_LINEAR
    assert known(Law, 12) is None
