"""Sensors: what each instrument reads of the plant, how wrongly and how late.

Here belong the specifications of the instruments, with units and sources, and their compiled models.
May import the model; knows no estimator and no law.
"""
