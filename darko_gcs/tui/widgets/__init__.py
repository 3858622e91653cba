"""Panels of the screens: each draws one part of the snapshot as text.

Belongs here: widgets that show a snapshot and take no decision. They send no request.
May import: ``darko_gcs.tui.render``, ``darko_gcs.state`` and ``protocol``.
"""
