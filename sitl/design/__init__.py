"""Gains and trims, computed off line with scipy from the models the laws are designed on."""
