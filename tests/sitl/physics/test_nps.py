import math

import pytest

from protocol.frames import multiply, rotate
from sitl.errors import SitlError
from sitl.physics.nps import BulletFDM
from tests.support.foreign_autopilots import HoverPilot


class Nps:
    """An observation as nps_fdm_pybullet.c takes it: NED, and the attitude of the body FRD."""

    def __init__(self, told):
        assert all(isinstance(part, tuple) and all(isinstance(x, float) for x in part) for part in told.values())
        self.position, self.velocity = self._ned(told["pos"]), self._ned(told["vel"])
        x, y, z, w = told["quat"]
        half = 1.0 / math.sqrt(2.0)
        self.attitude = multiply((w, y, x, -z), (half, 0.0, 0.0, half))
        back = (self.attitude[0], *(-part for part in self.attitude[1:]))
        self.rates = rotate(back, self._ned(told["ang_v"]))
        north, east, down = self._ned(told["accel"])
        self.force = rotate(back, (north, east, down - 10.0))  # its own gravity

    @staticmethod
    def _ned(v):
        return v[1], v[0], -v[2]


def test_on_the_ground_it_stands_level_in_the_hover_frame():
    fdm = BulletFDM(1 / 512, GUI=False, urdf="darko")
    for _ in range(20):
        seen = Nps(fdm.step([0.0, 0.0, 0.0, 0.0]))
    assert seen.attitude == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-6)
    assert seen.position == pytest.approx((0.0, 0.0, -0.108), abs=1e-2)
    assert seen.force == pytest.approx((0.0, 0.0, -10.0), abs=0.1)


def test_its_clock_is_that_of_nps():
    fdm = BulletFDM(1 / 512)
    for _ in range(512):
        fdm.step([0.0] * 4)
    assert fdm.rig.vehicle.time == pytest.approx(1.0 + 0.002, abs=0.0021)


@pytest.mark.long
def test_by_nps_a_pilot_takes_off_and_holds_a_place():
    fdm, pilot, dt = BulletFDM(0.002), HoverPilot((0.3, -0.2, -2.0)), 0.002
    seen = Nps(fdm.step([0.0] * 4))
    for _ in range(3000):
        seen = Nps(fdm.step(pilot.shares(seen.position, seen.velocity, seen.attitude, seen.rates, dt)))
    assert math.dist(seen.position, pilot.place) < 0.4


def test_an_airframe_that_is_not_there_is_one_line():
    with pytest.raises(SitlError, match=r"robobee\.urdf"):
        BulletFDM(0.002, GUI=False, urdf="robobee.urdf")
