"""Limits of the local frame's origin, when the vehicle starts and when it is moved."""

MAX_ORIGIN_LATITUDE = 89.0  # north or south: at the poles east and north have no direction [deg]
MAX_ORIGIN_ALTITUDE = 10e3  # above or below the sea [m]
