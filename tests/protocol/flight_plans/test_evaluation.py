"""Evaluates expressions against a table of names, with C's rules of whole and real numbers."""

import pytest

from protocol.flight_plans import FlightPlanError
from protocol.flight_plans.evaluation import UnknownNameError, evaluate, truth
from protocol.flight_plans.expressions import parse_expression
from tests.support.plans import source


class Names:
    """One of everything; calls are counted."""

    def __init__(self):
        self.calls = []

    def value(self, name):
        try:
            return {"a": 3, "nav.radius": 1.5, "big": 2**62}[name]
        except KeyError:
            raise UnknownNameError(f"{name}: no such variable") from None

    def item(self, name, index, member):
        if (name, member) != ("waypoints", "a"):
            raise UnknownNameError(f"{name}[]: no such array")
        return 10.0 * index

    def loop_value(self, _name):
        return 4

    def call(self, name, arguments):
        self.calls.append((name, tuple(arguments)))
        return {"point": {"x": 1.0, "z": 2.5}, "one": 1}[name]


def value(text, names=None):
    return evaluate(parse_expression(source(text)).tree, names or Names())


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("7/2", 3),
        ("-7/2", -3),
        ("7/2.", 3.5),
        ("-7 % 3", -1),
        ("7.5 % 2", 1.5),
        ("2**10", 1024),
        ("big - 1 + big", 2**63 - 1),
        ("1 - big - big", 1 - 2**63),
        ("2**-1", 0.5),
        ("2**52", 2**52),
        ("2**53", 2.0**53),
        ("(-2)**53", -(2.0**53)),
        ("a*$i - nav.radius", 10.5),
        ("1 == 1.0", 1),
        ("3 > 2 > 1", 0),
        ("!0 + !5", 1),
        ("0 || 0", 0),
        ("0 || 5", 1),
        ("5 && 0", 0),
        ("5 && 7", 1),
        ("0 / 5", 0),
        ("7 / -2", -3),
        ("-7 / -2", 3),
        ("6 & 3 | 8", 10),
        ("point()->z", 2.5),
    ],
)
def test_values(text, wanted):
    assert value(text) == wanted
    assert isinstance(value(text), type(wanted))


def test_only_what_decides_is_called():
    names = Names()
    assert value("0 && one()", names) == 0
    assert value("1 || one()", names) == 1
    assert names.calls == []
    assert value("one() || 0", names) == 1
    assert names.calls == [("one", ())]


def test_texts_and_references_are_handed_to_functions():
    names = Names()
    value("one('Wait GPS', &nav.radius, 1+1)", names)
    assert names.calls == [("one", ("Wait GPS", "nav.radius", 2))]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1/0", "division by zero"),
        ("1 % 0.0", "division by zero"),
        ("10.0**400", "not a number"),
        ("big * big", "not a number"),
        ("big + big", "not a number"),
        ("0 - big - big", "not a number"),
        ("(0-8.0)**0.5", "not a number"),
        ("nowhere", "nowhere: no such variable"),
        ("point()", "name one of x, z"),
        ("point()->y", "no field y"),
        ("'a text'", "'a text' is not a number"),
    ],
)
def test_what_has_no_value_is_refused_with_its_place(text, words):
    with pytest.raises(FlightPlanError, match=r"^t:1:") as caught:
        value(text)
    assert words in str(caught.value)


def test_truth():
    names = Names()
    assert truth(parse_expression(source("0.5")).tree, names)
    assert not truth(parse_expression(source("0.0")).tree, names)
