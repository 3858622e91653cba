"""Flights under a net and before a wind wall."""
