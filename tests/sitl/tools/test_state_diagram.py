"""Tables of jumps drawn as Mermaid state diagrams."""

from typing import NamedTuple

from sitl.tools.state_diagram import mermaid


class Arrow(NamedTuple):
    name: str
    target: str


def test_the_diagram_names_every_jump_with_one_arrow_for_each_pair_of_modes():
    table = {"off": (Arrow("too_cold", "on"),), "on": (Arrow("warm_enough", "off"), Arrow("broken", "off"))}
    assert mermaid(table, str.upper).splitlines() == [
        "stateDiagram-v2",
        "    OFF --> ON: too_cold",
        "    ON --> OFF: warm_enough, broken",
    ]


def test_a_jump_that_most_modes_have_is_drawn_once():
    fall = Arrow("break", "broken")
    table = {"off": (fall, Arrow("start", "on")), "on": (fall,), "idle": (fall,), "broken": ()}
    assert mermaid(table).splitlines() == [
        "stateDiagram-v2",
        '    state "all but broken" as most1',
        "    most1 --> broken: break",
        "    off --> on: start",
    ]
