"""The ground station in the terminal.

Rooms, each of which imports only rooms below it: ``commands``; ``tui``, ``tasks`` and ``logs``; ``feed``; ``station``;
``state``. Every room may import ``errors`` and the shared package ``protocol``.
"""
