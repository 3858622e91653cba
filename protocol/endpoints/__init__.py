"""One end of MAVLink each: the vehicle's and the ground station's, and what leads the frames of many peers there.

Belongs here: what joins codec and engines to a whole side, still without a socket and a clock. May import anything of
``protocol``; no other room of it imports this one.
"""
