"""Covariances on the wire: a symmetric matrix of six rows and columns, sent as its upper right triangle, row by row.

https://mavlink.io/en/messages/common.html#ODOMETRY
"""

from __future__ import annotations

__all__ = ["ATTITUDE_VARIANCES", "COVARIANCE_DIAGONAL", "COVARIANCE_SIZE", "POSITION_VARIANCES"]

COVARIANCE_SIZE = 21
"""Numbers of the triangle."""

COVARIANCE_DIAGONAL = (0, 6, 11, 15, 18, 20)
"""Where the triangle holds the variances."""

POSITION_VARIANCES, ATTITUDE_VARIANCES = COVARIANCE_DIAGONAL[:3], COVARIANCE_DIAGONAL[3:]
"""The first three, of a position or a velocity, and the last three, of angles or rates."""
