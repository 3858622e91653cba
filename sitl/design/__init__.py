"""Design: gains, trims and proofs, computed before the flight from the model the laws are designed on.

Here belongs what turns an airframe into the numbers that a law flies with, to the same bit on every processor.
May import the model and the gains' types in control; a flight calls nothing in here.
"""
