"""State of the ground station: an immutable snapshot, and pure functions that fold messages and events into it.

Belongs here: values, reducers, and names or labels for numbers on the wire. No clock, no socket, no request.
May import: ``protocol`` only.
"""
