"""Tunings that tests fly with."""

from sitl.simulation.tuning import REPORT, Tuning

BY_REPORT = Tuning(controller=REPORT)  # for tests of its laws and jumps
EVERY_LAW = BY_REPORT._replace(forward_linear=1)  # the linear forward law too, which is off by default
