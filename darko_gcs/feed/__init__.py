"""Sources of snapshots: a vehicle on a UDP link, with or without a vehicle process of our own, or a recording.

Belongs here: sockets, clocks, the vehicle process and the player of recordings.
May import: ``darko_gcs.station``, ``darko_gcs.state``, ``darko_gcs.errors`` and ``protocol``.
"""
