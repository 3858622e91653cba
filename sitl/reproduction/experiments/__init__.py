"""One module per experiment of the report: a function of the seed that returns statements and panels.

May import the rest of the reproduction but the textbook systems, the scenarios, the model and the design.
"""
