"""DarkO's MAVLink dialect: ``darko.xml`` and two modules that ``scripts/build_dialect.py`` generates from it.

``mavlink`` has the message classes and enums of the whole dialect; ``vocabulary`` has DarkO's own enums as Python
types with labels: use these instead of numbers.
May import: nothing of this project.
"""
