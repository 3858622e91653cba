"""Recorded flights as numbers and pictures: summary, time series, a page to read.

Belongs here: pure functions of a log that a person asks about; no screen, no link.
May import: ``protocol.tlog``, ``protocol.names.labels``, ``protocol.names.modes``, ``protocol.dialect``.
"""
