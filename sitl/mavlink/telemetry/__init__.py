"""Telemetry: one function per message, each made from one snapshot of the vehicle, and when each is sent.

May import the aircraft and ``protocol``; knows no service and no peer.
"""
