"""Tables of jumps drawn as Mermaid state diagrams."""

from typing import NamedTuple

from sitl.tools.plotting import mermaid


class Arrow(NamedTuple):
    name: str
    target: str


def test_the_diagram_draws_every_jump_with_the_given_labels():
    table = {"off": (Arrow("too_cold", "on"),), "on": (Arrow("warm_enough", "off"), Arrow("broken", "off"))}
    assert mermaid(table, str.upper).splitlines() == [
        "stateDiagram-v2",
        "    OFF --> ON: too_cold",
        "    ON --> OFF: warm_enough",
        "    ON --> OFF: broken",
    ]
