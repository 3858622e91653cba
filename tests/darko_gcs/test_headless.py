"""A scripted flight waits for its own vehicle to compile, and not for ever."""

import argparse
import asyncio
import sys

import pytest

from darko_gcs import child, headless
from darko_gcs.errors import LinkError
from tests.support.paths import DATA

COMPILING = "print('darko-sitl: compiling', file=sys.stderr, flush=True); "
READY = "print('darko-sitl: ready after 0.1 s: 127.0.0.1:1 -> 2', file=sys.stderr, flush=True); "


@pytest.fixture
def fly(tmp_path, monkeypatch):
    """Flies with a vehicle process that does what a line of Python says; gives what the flight fails with."""

    def flown(program, **limits):
        script = tmp_path / "darko-sitl"
        script.write_text(f"#!{sys.executable}\nimport sys, time; {program}\n")
        script.chmod(0o755)
        monkeypatch.setattr(child, "PROGRAM", script)
        for name, seconds in limits.items():
            monkeypatch.setattr(headless, name, seconds)
        args = argparse.Namespace(
            mission=DATA / "square.plan", signing_key=None, give_key=False, record=tmp_path / "flight.tlog",
            vehicle=None, host="127.0.0.1", port=0, sitl=True, state_dir=None, timeout=60.0,
        )  # fmt: skip
        with pytest.raises(LinkError) as caught:
            asyncio.run(headless.fly_headless(args, []))
        return str(caught.value)

    return flown


def test_a_vehicle_that_compiles_longer_than_one_is_listened_for_is_waited_for(fly, capsys):
    assert fly(COMPILING + "time.sleep(1.5); sys.exit(7)", HEARD_WITHIN=0.2) == "darko-sitl ended with exit code 7"
    assert "compiling" in capsys.readouterr().err


def test_one_that_is_ready_must_be_heard(fly):
    assert fly(COMPILING + READY + "time.sleep(60)", HEARD_WITHIN=0.2) == "no vehicle heard for 0.2 s"


def test_one_that_is_never_ready_is_given_up(fly):
    assert fly(COMPILING + "time.sleep(60)", READY_WITHIN=0.5) == "no vehicle heard for 0.5 s"
