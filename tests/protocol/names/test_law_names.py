"""Display names of the control laws."""

from protocol.dialect.vocabulary import Law
from protocol.names import law_label, law_words


def test_the_law_of_a_transition_is_called_as_the_transition():
    assert [law_label(law) for law in (Law.HOVER_LINEAR, Law.TO_FORWARD, Law.TO_HOVER, Law.INDI)] == [
        "hover linear",
        "front transition",
        "back transition",
        "INDI",
    ]
    assert [law_words(name) for name in ("TO_FORWARD", "HOVER_ZERO_MOMENT")] == [
        "front transition",
        "hover zero-moment",
    ]


def test_no_two_laws_have_one_label_and_an_unknown_one_has_its_number():
    assert len({law_label(law) for law in Law}) == len(Law)
    assert (law_label(99), law_words("SOME_LAW")) == ("law 99", "some law")
