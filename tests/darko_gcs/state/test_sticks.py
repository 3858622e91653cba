"""Sticks by the keys of a terminal, which tells presses and never releases."""

import pytest

from darko_gcs.state.sticks import DEAD_MAN_TIME, KeySticks, Sticks


def test_the_message_has_the_axes_of_mavlink():
    told = Sticks(forward=1.0, right=-0.5, up=-1.0, clockwise=0.25).message((7, 1))
    assert (told.target, told.x, told.y, told.z, told.r) == (7, 1000, -500, 0, 250)
    assert Sticks().message((1, 1)).z == 500


def test_a_press_is_a_nudge():
    keys = KeySticks(0.0)
    keys.press("up", 1.0)
    assert keys.sticks(1.29) == Sticks(forward=0.5)
    assert keys.sticks(1.31) == Sticks()


def test_a_held_key_flies_on_and_stops_soon_after_it_is_released():
    keys = KeySticks(0.0)
    keys.press("w", 1.0)
    for k in range(30):  # the repetitions begin after half a second
        keys.press("w", 1.5 + k / 30.0)
        assert keys.sticks(1.5 + k / 30.0 + 0.03) == Sticks(up=0.5)
    last = 1.5 + 29 / 30.0
    assert keys.sticks(last + 0.14).up == 0.5
    assert keys.sticks(last + 0.16).up == 0.0


def test_two_keys_add_and_opposite_ones_cancel():
    keys = KeySticks(0.0)
    for key in ("up", "right", "a"):
        keys.press(key, 1.0)
    assert keys.sticks(1.1) == Sticks(forward=0.5, right=0.5, clockwise=-0.5)
    keys.press("down", 1.1)
    assert keys.sticks(1.2) == Sticks(right=0.5, clockwise=-0.5)
    keys.centre()
    assert keys.sticks(1.2) == Sticks()


def test_the_deflection_has_steps_and_ends():
    keys = KeySticks(0.0)
    shown = []
    for step in (1, 1, -1, -1, -1):
        keys.change_deflection(step)
        shown.append(keys.deflection)
    assert shown == [1.0, 1.0, 0.5, 0.25, 0.25]


def test_a_pilot_who_touches_nothing_counts_as_gone():
    keys = KeySticks(5.0)
    assert keys.time_left(6.0) == pytest.approx(DEAD_MAN_TIME - 1.0)
    keys.touch(12.0)
    assert keys.time_left(13.0) == pytest.approx(DEAD_MAN_TIME - 1.0)
    assert keys.time_left(99.0) == 0.0
