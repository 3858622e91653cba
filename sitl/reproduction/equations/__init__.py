"""The report's own equations, numbers and plants, used by no flight of the vehicle; compiled code is only here.

May import the model, the control laws and their design; knows no scenario and no figure.
"""
