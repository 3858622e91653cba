"""Defaults of the vehicle's options."""

from __future__ import annotations

from protocol.frames import Geodetic

HOME = Geodetic(43.5648, 1.4811, 150.0)
"""The indoor flight arena of ENAC in Toulouse: origin of the local frame, and home until it is moved."""

AIRFRAME = "physical"
"""Name of the parameter set that flies: a measured propeller, a battery, a wing that stalls."""
