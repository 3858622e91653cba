"""The vehicle on MAVLink: everything that knows messages, between the autopilot and the sockets.

:class:`sitl.mavlink.node.Node` is the whole of it. The endpoint (:mod:`protocol.endpoints.endpoint_vehicle`) speaks
MAVLink's services; here its events become calls of the autopilot, and the vehicle's state becomes messages:

- ``node``: puts the services together; the two clocks meet there.
- ``services``: one each for commands, home, operators, parameters, plans, signing and steering. Each marks its methods
  that answer peers (``handlers``).
- ``commands``, ``home_requests``, ``fence_and_rally``, ``offboard_setpoints``, ``manual_control``, ``standard_modes``:
  messages translated into calls of the autopilot.
- ``broadcast``, ``flight_report``: what every peer is told without asking. ``flight_recorder``: what is recorded of it.
- ``telemetry``: messages made from a snapshot of the vehicle. ``files``: what can be downloaded.
- ``transport``: the UDP socket.
"""
