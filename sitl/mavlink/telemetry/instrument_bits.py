"""Bits of the instruments that SYS_STATUS reports as present, enabled and healthy.

https://mavlink.io/en/messages/common.html#MAV_SYS_STATUS_SENSOR
"""

from __future__ import annotations

from protocol.dialect import mavlink
from sitl.sensors.instruments import (
    ACCELEROMETER,
    BAROMETER,
    EXTERNAL_POSE,
    GNSS,
    GYROSCOPE,
    MAGNETOMETER,
    MOTION_CAPTURE,
    PITOT,
)
from sitl.simulation.avionics import Navigation
from sitl.simulation.navigation_status import NavigationStatus

INERTIAL_BITS = {
    GYROSCOPE: mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO,
    ACCELEROMETER: mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL,
}
INERTIAL = sum(INERTIAL_BITS.values())
POSE = mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION
# What stock clients need before they arm, though a vehicle on the exact state has no instrument at all.
ON_TRUTH = INERTIAL | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG | mavlink.MAV_SYS_STATUS_SENSOR_GPS
OUTDOOR_BITS = {
    MAGNETOMETER: mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG,
    BAROMETER: mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
    GNSS: mavlink.MAV_SYS_STATUS_SENSOR_GPS,
}


def instrument_bits(n: NavigationStatus, *, has_position: bool, has_tube: bool) -> tuple[int, int]:
    """MAV_SYS_STATUS_SENSOR bits of what is present and of what is healthy.

    An instrument is healthy while the filter uses it; before that, while it reads. The pitot tube, gyroscope and
    accelerometer are until the filter finds that they fail.

    Args:
        n: Of the vehicle.
        has_position: The position is known.
        has_tube: There is a pitot tube.
    """
    if not n.is_sensed:
        return ON_TRUTH, ON_TRUTH
    present = INERTIAL
    health = sum(bit for instrument, bit in INERTIAL_BITS.items() if not n.failed[instrument])
    present |= mavlink.MAV_SYS_STATUS_AHRS
    health |= mavlink.MAV_SYS_STATUS_AHRS if has_position else 0
    bits = OUTDOOR_BITS if n.source is Navigation.SENSORS else {MOTION_CAPTURE: POSE}
    for instrument, bit in bits.items():
        present |= bit
        health |= bit if _works(n, instrument) else 0
    if n.aid(EXTERNAL_POSE).reads:
        present |= POSE
        health |= POSE if _works(n, EXTERNAL_POSE) else 0
    if has_tube:
        present |= mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
        works = n.aid(PITOT).reads and not n.failed[PITOT]
        health |= mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE if works else 0
    return present, health


def _works(n: NavigationStatus, instrument: int) -> bool:
    aid = n.aid(instrument)
    return aid.helps if n.is_aligned else aid.reads
