"""The effect of a fence and rally points on a vehicle, in words before they are sent."""

import pytest

from darko_gcs.state.fence_shapes import obedience_words
from tests.support.gcs.snapshots import HOVERING, snapshot_with


@pytest.mark.parametrize(
    ("action", "has_fence", "has_rally", "words"),
    [
        (None, False, False, ""),
        (2.0, False, False, ""),
        (None, True, False, " The vehicle obeys the fence at once."),
        (None, True, True, " The vehicle obeys fence and rally points at once."),
        (2.0, False, True, " The vehicle obeys the rally points at once."),
        (2.0, True, False, " From now on the vehicle holds at the fence (GF_ACTION)."),
        (
            3.0,
            True,
            True,
            " From now on the vehicle returns at the fence (GF_ACTION), and a return may end at a rally point.",
        ),
        (0.0, True, False, " The vehicle ignores the fence (GF_ACTION 0)."),
        (float("nan"), True, False, " The vehicle ignores the fence (GF_ACTION nan)."),
    ],
)
def test_the_words_follow_the_parameter_and_what_is_sent(action, has_fence, has_rally, words):
    s = snapshot_with(HOVERING, parameters={"values": {} if action is None else {"GF_ACTION": action}})
    assert obedience_words(s, has_fence=has_fence, has_rally=has_rally) == words
