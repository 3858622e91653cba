"""Numbers of the wire by their names: enumerations, modes, failures, values of commands.

Here belongs what gives a number its meaning; how it travels belongs beside the codec. Imports the dialect alone.
"""
