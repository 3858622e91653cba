"""Drawing as pure functions: numbers in, styled text out.

Belongs here: the horizon, bars, charts and maps in characters. No snapshot, no widget.
May import: ``protocol.frames``.
"""
