"""Hybrid systems: a generic engine on hybrid time (t, j), the textbook systems, the vehicle's supervisor."""
