"""Limits that both ends keep: of transfers and of flights."""

from __future__ import annotations

MIN_FORWARD_HEIGHT = 3.0
"""Least height of forward flight, and of a front transition [m]."""

MIN_AIRSPEED = 7.0
"""Least airspeed of the cruise: slower speeds are those of the hover [m/s]."""

MAX_AIRSPEED = 22.0
"""Greatest airspeed of the cruise [m/s]."""

LEGS_AHEAD = 8
"""Legs without a stop between them that the vehicle looks ahead, and the most it is asked about."""

MAX_PLAN_ITEMS = 1000
"""Items of a mission, a fence or a set of rally points."""

MAX_PLAN_FILE = 1_000_000
"""Bytes of a file of a flight plan, on the wire and on the disk."""

MIN_CORNERS = 3
"""Corners of a polygon: of a fence, or of a flight plan's sector."""


LOG_DATA_SIZE = 90  # bytes of a log in one LOG_DATA

# A server sends so many messages in every interval: slow enough for the receive buffers of its peers.
SEND_INTERVAL = 0.01  # [s]
MESSAGES_PER_INTERVAL = 10  # files and logs
PARAMETERS_PER_INTERVAL = 5  # of each parameter list
