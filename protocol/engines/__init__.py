"""Micro-services of MAVLink as engines without sockets or clocks: bytes and time enter as arguments.

After any call, drain ``messages_to_send()`` and ``events()`` and re-arm a timer for ``next_deadline()``.
"""
