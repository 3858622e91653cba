"""Format of a written plan: two blanks for each level, and attributes in the words of the file format."""

from protocol.flight_plans import render_flight_plan
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
