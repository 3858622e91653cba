"""Tools that know no message: option values, loopback addresses, rate limits, clocks matched, files written at once.

Belongs here: what would serve another protocol as well. May import ``protocol.errors`` alone.
"""
