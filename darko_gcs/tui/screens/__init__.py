"""The screens of the ground station, and dialogs.

Belongs here: what fills the terminal and takes keys of its own.
May import: ``darko_gcs.tui.widgets``, ``actions`` and ``plan_draft``, ``darko_gcs.station``, ``state``, ``protocol``.
"""
