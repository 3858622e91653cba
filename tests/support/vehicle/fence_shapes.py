"""A fence and rally points as mission items."""

import numpy as np

from protocol.plans.plan import MissionItem


def corner(count, latitude, longitude, command=5001, frame=0):
    return MissionItem(
        command=command, frame=frame, params=(float(count), 0.0, 0.0, 0.0), x=latitude, y=longitude, z=0.0
    )


SHAPES = (
    corner(3, 435_000_001, 14_000_000),
    corner(3, 435_100_000, 14_000_000),
    corner(3, 435_100_000, 14_100_003),
    *[corner(4, 435_050_000 + n * 1000, 14_050_000 + n * n * 1000, 5002, 3) for n in range(4)],
    MissionItem(
        command=5003, frame=0, params=(np.float32(123.4).item(), 0.0, 0.0, 0.0), x=435_000_000, y=14_000_000, z=0.0
    ),
    MissionItem(command=5004, frame=0, params=(7.5, 0.0, 0.0, 0.0), x=435_000_000, y=14_000_000, z=0.0),
)


POINTS = (
    MissionItem(
        command=5100, frame=3, params=(0.0, 0.0, 0.0, 0.0), x=435_000_000, y=14_000_000, z=np.float32(12.3).item()
    ),
    MissionItem(command=5100, frame=0, params=(0.0, 0.0, 0.0, 0.0), x=435_000_001, y=-14_000_000, z=162.5),
)
