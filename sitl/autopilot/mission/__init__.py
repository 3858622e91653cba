"""Missions: which are accepted, and how their items are flown.

Here belongs what gives a mission item its meaning in flight. The transfer of missions is ``sitl.mavlink``'s.
May import ``sitl.autopilot.safety``, ``routes`` and ``settings``, and what ``sitl.autopilot`` may; no flight state.
"""
