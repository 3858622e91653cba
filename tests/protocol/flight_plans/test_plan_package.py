"""Writes a flight plan as one file: as it is saved, and as it is sent to a vehicle with what its names mean."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.flight_plans import FlightPlanError, read_flight_plan, render_flight_plan
from protocol.flight_plans.plan_names import FUNCTIONS, VARIABLES, NameMapping, parse_name_mapping
from protocol.flight_plans.plan_package import pack_plan, unpack_plan
from tests.support.plans import plan_of

BEFORE = """<!-- sectors --><sectors><sector name="S"><!-- first --><corner name="A"/><corner name="B"/>
<corner name="C"/></sector></sectors><modules><module name="m"><!-- option --><define name="D" value="1"/><!-- end -->
</module></modules>"""
BLOCKS = """<!-- a block --><block name="b"><exception cond="0" deroute="b"/><while><!-- inner --><stay wp="A"/></while>
<!-- end of the block --></block><!-- the last -->"""


def test_each_line_is_indented_by_two_blanks_for_each_element_around_it():
    depth = 0
    for line in filter(None, render_flight_plan(plan_of(BLOCKS, BEFORE)).split("\n")):
        text = line.lstrip()
        depth -= text.startswith("</")
        assert len(line) - len(text) == 2 * depth, line
        depth += not text.endswith("/>") and not text.startswith(("</", "<!"))
    assert depth == 0


def test_flags_are_written_as_true_and_false():
    plan = plan_of(
        '<block name="b"><call fun="f()" loop="0" break="1"/><call_once fun="g()" break="false"/>'
        '<call fun="h()" loop="TRUE"/></block>'
    )
    written = render_flight_plan(plan)
    assert '<call fun="f()" loop="FALSE" break="TRUE"/>' in written
    assert '<call_once fun="g()" break="FALSE"/>' in written
    assert '<call fun="h()"/>' in written  # a loop is the default


PLAN = plan_of('<!-- <?darko-names --><block name="a"><call fun="nav_fish_run(1)"/></block>')
NAMES = """
[functions]
nav_fish_run = 0
TakePosition = "NavSetWaypointHere"
[variables]
AP_MODE_GUIDED = 13
"electrical.current" = -1e-5
speed_limit = "nav.radius"
"""
KEYS = st.from_regex(r"x_[A-Za-z0-9]{1,5}(\.[a-z]{1,4})?", fullmatch=True)
NUMBERS = st.integers(-(10**9), 10**9) | st.floats(allow_nan=False, allow_infinity=False)


def test_plan_and_names_come_back():
    mapping = parse_name_mapping(NAMES, "names.toml")
    assert unpack_plan(pack_plan(PLAN, mapping), "sent") == (PLAN, mapping)


@settings(max_examples=25)
@given(
    st.dictionaries(KEYS, NUMBERS | st.sampled_from(sorted(FUNCTIONS))),
    st.dictionaries(KEYS, NUMBERS | st.sampled_from(sorted(VARIABLES))),
)
def test_any_names_come_back(functions, variables):
    unpacked = unpack_plan(pack_plan(PLAN, NameMapping(functions, variables)), "sent").mapping
    assert (dict(unpacked.functions), dict(unpacked.variables)) == (functions, variables)


def test_without_names_it_is_the_plan_alone():
    assert pack_plan(PLAN) == pack_plan(PLAN, NameMapping()) == render_flight_plan(PLAN).encode()
    assert unpack_plan(pack_plan(PLAN), "sent") == (PLAN, NameMapping())


def test_other_readers_pass_over_the_names():
    assert read_flight_plan(pack_plan(PLAN, parse_name_mapping(NAMES, "n")), "sent") == PLAN


@pytest.mark.parametrize(
    "content",
    [
        pack_plan(PLAN) + b"<?other-tool x?>\n",
        pack_plan(PLAN) + b"<!-- <?darko-names\n[functions] -->",
        pack_plan(PLAN) + b"<!-- <?darko-names\n[functions]\n?> -->",
        b"<?darko-names\n[functions]\n?>" + pack_plan(PLAN) + b"<?other-tool x?>",
    ],
)
def test_a_plan_that_does_not_end_with_names_has_none(content):
    assert unpack_plan(content, "sent").mapping == NameMapping()


def test_names_that_are_cut_off_are_refused():
    whole = pack_plan(PLAN, parse_name_mapping(NAMES, "n"))
    with pytest.raises(FlightPlanError, match="not XML"):
        unpack_plan(whole.rstrip().removesuffix(b"?>"), "sent")


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (b"[functions]\nf = nowhere\n", "names of sent: not TOML"),
        (b"[functions]\nf = 'Nowhere'\n", "is not a known function"),
        (b"[functions]\nf = '\xff'\n", "not"),
    ],
)
def test_names_that_are_refused(names, words):
    with pytest.raises(FlightPlanError, match=words):
        unpack_plan(pack_plan(PLAN) + b"<?darko-names\n" + names + b"?>\n", "sent")
