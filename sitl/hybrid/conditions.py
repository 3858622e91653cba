"""What the supervisor's guards look at, as bits: each is one inequality of the vehicle's state or one order.

The compiled flow evaluates them after every tick; the table of jumps names them. So flow sets and jump sets are one
statement, made once.
"""

from enum import IntFlag


class Condition(IntFlag):
    """One bit each."""

    ARMED = 1 << 0
    FLYING = 1 << 1  # the autopilot wants to be in the air
    RESTING = 1 << 2  # landing, and at rest on the ground
    NEAR = 1 << 3  # V of the linear hover law below v_enter
    FAR = 1 << 4  # V of the linear hover law above v_leave
    WANTED = 1 << 5  # the autopilot wants forward flight
    WORTH = 1 << 6  # enough of the path is left to tip over for
    ALIGNED = 1 << 7  # upright, slow, the belly towards the course
    CALM = 1 << 8  # upright and slow enough to begin the alignment
    WING_BORNE = 1 << 9  # fast enough for the wing to carry
    STOP_DUE = 1 << 10  # what is left of the path is what braking takes
    STRAIGHT = 1 << 11  # the path is a leg
    ON_TRIM = 1 << 12  # V of the linear forward law below its entry threshold
    OFF_TRIM = 1 << 13  # V of the linear forward law above its exit threshold, or undefined; of the attitude law, lost
    STANDING = 1 << 14  # upright and nearly at rest: the transition is over
    FALLING = 1 << 15  # sinking faster than any law asks for, or too near the ground to go on so
    RECOVERED = 1 << 16  # upright and slow after a failsafe
    DWELT = 1 << 17  # the law has been in force for its dwell time
    SETTLED = 1 << 19  # V of the linear hover law far below v_enter
    WINDY = 1 << 20  # more wind than the laws hover well in that do not know of it
    STILL = 1 << 21  # clearly less than that
    SLIDING = 1 << 22  # upright laws that move fast with the nose down, and have for some time
    STEERED = 1 << 23  # attitude set-points are coming
    ROOM = 1 << 18  # far more than the braking distance is left of the path
