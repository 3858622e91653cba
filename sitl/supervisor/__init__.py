"""Which law flies: the hybrid automaton as data, its guards and reset maps defined once and compiled from there.

May import the model and the control laws; knows no mode, mission or message.
"""
