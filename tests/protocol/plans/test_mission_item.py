"""Mission items are equal by their bits on the wire, and always fit it."""

import math

import pytest

from protocol.errors import LocalProtocolError
from protocol.plans.plan import MissionItem
from protocol.wire.codec import Codec
from tests.support.links.link import frame


def test_items_are_equal_when_their_bits_on_the_wire_are():
    one = MissionItem(command=16, frame=3, params=(0.1, math.nan, 0.0, 0.0), x=1, y=2, z=3.0)
    assert one == MissionItem.from_message(Codec(1, 1).decode(frame(one.to_message(0, 1, 1)))[0])
    assert one == MissionItem(command=16, frame=3, params=(0.1, math.nan, 0.0, 0.0), x=1, y=2, z=3.0, current=True)
    assert len({one, MissionItem(command=16, frame=3, params=(0.1, math.nan, -0.0, 0.0), x=1, y=2, z=3.0)}) == 2


@pytest.mark.parametrize("change", [{"command": 70_000}, {"x": 2**31}, {"z": 1e39}, {"params": (0.0, 0.0, 0.0)}])
def test_an_item_that_does_not_fit_the_wire_raises(change):
    fields = {"command": 16, "frame": 3, "params": (0.0, 0.0, 0.0, 0.0), "x": 0, "y": 0, "z": 0.0}
    with pytest.raises(LocalProtocolError):
        MissionItem(**fields | change)
