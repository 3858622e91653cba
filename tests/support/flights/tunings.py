"""Tunings that tests fly with."""

from sitl.simulation.tuning import Tuning

EVERY_LAW = Tuning(forward_linear=1)  # the linear forward law too, which is off by default
