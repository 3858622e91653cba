"""Differences of two plans: items changed, added and removed, with the fields that differ."""

from dataclasses import replace

import pytest

from darko_gcs.state.plan_difference import change_text, changed_range, item_now, plan_changes
from protocol.plans import load
from tests.support.paths import DATA

PLAN = load(DATA / "square.plan").items


def texts(old, new):
    return [change_text(change) for change in plan_changes(old, new)]


def test_the_same_plans_do_not_differ():
    assert texts(PLAN, PLAN) == []
    assert changed_range(PLAN, PLAN) is None


def test_a_changed_item_is_told_with_its_fields():
    new = (*PLAN[:2], replace(PLAN[2], params=(5.0, *PLAN[2].params[1:]), z=8.0), *PLAN[3:])
    assert texts(PLAN, new) == ["~ 2  hold 2 -> 5, alt 3 -> 8"]
    assert changed_range(PLAN, new) == range(2, 3)


def test_added_and_removed_items_are_told_with_what_they_are():
    assert texts(PLAN, (*PLAN[:3], *PLAN[4:])) == [
        "- 3  Waypoint hold 2, acceptance 0.3 lat 43.5648000 lon 1.4811495 alt 3"
    ]
    assert texts(PLAN[:5], PLAN) == ["+ 5  Land lat 43.5648000 lon 1.4811000 alt 0"]
    assert changed_range(PLAN[:5], PLAN) is None


def test_another_command_and_frame_are_told():
    new = (replace(PLAN[0], command=16, frame=0), *PLAN[1:])
    (text,) = texts(PLAN, new)
    assert "command Take off -> Waypoint" in text
    assert "frame rel -> AMSL" in text


def test_a_difference_too_small_for_the_text_is_told_all_the_same():
    (text,) = texts(PLAN, (replace(PLAN[0], z=3.0000002), *PLAN[1:]))
    assert text.startswith("~ 0  z 3 -> 3.0000002")


@pytest.mark.parametrize(
    ("new", "seq", "now"),
    [
        (PLAN, 2, 2),
        ((PLAN[1], *PLAN), 2, 3),
        ((*PLAN[:1], *PLAN[2:]), 2, 1),
        ((*PLAN[:2], replace(PLAN[2], z=9.0), *PLAN[3:]), 2, 2),
        ((*PLAN[:2], *PLAN[3:]), 2, None),
    ],
)
def test_an_item_is_found_again_in_the_new_plan(new, seq, now):
    assert item_now(PLAN, new, seq) == now
