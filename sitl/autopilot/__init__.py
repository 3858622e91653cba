"""The autopilot: modes, arming, requests, missions and failsafes. It decides where to go; the laws decide how.

Here belong decisions on simulated time, with MAVLink's numbers as vocabulary: no message, no disk, no clock, no wire.
May import ``sitl.guidance``, ``sitl.prediction`` and what they stand on, and ``protocol``'s frames, modes and plans.
"""
