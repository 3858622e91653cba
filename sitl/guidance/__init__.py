"""Guidance: manoeuvres, legs, circles and moving set-points, each of which makes the reference of the control laws.

Here belongs what turns a wish (a point, a velocity, an attitude) into a ``Reference`` at every tick of the autopilot.
May import ``sitl.control``, ``sitl.design``, ``sitl.model`` and ``protocol``'s frames and vocabulary; nothing above.
"""
