"""Commands: one module for each command of ``darko-sitl``, its arguments and what it prints.

Here belongs what a person types and reads. Each module imports what it runs only when it runs.
May import everything of the vehicle; nothing imports a command.
"""
