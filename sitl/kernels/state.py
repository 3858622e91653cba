"""Layout of the plant's state vector, one flat float64 array of length ``SIZE``.

Positions and velocities are world NWU, body rates body FLU, actuators in the order left motor, right motor,
left elevon, right elevon. The anchors are where each of the four tail contacts stuck to the ground
(world x, y per contact; NaN while it is in the air).
"""

P = 0  # position p [m], 3 entries
V = 3  # velocity v [m/s], 3 entries
Q = 6  # attitude q [-], 4 entries
W = 10  # body rates (p, q, r) [rad/s], 3 entries
ACTUATOR = 13  # w1, w2 [rad/s], delta1, delta2 [rad], 4 entries
ANCHOR = 17  # contact anchors, 8 entries
SIZE = 25
