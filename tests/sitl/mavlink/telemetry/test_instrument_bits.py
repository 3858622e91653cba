"""Instruments that SYS_STATUS reports as present, and those that it reports as healthy."""

import pytest

from protocol.dialect import mavlink
from sitl.mavlink.telemetry.vehicle_state import instrument_bits
from sitl.sensors.instruments import ACCELEROMETER, FIRST_DELAYED, GYROSCOPE, INSTRUMENTS, N_DELAYED, PITOT
from sitl.simulation.avionics import Navigation
from sitl.simulation.navigation_status import Aid, NavigationStatus

TUBE = mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
GYRO, ACCEL = mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO, mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL


def status(*failed, reads=True):
    aids = [Aid()] * N_DELAYED
    aids[PITOT - FIRST_DELAYED] = Aid(read_age=0.0 if reads else 9.0)
    return NavigationStatus(
        source=Navigation.SENSORS, aids=tuple(aids), failed=tuple(k in failed for k in range(INSTRUMENTS))
    )


@pytest.mark.parametrize(("instrument", "bit"), [(PITOT, TUBE), (GYROSCOPE, GYRO), (ACCELEROMETER, ACCEL)])
def test_an_instrument_that_has_failed_is_there_and_not_well(instrument, bit):
    well = instrument_bits(status(), has_position=True, has_tube=True)
    failed = instrument_bits(status(instrument), has_position=True, has_tube=True)
    assert well[0] == failed[0]
    assert well[0] & bit
    assert well[1] & ~failed[1] == bit


def test_a_tube_that_reads_nothing_is_not_well_and_one_that_is_not_aboard_not_there():
    assert not instrument_bits(status(reads=False), has_position=True, has_tube=True)[1] & TUBE
    assert not instrument_bits(status(), has_position=True, has_tube=False)[0] & TUBE


@pytest.mark.parametrize("source", [Navigation.SENSORS, Navigation.MOCAP])
def test_navigation_goes_on_without_a_tube_that_has_failed(source):
    helps = (Aid(0.0, 0.0),) * N_DELAYED
    assert status(PITOT)._replace(source=source, aids=helps).unfused == ("pitot tube",)
    assert status()._replace(source=source, aids=helps).unfused == ()
