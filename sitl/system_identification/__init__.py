"""System identification: the airframe's parameters from a recorded flight, and a flight that tells them.

Here belongs what reads sensors and commands out of a log, replays them through the model and says how sure it is.
May import the model, the simulation and the wire's logs; knows no autopilot, no study and no MAVLink node.
"""
