"""MAVLink for both sides, the vehicle and the ground station: dialect, codec, services, plan files and telemetry logs.

Its parts, from top to bottom: ``endpoint_vehicle`` and ``endpoint_ground`` (one end of a link each), ``router`` and
``links`` (many peers), ``engines`` (the services), ``events`` (what engines report), ``codec``, ``plans`` and ``tlog``
(bytes and files), ``keyring`` and ``signing``, and the conventions of the wire: ``units``, ``frames``, ``mav_frames``,
``modes``.
May import: no clock, no socket, no screen, no vehicle; time and bytes enter as arguments.
"""
