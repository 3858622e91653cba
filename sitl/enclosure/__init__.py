"""Surroundings of the vehicle: net, obstacles and wind wall, read from a file, and ways round them.

The plant feels them by the kernels of :mod:`sitl.enclosure.wind_field` and :mod:`sitl.enclosure.solids`; the autopilot
knows the same geometry. The laws know nothing of it.
"""
