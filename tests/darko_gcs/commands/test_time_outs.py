"""A command that is not done in time says what it waited for, what is missing and what it saw last."""

import json
from contextlib import asynccontextmanager

import pytest

from darko_gcs import __main__ as program
from darko_gcs.scripting import Vehicle
from tests.support.gcs.plan_holder import PlanHolder


@pytest.fixture(autouse=True)
def silent_vehicle(monkeypatch):
    """A vehicle that hovers and does nothing more."""

    @asynccontextmanager
    async def connect(*_, **__):
        yield Vehicle(PlanHolder())

    monkeypatch.setattr("darko_gcs.scripting.connect", connect)
    monkeypatch.setattr(PlanHolder, "land", None, raising=False)
    monkeypatch.setattr("darko_gcs.scripting.vehicle.Vehicle._command", lambda *_: _nothing())


async def _nothing():
    pass


@pytest.mark.parametrize(
    ("words", "missing"),
    [
        (["cmd", "takeoff", "50", "--wait"], "a height of 49.5 m (it is at "),
        (["cmd", "goto", "500", "0", "8", "--wait"], "the place ("),
        (["cmd", "land", "--wait"], "the motors to stop"),
    ],
)
def test_what_a_command_waited_for_is_told(words, missing, capsys):
    assert program.main([*words, "--timeout", "0.05", "--json"]) == 4
    told = json.loads(capsys.readouterr().out)
    assert told["error"].startswith(f"not done within 0.05 s: waited for {missing}")
    assert "; last seen: " in told["error"]
    assert told["waited_for"].startswith(missing)
    assert (told["command"], told["seen"]["armed"]) == (f"cmd {words[1]}", True)


def test_a_person_reads_the_same_on_stderr(capsys):
    assert program.main(["cmd", "land", "--wait", "--timeout", "0.05"]) == 4
    said = capsys.readouterr()
    assert said.out == ""
    assert "not done within 0.05 s: waited for the motors to stop; last seen: " in said.err
