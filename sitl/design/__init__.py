"""Gains and trims, computed off line from the models the laws are designed on, to the same bit on every processor."""
