"""MAVLink for both sides, the vehicle and the ground station: dialect, codec, services, plan files and telemetry logs.

Its parts, from top to bottom: ``endpoints`` (each side's end of a link, and the router between), ``engines`` (the
services), ``events`` (what engines report), ``flight_plans``, ``plans``, ``flight_log`` and ``tlog`` (files), ``wire``
(frames, messages, signatures), ``names`` and ``dialect`` (numbers and what they are called), ``tools``, and the
conventions of the wire: ``units``, ``frames``, ``mav_frames``, ``covariances``, ``flight_limits``.
May import: no clock, no socket, no screen, no vehicle; time and bytes enter as arguments.
"""
