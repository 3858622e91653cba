"""A script's upload is read back, unless it says otherwise."""

import argparse
import asyncio
from dataclasses import replace

import pytest

from darko_gcs.commands import fly, mission
from darko_gcs.errors import FlightError
from darko_gcs.scripting import Vehicle
from protocol.plans import load
from tests.support.gcs.plan_holder import PlanHolder
from tests.support.paths import DATA

ITEMS = tuple(load(DATA / "square.plan").items)


def lower(items):
    """Another height for the second item."""
    return (items[0], replace(items[1], z=1.0), *items[2:])


def upload(holder, **options):
    return asyncio.run(Vehicle(holder).upload(ITEMS, **options))


def test_what_the_vehicle_holds_is_compared():
    assert upload(PlanHolder()) == len(ITEMS)
    with pytest.raises(FlightError, match=r"the vehicle holds something else: ~ 1  alt 3 -> 1$") as caught:
        upload(PlanHolder(lower))
    assert caught.value.exit_code == 4


def test_a_vehicle_that_changes_what_it_is_sent_need_not_be_asked():
    assert upload(PlanHolder(lower), verify=False) == len(ITEMS)


@pytest.mark.parametrize(("command", "words"), [(mission, ["upload", "x.plan"]), (fly, ["--mission", "x.plan"])])
def test_it_is_read_back_unless_the_command_says_not(command, words):
    parser = command.parser({"mission": "x", "fly": "x"})
    assert isinstance(parser, argparse.ArgumentParser)
    assert parser.parse_args(words).verify
    assert not parser.parse_args([*words, "--no-verify"]).verify


@pytest.mark.parametrize(("options", "said"), [([], "read back and identical"), (["--no-verify"], "not read back")])
def test_the_answer_says_whether_it_was_read_back(options, said, monkeypatch, capsys):
    monkeypatch.setattr("darko_gcs.commands.options._connected", lambda _, job: job(Vehicle(PlanHolder())))
    words = ["upload", str(DATA / "square.plan"), *options]
    parser = mission.parser({"mission": "x"})
    assert mission.run(parser.parse_args(words)) == 0
    assert said in capsys.readouterr().out
    assert mission.run(parser.parse_args([*words, "--json"])) == 0
    assert f'"verified": {"false" if options else "true"}' in capsys.readouterr().out
