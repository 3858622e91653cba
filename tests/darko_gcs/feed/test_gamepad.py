"""A gamepad by SDL, which has a virtual one: its axes as sticks, one line where it or pygame is missing."""

import sys

import pytest

from darko_gcs.errors import GroundError
from darko_gcs.feed.gamepad import Gamepad
from darko_gcs.state.sticks import Sticks
from tests.support.gcs.virtual_gamepad import VirtualGamepad


@pytest.fixture
def pad():
    with VirtualGamepad() as pad:
        yield pad


@pytest.mark.parametrize(
    ("axis", "value", "sticks"),
    [
        ("left x", 32767, Sticks(clockwise=1.0)), ("left y", -32768, Sticks(up=1.0)),
        ("left y", 32767, Sticks(up=-1.0)), ("right x", -32768, Sticks(right=-1.0)),
        ("right y", -32768, Sticks(forward=1.0)), ("right y", 2000, Sticks()), ("right x", 17694, Sticks(right=0.5)),
    ],
)  # fmt: skip
def test_the_left_stick_climbs_and_turns_the_right_one_goes(pad, axis, value, sticks):
    gamepad = Gamepad()
    assert gamepad.name == "Virtual Controller"
    pad.move(axis, value)
    assert gamepad.read() == pytest.approx(sticks, abs=1e-3)
    gamepad.close()


def test_one_that_is_unplugged_has_no_sticks(pad):
    gamepad = Gamepad()
    pad.move("left y", -32768)
    assert gamepad.read() is not None
    pad.unplug()
    assert gamepad.read() is None
    gamepad.close()


def test_it_is_let_go_and_taken_again_as_often_as_one_likes(pad):
    for _ in range(4):
        gamepad = Gamepad()
        for value, up in ((-32768, 1.0), (0, 0.0)):
            pad.move("left y", value)
            assert gamepad.read() == pytest.approx(Sticks(up=up))
        gamepad.close()


def test_without_pygame_or_a_gamepad_there_is_one_line(monkeypatch):
    with pytest.raises(GroundError, match="no gamepad is connected"):  # SDL's own word on this machine
        Gamepad()
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(GroundError, match=r"pip install 'darko\[joystick\]'"):
        Gamepad()
