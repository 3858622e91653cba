"""Bytes and messages: frames cut out of a stream, messages packed and unpacked, signatures made and checked.

Belongs here: what every frame of either side passes through. May import ``protocol.dialect`` and ``protocol.errors``;
no service, no plan, no log.
"""
