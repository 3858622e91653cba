"""Maps: what lies where, north up.

Here belongs what draws and moves maps; what is on other panels belongs into ``widgets``. Imports widgets and drawings.
"""
