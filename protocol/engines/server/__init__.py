"""Engines that answer: the vehicle's side of each service, for any number of peers at once.

What one peer can make them remember or send is limited, so that a flood does not stop the vehicle.
May import: the shared modules of ``protocol.engines``; no module of ``protocol.engines.client``.
"""
