"""Defaults and limits of the vehicle's options."""

from __future__ import annotations

from protocol.frames import Geodetic

HOME = Geodetic(43.5648, 1.4811, 150.0)
"""The indoor flight arena of ENAC in Toulouse: origin of the local frame, and home until it is moved."""

AIRFRAME = "darko"
"""Name of the parameter set that flies: the aircraft that was built."""

STUDY_AIRFRAME = "collage"
"""Name of the parameter set that studies fly unless told: that of the figures in the documentation."""

MAX_ORIGIN_LATITUDE = 89.0  # of the local frame, north or south: at the poles east and north have no direction [deg]
MAX_ORIGIN_ALTITUDE = 10e3  # above or below the sea [m]

CONTROLLER_NAMES = ("hybrid", "report", "indi")
"""Names of the controllers that fly anything; the first flies unless told."""

HOVERING_CONTROLLER = "robust-pi"
"""Name of the controller that hovers only."""

GENTLE, BRISK = range(2)
"""Paces of INDI; the first flies unless told."""

EXPORTED = "c:"
"""Before the folder of an exported controller, where a controller is named."""
