"""Programs and commands that fly the real process: docs/scripting.md's examples, and a flight by commands."""

import re
from functools import partial

import pytest

from tests.e2e.support import BRISK, ROOT, answered, free_ports, vehicle

EXAMPLES = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "scripting.md").read_text("utf-8"), re.DOTALL)


@pytest.fixture(scope="module")
def port(tmp_path_factory):
    """Of a vehicle that flies."""
    (number,) = free_ports(1)
    with vehicle(number, tmp_path_factory.mktemp("scripting"), "--speed", "10", "--nav", "truth", *BRISK):
        yield number


@pytest.mark.long
@pytest.mark.parametrize(
    ("number", "said"),
    [
        (0, r"now 2\.0\nlanding refused: .*not in the air.*\nlanded \[(9|10)\.\d, -?0\.\d, -?0\.\d\]"),
        (1, r"6 items flown, V at most \d+, \d+ jumps"),
    ],
)
def test_the_examples_fly(port, number, said, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    program = EXAMPLES[number].replace("connect()", f"connect(port={port})")
    exec(program, {"__name__": "__main__"})  # noqa: S102 - our own examples; a process of its own takes a second more
    out = capsys.readouterr().out
    assert re.search(said, out), out


@pytest.mark.long
def test_a_flight_by_commands(port, capsys):
    answer = partial(answered, capsys, port)
    assert answer("cmd", "arm", "--wait")[1]["armed"] is True
    assert answer("cmd", "takeoff", "4", "--wait")[0] == 0
    assert answer("cmd", "goto", "3", "-2", "5", "--wait")[0] == 0
    assert answer("cmd", "rtl", "--wait")[1]["armed"] is False
