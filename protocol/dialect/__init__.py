"""DarkO's MAVLink dialect: ``darko.xml`` and two modules generated from it at build time.

Use ``from protocol.dialect import mavlink``: message classes, enums and field names are the dialect's own. The numbers
that DarkO itself defines are types in ``protocol.dialect.vocabulary``: use these, not their values.
"""
