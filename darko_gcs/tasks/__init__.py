"""Jobs over a link from beginning to end, without a screen: fly a mission, download logs, change the signing key.

Belongs here: one module per job; a job opens its own link and closes it.
May import: ``darko_gcs.feed``, ``darko_gcs.station``, ``darko_gcs.state``, ``darko_gcs.errors`` and ``protocol``.
"""
