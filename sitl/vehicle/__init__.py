"""The whole vehicle on simulated time: simulation and autopilot together, its parameters, what is injected and watched.

Belongs here: what joins the rooms below to one aircraft. May import them, down to the model; it knows no message, no
socket and no clock.
"""
