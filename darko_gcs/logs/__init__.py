"""Recorded flights as text and files.

Belongs here: what ``darko-gcs log`` prints and writes; pure functions, no link and no screen. The numbers come from
``protocol.flight_log``.
May import: ``darko_gcs.state``, ``darko_gcs.errors`` and ``protocol``.
"""
