"""Moving home, with the real vehicle node."""

import pytest

from tests.support.gcs.linked_station import LinkedStation


@pytest.mark.long
def test_home_is_moved_to_the_vehicle_and_points_are_relative_to_it(tmp_path):
    link = LinkedStation(tmp_path)
    link.run(2.5)
    link.station.arm(link.now)
    link.run(0.5)
    link.station.take_off(4.0, link.now)
    link.run(9.0)
    link.station.go_to(3.0, -2.0, 5.0, link.now)
    link.run(9.0)
    link.station.set_home(link.now)
    link.run(0.5)
    assert link.snapshot.position.from_home == pytest.approx((0.0, 0.0, 0.0), abs=0.2)
    link.station.go_to(0.0, 2.0, -2.0, link.now)
    link.run(9.0)
    assert link.snapshot.position.p == pytest.approx((3.0, 0.0, -3.0), abs=0.3)
