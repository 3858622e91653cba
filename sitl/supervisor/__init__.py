"""Supervisor: which law flies. The hybrid automaton as data: guards, reset maps and the table of jumps.

Here each guard and each reset map is defined once; the compiled loop and the diagram are made from the table.
May import the model and the control laws; knows no mode, mission or message.
"""
