"""The choice between the two quaternions of an attitude error: a discrete state with hysteresis.

q and -q are one attitude. A law that always takes the nearer way, sgn(eta) eps, changes its mind with every draw of
noise where both ways are equally long, at 180 deg, and can be held there. So the side h is kept, and jumps to -h only
where h eta < -HYSTERESIS (Mayhew, Sanfelice and Teel, IEEE Transactions on Automatic Control 56, 2011). A jump
shortens the way: V = 4 (1 - h eta) of the attitude falls by at least 8 HYSTERESIS, so jumps cannot accumulate.
"""

from sitl.compiled import kernel

HYSTERESIS = 0.1  # of eta: a way is given up once it is 23 deg longer than the other
NOT_CHOSEN = 0.0  # on entry to a law: the nearer side is taken in its first tick


@kernel
def kept(side: float, eta: float) -> float:
    """The side after its jumps, 1 or -1.

    Args:
        side: As it was: 1, -1 or NOT_CHOSEN.
        eta: Scalar part of the attitude error.
    """
    nearer = 1.0 if eta >= 0.0 else -1.0
    return nearer if side == NOT_CHOSEN or side * eta < -HYSTERESIS else side
