"""The command line: one module per command of ``darko-gcs``.

Belongs here: options, help and printing of results. ``--help`` must be quick: modules load screens and wire in ``run``.
May import: every other room of ``darko_gcs``, and ``protocol``.
"""
