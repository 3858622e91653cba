"""One operator's side of one vehicle: the ground endpoint, the snapshot and the recording together, with its clients.

Belongs here: requests to the vehicle and the clients behind them. Time and bytes are arguments, there is no socket.
May import: ``darko_gcs.state``, ``darko_gcs.errors`` and ``protocol``.
"""
