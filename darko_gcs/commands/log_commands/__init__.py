"""The subcommands of ``darko-gcs log``, one module each.

Here belongs what the user types about recorded flights, and how results are printed. May import: anything.
"""
