"""Motion capture: a simulated Motive that streams the rigid body of a running vehicle by NatNet.

Here belong the packets, the rigid body and its pose by markers, the cameras' errors, and the server.
It sees the vehicle over MAVLink alone, and shares the instrument's specification and error model with `sitl/sensors`.
"""
