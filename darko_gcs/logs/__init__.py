"""Recorded flights as numbers and text.

Belongs here: what ``darko-gcs log info`` computes and prints; pure functions, no link and no screen.
May import: ``darko_gcs.state``, ``darko_gcs.errors`` and ``protocol``.
"""
