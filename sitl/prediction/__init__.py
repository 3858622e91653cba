"""Hover or cruise: what a leg takes either way, flown beforehand by a point mass under the laws' guidance; the choice.

May import the model, the control laws, their design and tuning, constants of the supervisor's guards, and of the
autopilot its legs, view and settings; knows no mode, mission or message.
"""
