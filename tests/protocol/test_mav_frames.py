"""Each MAV_FRAME has one meaning for x, y and z."""

import pytest

from protocol import frames
from protocol.dialect import mavlink

ALTITUDES = (frames.ABSOLUTE_ALTITUDE_FRAMES, frames.RELATIVE_ALTITUDE_FRAMES)


@pytest.mark.parametrize(
    "name", [entry.name for entry in mavlink.enums["MAV_FRAME"].values() if "_GLOBAL" in entry.name]
)
def test_every_global_frame_has_latitude_and_longitude(name):
    assert frames.is_global_frame(getattr(mavlink, name))


@pytest.mark.parametrize("name", ["LOCAL_NED", "LOCAL_ENU", "MISSION", "BODY_NED", "LOCAL_OFFSET_NED", "BODY_FRD"])
def test_no_other_frame_has(name):
    assert not frames.is_global_frame(getattr(mavlink, f"MAV_FRAME_{name}"))


def test_an_altitude_counts_from_one_level_only():
    assert ALTITUDES[0].isdisjoint(ALTITUDES[1])
    assert ALTITUDES[0] | ALTITUDES[1] < frames.GLOBAL_FRAMES


def test_a_frame_with_int_in_its_name_means_the_same():
    numbers = {entry.name: number for number, entry in mavlink.enums["MAV_FRAME"].items()}
    pairs = [(numbers[name], numbers[f"{name}_INT"]) for name in numbers if f"{name}_INT" in numbers]
    assert len(pairs) == 3
    for plain, integer in pairs:
        assert [plain in group for group in ALTITUDES] == [integer in group for group in ALTITUDES]
