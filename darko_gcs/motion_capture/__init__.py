"""Motion capture: from any NatNet server to any MAVLink autopilot.

Here belong the client's side of NatNet, the change of axes, and the messages that carry poses.
May import the errors, the station's keyring and the wire; knows no screen.
"""
