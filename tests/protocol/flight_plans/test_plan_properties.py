"""For all expressions and all damaged files."""

import math
import operator
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.flight_plans import FlightPlanError, read_flight_plan
from protocol.flight_plans.evaluation import UnknownNameError, evaluate
from protocol.flight_plans.expressions import (
    PRECEDENCE,
    ArrayItem,
    BlockTitle,
    Call,
    LoopVariable,
    Member,
    Negation,
    Number,
    Operation,
    VariableName,
    expression_text,
    parse_expression,
)
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.xml_elements import parse_xml
from tests.support.plans import VOLIERE, source

NAMES = st.from_regex(r"\A[a-z_][a-z0-9_]{0,6}\Z").filter(lambda name: name != "if")
LEAVES = st.one_of(
    st.integers(0, 2**40).map(Number),
    st.floats(0.0, 1e300, allow_nan=False).map(Number),
    NAMES.map(VariableName),
    NAMES.map(LoopVariable),
    st.text("abc GPS-1", max_size=8).map(BlockTitle),
)


def grown(parts):
    calls = st.builds(Call, NAMES, st.lists(parts, max_size=3).map(tuple))
    return st.one_of(
        st.builds(Operation, st.sampled_from(sorted(PRECEDENCE)), parts, parts),
        st.builds(Negation, st.sampled_from("-!"), parts),
        calls,
        st.builds(ArrayItem, NAMES, parts),
        st.builds(Member, calls, NAMES),
    )


TREES = st.recursive(LEAVES, grown, max_leaves=12)

NUMBERS = st.recursive(
    st.floats(-100.0, 100.0, allow_nan=False).map(lambda x: Number(abs(x))),
    lambda parts: st.one_of(
        st.builds(Operation, st.sampled_from(["+", "-", "*", "/", "==", "!=", ">", "<", ">=", "<="]), parts, parts),
        st.builds(Negation, st.just("-"), parts),
    ),
    max_leaves=10,
)
PYTHON = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "==": operator.eq,
    "!=": operator.ne,
    ">": operator.gt,
    "<": operator.lt,
    ">=": operator.ge,
    "<=": operator.le,
}


class NoNames:
    def value(self, name):
        raise UnknownNameError(name)

    loop_value = value

    def item(self, name, _index, _member):
        raise UnknownNameError(name)

    def call(self, name, _arguments):
        raise UnknownNameError(name)


def in_python(tree):
    if isinstance(tree, Number):
        return tree.value
    if isinstance(tree, Negation):
        return -in_python(tree.operand)
    return float(PYTHON[tree.operator](in_python(tree.left), in_python(tree.right)))


@pytest.mark.long
@settings(max_examples=60)
@given(TREES)
def test_what_is_written_is_read_again(tree):
    assert parse_expression(source(expression_text(tree))).tree == tree


@settings(max_examples=60)
@given(NUMBERS)
def test_values_agree_with_python(tree):
    try:
        wanted = in_python(tree)
    except ZeroDivisionError:
        wanted = math.nan
    if not has_whole_quotient(tree):
        try:
            got = evaluate(tree, NoNames())
        except FlightPlanError:
            got = math.nan
        assert got == wanted or (math.isnan(got) and not math.isfinite(wanted))


def has_whole_quotient(tree):
    """Whether the result of comparisons, which is whole, is divided: C then drops what is behind the point."""
    if isinstance(tree, Operation) and tree.operator == "/":
        return True if is_whole(tree.left) and is_whole(tree.right) else any_whole(tree)
    return any_whole(tree)


def any_whole(tree):
    parts = (
        [tree.left, tree.right] if isinstance(tree, Operation) else [tree.operand] if isinstance(tree, Negation) else []
    )
    return any(map(has_whole_quotient, parts))


def is_whole(tree):
    if isinstance(tree, Negation):
        return is_whole(tree.operand)
    if not isinstance(tree, Operation):
        return False
    return PRECEDENCE[tree.operator] in {5, 6} or (is_whole(tree.left) and is_whole(tree.right))


@settings(max_examples=60)
@given(TREES)
def test_evaluation_raises_its_own_error_only(tree):
    with suppress(FlightPlanError):
        evaluate(tree, NoNames())


@given(st.text(max_size=40) | st.text("@ANDORGTLEQ$i'()+-*/%<>=!&|.,0123456789abc ", max_size=40))
def test_any_text_is_read_or_refused(text):
    try:
        tree = parse_expression(source(text)).tree
    except FlightPlanError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert parse_expression(source(expression_text(tree))).tree == tree


ROOM = VOLIERE.read_bytes()
PIECES = st.sampled_from(
    [b"<", b">", b'"', b"&", b"</block>", b"<go wp='p1'/>", b"<!--", b"]]>", b"\0", b"\xff", b"&#0;", b"=", b"9" * 30]
)


@settings(max_examples=80)
@given(st.lists(st.tuples(st.integers(0, len(ROOM)), st.integers(0, 40), PIECES), min_size=1, max_size=3))
def test_a_damaged_file_is_read_or_refused(damages):
    data = ROOM
    for at, length, piece in damages:
        data = data[:at] + piece + data[at + length :]
    try:
        plan = read_flight_plan(data, "t.xml")
    except FlightPlanError as error:
        assert str(error).startswith("t.xml:")  # noqa: PT017
        assert "\n" not in str(error)  # noqa: PT017
    else:
        check_flown(plan)


WRITTEN_VALUES = st.text("ab<&>; \n#x1", max_size=12)


@given(st.lists(st.tuples(WRITTEN_VALUES, st.sampled_from(["", " ", "\n"])), min_size=1, max_size=5))
def test_values_are_read_as_they_are_written_wherever_they_stand(pairs):
    """Also where a value holds what XML does not allow, or attributes touch each other; places are of the file."""
    written, places = "", []
    for tag in ("a", "b"):
        written += f"<{tag}"
        for index, (value, gap) in enumerate(pairs):
            written += (gap if index else " ") + f'n{index}="'
            places.append((value, written.count("\n") + 1, len(written) - written.rfind("\n")))
            written += value + '"'
        written += ">" if tag == "a" else "/></a>"
    try:
        root = parse_xml(written.encode(), "t", lenient=True)
    except FlightPlanError as error:
        assert "undefined entity" in str(error) or "character number" in str(error)  # noqa: PT017
        return
    sources = [*root.attributes.values(), *root.children[0].attributes.values()]
    assert [(source.raw, source.place.line, source.place.column) for source in sources] == places
