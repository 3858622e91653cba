"""Named scenarios: targets and winds over time, flown as fast as possible or live for a ground station, and plotted.

May import the simulation and, for the live flight, the autopilot; the vehicle process and the commands import it. It
knows no MAVLink node, no study and nothing of the reproduction.
"""
