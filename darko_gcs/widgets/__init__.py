"""Panels of the flight screen: each draws one part of the snapshot as text."""
