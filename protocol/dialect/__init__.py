"""DarkO's MAVLink dialect: ``darko.xml`` and the module generated from it at build time.

Use ``from protocol.dialect import mavlink``; message classes, enums and field names are the dialect's own.
"""
