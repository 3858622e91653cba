"""Services: each answers the peers about one thing, by methods marked in ``handlers``; the node puts them together.

May import telemetry, the translations, the autopilot and ``protocol``'s events; services do not import the node.
"""
