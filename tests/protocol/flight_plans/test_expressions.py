"""Reads expressions: C's operators and precedence, the @-words that XML makes necessary, and ** for powers."""

import pytest

from protocol.flight_plans import FlightPlanError
from protocol.flight_plans.expressions import (
    ArrayItem,
    BlockTitle,
    Call,
    LoopVariable,
    Member,
    Number,
    Operation,
    VariableName,
    expression_text,
    parse_expression,
    parse_script,
    parse_target,
    script_text,
)
from tests.support.plans import source


def tree(text):
    return parse_expression(source(text)).tree


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("1+2*3", "1+(2*3)"),
        ("1-2-3", "(1-2)-3"),
        ("2**3**2", "2**(3**2)"),
        ("-2**2", "-(2**2)"),
        ("2**-1", "2**(-1)"),
        ("!a == b", "(!a) == b"),
        ("a @AND b @OR c @AND d", "(a && b) || (c && d)"),
        ("a @GT b + 1", "a > (b + 1)"),
        ("a @GEQ 1 @AND b @LEQ 2 @AND c @LT 3", "(a >= 1 && b <= 2) && c < 3"),
        ("a | b & c", "a | (b & c)"),
        ("stateGetPositionEnu_f() @DEREF z", "stateGetPositionEnu_f()->z"),
        ("nav->radius", "nav.radius"),
        ("0x10", "16"),
        (" TRUE ", "TRUE"),
        ("+5", "5"),
    ],
)
def test_groups_and_spellings(text, same):
    assert tree(text) == tree(same)


def test_what_parts_are():
    assert tree("9600.") == Number(9600.0)
    assert tree("0.0f") == Number(0.0)
    assert tree("7") == Number(7) != Number(7.0)
    assert tree("$i") == LoopVariable("i")
    assert tree("guidance_v.delta_t") == VariableName("guidance_v.delta_t")
    assert tree("f()->x") == Member(Call("f", ()), "x")
    assert tree("IndexOfBlock('Wait GPS')") == Call("IndexOfBlock", (BlockTitle("Wait GPS"),))


@pytest.mark.parametrize(
    ("text", "column", "words"),
    [
        ("", 1, "ends too early"),
        ("1 +", 4, "ends too early"),
        ("f(1, ", 6, "ends too early"),
        ("a b", 3, "'b'"),
        ("12abc", 1, "'12abc'"),
        ("f(,)", 3, "',)'"),
        ("a = 2", 3, "'= 2'"),
        ("#", 1, "'#'"),
        ("99999999999999999999", 1, "too large"),
        ("1e999", 1, "too large"),
    ],
)
def test_faults_have_a_column(text, column, words):
    with pytest.raises(FlightPlanError, match=r"^t:1:") as caught:
        tree(text)
    assert caught.value.place.column == column
    assert words in caught.value.reason
    assert "\n" not in str(caught.value)


def test_depth_and_length_are_bounded():
    for text in ("!" * 98 + "a", "+".join("a" * 200), "f(" * 200 + ")" * 200, "a" * 5000):
        with pytest.raises(FlightPlanError, match=r"more than|longer"):
            tree(text)
    tree("(" * 500 + "a" + ")" * 500)  # parentheses alone are no depth


def test_an_expression_has_100_parts_in_each_other_and_4000_characters_at_most():
    deepest = "!" * 97 + "a"  # and a variable, which has a path, which has a name
    assert expression_text(tree(deepest)) == deepest
    with pytest.raises(FlightPlanError, match="nested more than 100 levels deep"):
        tree("!" + deepest)
    longest = "a".ljust(4000)
    assert tree(longest) == tree("a")
    with pytest.raises(FlightPlanError, match="longer than 4000 characters"):
        tree(longest + " ")


def test_an_expression_and_a_script_mean_the_same_however_they_are_spaced():
    assert parse_expression(source("1+2")) == parse_expression(source(" 1 + 2"))
    assert parse_script(source("f( 1 ); g()")) == parse_script(source(" f(1);g()"))


def test_statements():
    script = parse_script(source("if(!InsideKill(GetPosX(), 1)) NavKillThrottle(); nav.heading = 2;"))
    first, second = script.instructions
    assert first.condition is not None
    assert first.expression == Call("NavKillThrottle", ())
    assert (second.target, second.expression) == (VariableName("nav.heading"), Number(2))
    assert parse_script(source(script_text(script))) == script
    with pytest.raises(FlightPlanError, match="not expected"):
        parse_script(source("while(1) f()"))


def test_a_value_is_stored_in_a_variable_a_coordinate_or_an_item_of_an_array():
    item = ArrayItem("waypoints", VariableName("WP_A"), "enu_f.z")
    for text, target in (
        ("ap_state->commands[2]", ArrayItem("ap_state.commands", Number(2))),
        ("WaypointAlt(WP_A)", Call("WaypointAlt", (VariableName("WP_A"),))),
        ("waypoints[WP_A].enu_f.z", item),
    ):
        assert parse_target(source(text)).tree == target
        (instruction,) = parse_script(source(f"{text} = 3")).instructions
        assert (instruction.target, instruction.expression) == (target, Number(3))
    assert tree("1 + waypoints[WP_A].enu_f.z") == Operation("+", Number(1), item)
    assert parse_script(source(script_text(parse_script(source("waypoints[1].a = 2"))))).instructions[0].target == (
        ArrayItem("waypoints", Number(1), "a")
    )
    with pytest.raises(FlightPlanError, match="not expected"):
        parse_target(source("a + 1"))


def test_written_expressions_need_no_references_in_xml():
    text = expression_text(tree("a < 1 && b <= 2 || c > 3"))
    assert not set(text) & set("<&")
    assert tree(text) == tree("a < 1 && b <= 2 || c > 3")


OPERATORS = ["||", "&&", "|", "&", "==", "!=", ">", "<", ">=", "<=", "+", "-", "*", "/", "%", "**"]


@pytest.mark.parametrize("outer", OPERATORS)
def test_parentheses_are_written_where_the_tree_needs_them_and_nowhere_else(outer):
    for inner in OPERATORS:
        for grouped in (f"(a {inner} b) {outer} c", f"a {outer} (b {inner} c)"):
            written = expression_text(tree(grouped))
            assert tree(written) == tree(grouped)
            plain = grouped.replace("(", "").replace(")", "")
            assert ("(" in written) == (tree(plain) != tree(grouped))


@pytest.mark.parametrize(
    "text", ["7", "'title'", "name.part", "$i", "f(&name)", "-a", "!a", "a + b", "a[2]", "f(1)", "f()->x", "&name"]
)
def test_a_part_is_the_same_wherever_it_stands_and_knows_where(text):
    assert tree(text) == tree(f"   {text}")
    assert tree(text) != tree("other")
    assert [tree(" " * by + text).place.column - by for by in (0, 3)] == [tree(text).place.column] * 2


@pytest.mark.parametrize("text", ["7", "'title'", "name.part", "$i", "f(1)", "a[2]"])
def test_an_atom_at_the_beginning_stands_in_the_first_column(text):
    assert tree(text).place.column == 1
