"""Tables of jumps: settling, and its bound."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.errors import ZenoError
from sitl.lab.reproduction.hybrid_systems import GuardedJump, enabled, settle

THERMOSTAT = {
    "off": (GuardedJump("too_cold", lambda x: x <= 19.0, "on"),),
    "on": (GuardedJump("warm_enough", lambda x: x >= 21.0, "off"),),
}


@given(x=st.floats(-50.0, 50.0), mode=st.sampled_from(["off", "on"]))
def test_settling_twice_is_settling_once(x, mode):
    once, _ = settle(THERMOSTAT, mode, x)
    assert settle(THERMOSTAT, once, x) == (once, [])


def test_hysteresis_keeps_the_mode_inside_its_band():
    assert settle(THERMOSTAT, "off", 20.0) == ("off", [])
    assert settle(THERMOSTAT, "on", 20.0) == ("on", [])


def test_jumps_follow_each_other_at_one_instant():
    chain = {n: (GuardedJump(f"to_{n + 1}", lambda x, n=n: x > n, n + 1),) for n in range(4)} | {4: ()}
    mode, taken = settle(chain, 0, 2.5)
    assert mode == 3
    assert [jump.name for jump in taken] == ["to_1", "to_2", "to_3"]


def test_the_first_enabled_jump_has_priority():
    table = {0: (GuardedJump("first", bool, 1), GuardedJump("second", bool, 2)), 1: (), 2: ()}
    assert enabled(table, 0, True).name == "first"
    assert enabled(table, 0, False) is None


def test_thresholds_without_a_gap_are_an_endless_chain_of_jumps():
    inverted = {
        "off": (GuardedJump("up", lambda x: x <= 21.0, "on"),),
        "on": (GuardedJump("down", lambda x: x >= 19.0, "off"),),
    }
    with pytest.raises(ZenoError, match="up -> down -> up"):
        settle(inverted, "off", 20.0)
