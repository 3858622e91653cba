"""Safety: where the vehicle may be, when it may arm, and what is watched in flight.

Here belong arena, fence, rally points and home, the checks before arming, and the watches of battery, fence and links.
May import ``sitl.guidance``, ``sitl.prediction``, the autopilot's settings and what they stand on; no flight state.
"""
