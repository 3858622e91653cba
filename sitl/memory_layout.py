"""Layout of the memory the flow keeps beside the plant's state, one flat float64 array of length ``MEMORY``."""

LAW = 0  # q_d, f of the zero-moment law, 5 entries
INTEGRAL = 5  # of the linear law, world [m s], 3 entries
GUST = 8  # world NWU [m/s], 3 entries
COMMAND = 11  # in force this tick: w1, w2, d1, d2, 4 entries
ENERGY = 15  # at the shafts [J]
AT_REST = 16  # how long it has rested on the ground [s]
GOVERNOR = 17  # share of the force the governor takes away, 0..1
LYAPUNOV = 18  # V of the linear hover law
LYAPUNOV_FORWARD = 19  # V of the linear forward law; NaN while it has no leg
SINCE = 20  # how long the law has been in force [s]; negative while it flies off what it was handed
HOLD = 21  # where the alignment stays, world NWU [m], 3 entries
COURSE = 24  # azimuth the belly or the nose is to point to [rad]
ACCELERATION = 25  # of the last tick, world NWU [m/s2], 3 entries
GIVEN_UP = 28  # DARKO_GIVEN_UP bits of the last tick
CROSS_TRACK = 29  # distance to the left of the path [m]
SIGHT = 30  # state of the line-of-sight law, 16 entries
AIR = 46  # state of the wind estimator, its first three the wind [m/s], 12 entries
REPORT = 58  # state of the report's own line-of-sight law, 4 entries
ATTITUDE = 62  # state of the attitude law, 11 entries
LYAPUNOV_ATTITUDE = 73  # V of the attitude law [rad2]; NaN while it does not fly
BUMP = 74  # what a law taking over commanded less at first, fading; first entry NaN: still to be found, 4 entries
MEMORY = 78
