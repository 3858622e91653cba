"""The compiled loop is the text it is compiled from: the same flights as plain Python, bit for bit."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from protocol.dialect.vocabulary import Law
from tests.support.digests.flight_digest import digests, flights
from tests.support.digests.processors import WIDE

ROOT = Path(__file__).parents[3]
OTHERWISE = {"NUMBA_DISABLE_JIT": "1", "OPENBLAS_CORETYPE": WIDE}  # nor do gains depend on the library's loops


@pytest.fixture(scope="module")
def compiled():
    return digests()


@pytest.fixture(scope="module")
def python():
    ran = subprocess.run(
        [sys.executable, "-m", "tests.support.digests.flight_digest"],
        cwd=ROOT, env=os.environ | OTHERWISE, capture_output=True, text=True,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


@pytest.mark.long
@pytest.mark.parametrize("name", flights())
def test_a_flight_is_the_same_to_the_bit(name, compiled, python):
    assert compiled[name] == python[name]


def test_every_law_is_among_them_and_some_jump():
    begun = flights().values()
    assert {made.law for made in begun} == set(Law)


def test_they_jump_into_the_linear_laws_out_of_the_ground_and_back_to_it(compiled):
    names = {name for _, jumps in compiled.values() for name in jumps}
    assert {"take_off", "touch_down", "enter_linear", "enter_forward_linear", "front_transition"} <= names
