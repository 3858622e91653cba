"""The matrices that the report prints, digit by digit."""

import math

import numpy as np

DIGIT = 0.005  # half a unit of the last printed digit

# Section 3.1.2: A of (p, v, eps, w) at the hover is printed in symbols; these are what it multiplies.
_TILT, _TURN = math.sqrt(2.0), math.sqrt(2.0) / 4.0
PRINTED_TILT = np.array([[0.0, 2.0 * _TILT, 0.0], [-_TILT, 0.0, _TILT], [0.0, -_TILT, 0.0]])  # times g
PRINTED_TURN = np.array([[_TURN, 0.0, -_TURN], [0.0, _TURN, 0.0], [_TURN, 0.0, _TURN]])
# Section 3.1.3: the LQR gain; its seventh column belongs to the quaternion's scalar.
PRINTED_GAIN = np.array(
    [
        [0.08, -0.71, 0.70, 0.14, -1.04, 0.92, 0.00, 5.75, -1.29, -5.69, 0.05, 0.00, -0.81],
        [0.08, 0.71, 0.70, 0.14, 1.04, 0.92, 0.00, -5.75, -1.29, 5.69, -0.05, 0.00, 0.81],
        [-0.70, -0.05, 0.08, -1.13, -0.07, 0.09, 0.00, -0.11, -15.32, -0.88, -0.71, -1.41, -0.06],
        [-0.70, 0.05, 0.08, -1.13, 0.07, 0.09, 0.00, 0.11, -15.32, 0.88, 0.71, -1.41, 0.06],
    ]
)
# Section 4.1: the linear model at 5 m/s.
PRINTED_A = np.array(
    [
        [0, 0, 0, 1, 0, 0, 0, 0, 0, 0],
        [0, -2.56, 0, 1.58, 0, 53.84, 0, 0, 0, 0],
        [0, 0, 0, 0, -16.76, 0, 10.20, -0.05, 0, -0.12],
        [0, 1.30, 0, -0.83, 0, -20.06, 0, 0, 0, 0],
        [0, 0, 0, 0, 0, 0, 0, 0.43, 0, -0.26],
        [0, 0, 0, 0, 0, -0.27, 0, 0, 0.43, 0],
        [0, 0, 0, 0, 0, 0, 0, 0.26, 0, 0.43],
        [0, 0, 0, 0, 0, 0, 0, -3.42, 0, 0.17],
        [0, 4.77, 0, -5.87, 0, -90.65, 0, 0, -7.77, 0],
        [0, 0, 0, 0, 0, 0, 0, -0.98, 0, 0.41],
    ]
)
PRINTED_B = np.array(
    [
        [0, 0, 0, 0],
        [0.92, 0.92, 2.31, 2.31],
        [0, 0, 0, 0],
        [1.79, 1.79, -1.21, -1.21],
        [0, 0, 0, 0],
        [0, 0, 0, 0],
        [0, 0, 0, 0],
        [7.33, -7.33, -68.36, 68.36],
        [0, 0, -11.60, -11.60],
        [-25.58, 25.58, -0.18, 0.18],
    ]
)

# Section 3.2: the pseudo-inverse of M_b.
PRINTED_INVERSE = np.array([[0, 0, -3.23], [0, 0, 3.23], [-4.51, -27.75, -1.49], [4.51, -27.75, 1.49]])
PRINTED_START = np.array([0.90, 0.19, 0.36, 0.15])  # section 3.2.2: the quaternion of roll 10, pitch -45, yaw 25 deg
