"""A gamepad by SDL: its axes as sticks, one line where it or pygame is missing."""

import sys
from types import SimpleNamespace

import pytest

from darko_gcs.errors import GroundError
from darko_gcs.feed.gamepad import Gamepad
from darko_gcs.state.sticks import Sticks

AXES = ("LEFTX", "LEFTY", "RIGHTX", "RIGHTY")


class Pad:
    """A pad of SDL, with the positions of its axes."""

    name = "Test Pad"

    def __init__(self):
        self.axes, self.is_attached = dict.fromkeys(range(4), 0), True

    def attached(self):
        return self.is_attached

    def get_axis(self, number):
        return self.axes[number]


@pytest.fixture
def pad(monkeypatch):
    """The second device is a pad that SDL knows; the first is a joystick that it does not know."""
    pad, calls = Pad(), []
    pygame = SimpleNamespace(
        display=SimpleNamespace(init=lambda: calls.append("display")),
        event=SimpleNamespace(pump=lambda: calls.append("pump")),
        quit=lambda: calls.append("quit"),
        **{f"CONTROLLER_AXIS_{name}": number for number, name in enumerate(AXES)},
    )
    controller = SimpleNamespace(
        init=lambda: calls.append("init"),
        get_count=lambda: 2,
        is_controller=lambda number: number == 1,
        Controller=lambda number: {1: pad}[number],
    )
    monkeypatch.setitem(sys.modules, "pygame", pygame)
    monkeypatch.setitem(sys.modules, "pygame._sdl2.controller", controller)
    pad.calls = calls
    return pad


@pytest.mark.parametrize(
    ("axis", "value", "sticks"),
    [
        (0, 32767, Sticks(clockwise=1.0)), (1, -32768, Sticks(up=1.0)), (1, 32767, Sticks(up=-1.0)),
        (2, -32768, Sticks(right=-1.0)), (3, -32768, Sticks(forward=1.0)), (3, 2000, Sticks()),
        (2, 17694, Sticks(right=0.5)),
    ],
)  # fmt: skip
def test_the_left_stick_climbs_and_turns_the_right_one_goes(pad, axis, value, sticks):
    pad.axes[axis] = value
    gamepad = Gamepad()
    assert gamepad.name == "Test Pad"
    assert gamepad.read() == pytest.approx(sticks, abs=1e-3)
    gamepad.close()
    assert pad.calls[-2:] == ["pump", "quit"]


def test_one_that_is_unplugged_has_no_sticks(pad):
    gamepad = Gamepad()
    pad.is_attached = False
    assert gamepad.read() is None


def test_without_pygame_or_a_gamepad_there_is_one_line(monkeypatch):
    with pytest.raises(GroundError, match="no gamepad is connected"):  # SDL's own word on this machine
        Gamepad()
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(GroundError, match=r"pip install 'darko\[joystick\]'"):
        Gamepad()
