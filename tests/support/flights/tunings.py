"""Tunings that tests fly with."""

from sitl.simulation.tuning import REPORTED, Tuning

BY_REPORT = Tuning(controller=REPORTED)  # for tests of its laws and jumps
EVERY_LAW = BY_REPORT._replace(forward_linear=1)  # the linear forward law too, which is off by default
