"""Engines that ask: the ground station's side of each service, one remote vehicle at a time.

Each request ends in exactly one event that reports success or failure.
May import: the shared modules of ``protocol.engines``; no module of ``protocol.engines.server``.
"""
